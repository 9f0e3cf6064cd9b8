/** The best of a kind of sample over the last one to two windows, so that a drift of either clock is followed. */
class Best {
  private current = Infinity;
  private currentValue = NaN;
  private previous = Infinity;
  private previousValue = NaN;
  private windowStart = -Infinity;

  constructor(private readonly windowMs: number) {}

  /** Takes a sample at `nowMs`; the lower its score the better. */
  add(score: number, value: number, nowMs: number): void {
    if (nowMs - this.windowStart >= this.windowMs) {
      this.previous = this.current;
      this.previousValue = this.currentValue;
      this.current = Infinity;
      this.windowStart = nowMs;
    }
    if (score < this.current) {
      this.current = score;
      this.currentValue = value;
    }
  }

  /** Value of the best sample; NaN before the first. */
  get value(): number {
    return this.current <= this.previous ? this.currentValue : this.previousValue;
  }

  reset(): void {
    this.current = this.previous = Infinity;
    this.currentValue = this.previousValue = NaN;
    this.windowStart = -Infinity;
  }
}

/**
 * How far our clock is ahead of the server's, by running minima.
 *
 * A message that carries its sending time gives `received - sent` = offset + delay with delay >= 0: the smallest such
 * sample bounds the offset from above. A ping answered in the middle of its round trip gives the offset itself, wrong by
 * half the round trip at most: the shortest round trip is the best one. The estimate is the lower of the two.
 */
export class ServerClock {
  private readonly bound: Best;
  private readonly exchange: Best;

  /** @param windowMs length of one window [ms]; a sample counts for one to two of them */
  constructor(windowMs = 30_000) {
    this.bound = new Best(windowMs);
    this.exchange = new Best(windowMs);
  }

  /** Learns from one message sent at `sentMs` on the server's clock. @throws RangeError for times that are not finite */
  observe(sentMs: number, receivedMs: number): void {
    requireFinite(sentMs, receivedMs);
    this.bound.add(receivedMs - sentMs, receivedMs - sentMs, receivedMs);
  }

  /** Learns from a ping sent at `askedMs` and answered at `answeredMs` on the server's clock. @throws RangeError as `observe` */
  observeExchange(askedMs: number, answeredMs: number, receivedMs: number): void {
    requireFinite(askedMs, answeredMs, receivedMs);
    this.exchange.add(receivedMs - askedMs, (askedMs + receivedMs) / 2 - answeredMs, receivedMs);
    this.observe(answeredMs, receivedMs);
  }

  /** Ours minus the server's [ms]; NaN before the first sample. */
  get offsetMs(): number {
    const { value } = this.exchange;
    return Number.isNaN(value) ? this.bound.value : Math.min(value, this.bound.value);
  }

  /** The server's time on our clock [ms]; NaN before the first sample. */
  toOurs(serverMs: number): number {
    return serverMs + this.offsetMs;
  }

  /** Forgets everything: a restarted server has another clock. */
  reset(): void {
    this.bound.reset();
    this.exchange.reset();
  }
}

function requireFinite(...times: number[]): void {
  if (!times.every(Number.isFinite)) throw new RangeError(`a clock sample needs finite times, got ${times.join(", ")}`);
}
