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

/** The prices of the newest frames that reports told of, oldest first. */
export class PriceLog {
  private readonly kept: Price[] = [];

  constructor(private readonly capacity = 600) {}

  get prices(): readonly Price[] {
    return this.kept;
  }

  /**
   * Keeps what a report tells of all frames since the one before, while this deadline stands. One without an estimate is left out, and one with
   * none above 0, which has no logarithm.
   * @returns whether any was kept
   */
  add({ solved = [] }: ReportMessage, deadlineMs: number | null): boolean {
    const known = solved.flatMap(({ error, solver_ms: solverMs, late_ms: lateMs = 0 }) =>
      error === null || error <= 0 ? [] : [{ errorMm: 1000 * error, solverMs, lateMs, deadlineMs }],
    );
    this.kept.push(...known);
    this.kept.splice(0, this.kept.length - this.capacity);
    return known.length > 0;
  }

  reset(): void {
    this.kept.length = 0;
  }
}
