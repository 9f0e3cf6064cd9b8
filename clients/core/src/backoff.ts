/**
 * When to try again after a lost connection: the wait doubles from `firstMs` to `mostMs` and each wait is drawn
 * between half and the whole of that, so that clients cut off together do not come back together.
 */
export class Backoff {
  private failures = 0;

  constructor(
    private readonly random: () => number = Math.random,
    private readonly firstMs = 250,
    private readonly mostMs = 8_000,
  ) {}

  /** Attempts that failed since the last success. */
  get attempts(): number {
    return this.failures;
  }

  /** Records a failure and returns how long to wait before the next attempt [ms]. */
  next(): number {
    const whole = Math.min(this.mostMs, this.firstMs * 2 ** this.failures);
    this.failures += 1;
    return whole * (0.5 + 0.5 * this.random());
  }

  /** Records a success. */
  reset(): void {
    this.failures = 0;
  }
}
