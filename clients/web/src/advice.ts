import { byId, setText } from "./dom.ts";

/** Advice comes and goes with the motion, a report at a time; it stays readable for this long after the last one. */
const STAYS_MS = 5_000;

/** What the solver says to be out of bounds, and what to try, under the status line. */
export class AdviceLine {
  private readonly line = byId("advice");
  private timer = 0;

  show(advice: string): void {
    if (!advice) return;
    const sentence = advice[0].toUpperCase() + advice.slice(1);
    setText(this.line, sentence);
    this.line.title = sentence; // a narrow page shows its beginning
    this.line.hidden = false;
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.hide(), STAYS_MS);
  }

  hide(): void {
    window.clearTimeout(this.timer);
    this.line.hidden = true;
  }
}
