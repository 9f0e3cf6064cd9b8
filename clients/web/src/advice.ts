import { byId, setText } from "./dom.ts";

/** Advice comes and goes with the motion, a report at a time; it stays readable for this long after the last one. */
const STAYS_MS = 5_000;

/** a sentence stands for so long before it is told again with other figures, which change with every report */
const READABLE_MS = 1_500;

/** What the solver says to be out of bounds, and what to try, under the status line. */
export class AdviceLine {
  private readonly line = byId("advice");
  private readonly text = byId("advice-text");
  private timer = 0;
  private told = { advice: "", atMs: -Infinity };

  show(advice: string): void {
    if (!advice) return;
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.hide(), STAYS_MS);
    const now = performance.now();
    if (!this.line.hidden && now - this.told.atMs < READABLE_MS && wording(advice) === wording(this.told.advice)) return;
    this.told = { advice, atMs: now };
    const sentence = advice[0].toUpperCase() + advice.slice(1);
    setText(this.text, sentence);
    this.line.title = sentence; // a narrow page shows its beginning
    this.line.hidden = false;
  }

  hide(): void {
    window.clearTimeout(this.timer);
    this.line.hidden = true;
  }
}

/** Advice without its figures. */
function wording(advice: string): string {
  return advice.replace(/[\d.]+/g, "#");
}
