/** Numbers for a readout, measured over a sliding window without allocating per sample. */

/** Events per second over the last `capacity` events. */
export class RateMeter {
  private readonly times: Float64Array;
  private count = 0;

  constructor(capacity = 60) {
    this.times = new Float64Array(capacity);
  }

  /** Records one event at `nowMs`. */
  tick(nowMs: number): void {
    this.times[this.count % this.times.length] = nowMs;
    this.count += 1;
  }

  /**
   * Events per second at `nowMs`, counting only the last `horizonMs`; 0 with fewer than two events there, so that a
   * stream that has stopped reads 0 instead of its last rate.
   */
  rate(nowMs: number, horizonMs = 2_000): number {
    const kept = Math.min(this.count, this.times.length);
    let inside = 0;
    let oldest = nowMs;
    let newest = -Infinity;
    for (let i = 0; i < kept; i += 1) {
      const time = this.times[i];
      if (nowMs - time > horizonMs) continue;
      inside += 1;
      oldest = Math.min(oldest, time);
      newest = Math.max(newest, time);
    }
    return inside >= 2 && newest > oldest ? ((inside - 1) * 1000) / (newest - oldest) : 0;
  }

  reset(): void {
    this.count = 0;
  }
}

/**
 * Simulated seconds per wall second: 1 is real time. The slope between the oldest and the newest of the last samples;
 * NaN until two samples lie at different wall times. Simulated time that runs backwards (a restart) starts afresh.
 */
export class PaceMeter {
  private readonly simulated: Float64Array;
  private readonly wall: Float64Array;
  private count = 0;

  constructor(capacity = 60) {
    this.simulated = new Float64Array(capacity);
    this.wall = new Float64Array(capacity);
  }

  /** Records that the simulation stood at `simulatedMs` when our clock read `wallMs`. */
  tick(simulatedMs: number, wallMs: number): void {
    const size = this.wall.length;
    if (this.count > 0 && simulatedMs < this.simulated[(this.count - 1) % size]) this.count = 0;
    this.simulated[this.count % size] = simulatedMs;
    this.wall[this.count % size] = wallMs;
    this.count += 1;
  }

  get pace(): number {
    if (this.count < 2) return NaN;
    const size = this.wall.length;
    const newest = (this.count - 1) % size;
    const oldest = this.count > size ? this.count % size : 0;
    const wall = this.wall[newest] - this.wall[oldest];
    return wall > 0 ? (this.simulated[newest] - this.simulated[oldest]) / wall : NaN;
  }

  reset(): void {
    this.count = 0;
  }
}
