import type { ReportMessage } from "@tryon/protocol";

/** What one frame's accuracy took. */
export interface Price {
  /** how far the cloth is estimated to be from balance [mm] */
  readonly errorMm: number;
  /** wall time of solving the frame [ms] */
  readonly solverMs: number;
  /** by which that was longer than its deadline [ms]; 0: it was not */
  readonly lateMs: number;
  /** the deadline that stood when it was reported [ms]; null: none */
  readonly deadlineMs: number | null;
}

/** The prices of the newest reports, oldest first. */
export class PriceLog {
  private readonly kept: Price[] = [];

  constructor(private readonly capacity = 120) {}

  get prices(): readonly Price[] {
    return this.kept;
  }

  /**
   * Keeps what a report tells, while this deadline stands. One of a garment that is asleep is left out, since nothing was solved for its frame, and
   * one without an estimate, or with none above 0, which has no logarithm.
   * @returns whether it was kept
   */
  add({ error, solver_ms: solverMs, late_ms: lateMs = 0, asleep = false }: ReportMessage, deadlineMs: number | null): boolean {
    if (asleep || typeof error !== "number" || error <= 0) return false;
    this.kept.push({ errorMm: 1000 * error, solverMs, lateMs, deadlineMs });
    if (this.kept.length > this.capacity) this.kept.shift();
    return true;
  }

  reset(): void {
    this.kept.length = 0;
  }
}
