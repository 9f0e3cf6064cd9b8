import type { Job } from "@tryon/core";

import { setText } from "./dom.ts";

/** The line that says how a change stands which takes longer, and lets it be cancelled. */
export class JobLine {
  private readonly text: HTMLElement;
  private readonly share: HTMLProgressElement;
  private readonly button: HTMLButtonElement;
  private job: Job | null = null;
  private asked = false;

  /** @param line holds a span, a progress bar and a button */
  constructor(
    private readonly line: HTMLElement,
    cancel: (job: Job) => void,
  ) {
    const [text, share, button] = line.children;
    if (!(text instanceof HTMLElement) || !(share instanceof HTMLProgressElement) || !(button instanceof HTMLButtonElement)) {
      throw new Error("not such a line");
    }
    [this.text, this.share, this.button] = [text, share, button];
    button.addEventListener("click", () => {
      if (this.job === null) return;
      this.asked = button.disabled = true;
      cancel(this.job);
    });
  }

  /** Whether somebody asked for the one that is shown to be cancelled. */
  get cancelled(): boolean {
    return this.asked;
  }

  /** How it stands; null: it is done. */
  show(job: Job | null): void {
    if (this.job?.location !== job?.location) this.asked = this.button.disabled = false;
    this.job = job;
    this.line.hidden = job === null;
    if (job === null) return;
    setText(this.text, job.detail);
    if (job.progress === null) this.share.removeAttribute("value");
    else this.share.value = job.progress;
  }
}
