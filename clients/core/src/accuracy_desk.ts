import type { SetAccuracyMessage, StatusMessage } from "@tryon/protocol";

/** How well a session's frames are solved, and in what time. */
export interface AccuracyChoice {
  /** estimated error that a frame is solved down to [m]; null: as the session's detail has it */
  readonly accuracy: number | null;
  /** wall time that solving a frame may take [ms]; null: what it takes */
  readonly deadlineMs: number | null;
  /** what else frames are solved by: draft, live, fit or reference; null: that which the session was opened with */
  readonly preset: string | null;
}

/** Values in the same order of magnitude as what the server tells again differ by its rounding, at most so much of them. */
const ROUNDING = 1e-6;
const NOTHING_CHOSEN: AccuracyChoice = { accuracy: null, deadlineMs: null, preset: null };

/**
 * Where accuracy, deadline and preset are chosen: says a choice to the session, and follows what the session has, whoever chose
 * it. What is chosen here is kept for the next session that the page opens.
 */
export class AccuracyDesk {
  private current = NOTHING_CHOSEN;
  /** this page has chosen something that the session has not told yet: until it does, it speaks of what was before */
  private owed = false;

  /**
   * @param send says it to the session; lost while there is no connection
   * @param show told of every change, and of every choice at this page, even of what stands already
   */
  constructor(
    private readonly send: (message: SetAccuracyMessage) => void,
    private readonly show: (choice: AccuracyChoice) => void,
  ) {}

  get choice(): AccuracyChoice {
    return this.current;
  }

  /** Somebody at this page chooses. */
  choose(choice: AccuracyChoice): void {
    if (!same(choice, this.current)) {
      this.current = choice;
      this.owed = true;
      this.tell();
    }
    this.show(choice);
  }

  /** Another session begins. One that was joined has a choice of its own. */
  began(joined: boolean): void {
    this.owed = !joined && !same(this.current, NOTHING_CHOSEN);
  }

  /** A connection begins, on which nothing was said yet. */
  welcomed(): void {
    if (this.owed) this.tell();
  }

  /** The session tells what it has. */
  take({ accuracy = null, deadline_ms: deadlineMs = null, preset = null }: StatusMessage): void {
    const told = { accuracy, deadlineMs, preset };
    const known = same(told, this.current);
    if (this.owed && !known) return;
    this.owed = false;
    if (known) return;
    this.current = told;
    this.show(told);
  }

  private tell(): void {
    const { accuracy, deadlineMs, preset } = this.current;
    this.send({ type: "set_accuracy", accuracy, deadline_ms: deadlineMs, preset, request: null });
  }
}

function same(a: AccuracyChoice, b: AccuracyChoice): boolean {
  return equal(a.accuracy, b.accuracy) && equal(a.deadlineMs, b.deadlineMs) && a.preset === b.preset;
}

function equal(a: number | null, b: number | null): boolean {
  return a === null || b === null ? a === b : Math.abs(a - b) <= ROUNDING * Math.max(a, b);
}
