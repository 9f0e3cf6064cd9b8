/** Waits until somebody is done choosing. */
export class Pause {
  private timer = 0;
  private then: (() => void) | undefined;

  get waits(): boolean {
    return this.then !== undefined;
  }

  /** Begins to wait, anew if it does already. */
  begin(ms: number, then: () => void): void {
    window.clearTimeout(this.timer);
    this.then = then;
    this.timer = window.setTimeout(() => this.endNow(), ms);
  }

  /** Waits until `endNow`, however long that is. */
  hold(then: () => void): void {
    window.clearTimeout(this.timer);
    this.then = then;
  }

  endNow(): void {
    const { then } = this;
    this.cancel();
    then?.();
  }

  cancel(): void {
    window.clearTimeout(this.timer);
    this.then = undefined;
  }
}
