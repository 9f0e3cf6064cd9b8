/** An axis of a plot. */
export interface Axis {
  readonly ends: readonly [number, number];
  /** where it is labelled, ascending, its ends included */
  readonly labels: readonly number[];
  /** where it is marked besides */
  readonly marks: readonly number[];
  /** where a value lies: 0 at the first end, 1 at the other */
  readonly at: (value: number) => number;
}

/** labels that an even axis has at least, besides 0 */
const PARTS = 2;

/**
 * An axis from 0 on that holds the value `most`, above 0, with evenly spaced labels: one, two or five times a power of
 * ten apart.
 */
export function evenAxis(most: number): Axis {
  const power = 10 ** Math.floor(Math.log10(most / PARTS));
  const step = [5, 2, 1].map((times) => times * power).find((length) => length * PARTS <= most) ?? power;
  const count = Math.ceil(most / step - 1e-9);
  const labels = Array.from({ length: count + 1 }, (_, i) => Number((i * step).toPrecision(6)));
  const end = labels[count];
  return { ends: [0, end], labels, marks: [], at: (value) => value / end };
}

/** A logarithmic axis of whole decades, one at least, that holds all from `least` to `most`, both above 0. */
export function decadeAxis(least: number, most: number): Axis {
  const first = Math.floor(Math.log10(least) + 1e-9);
  const last = Math.max(first + 1, Math.ceil(Math.log10(most) - 1e-9));
  const decades = Array.from({ length: last - first }, (_, i) => first + i);
  const power = (exponent: number) => Number((10 ** exponent).toPrecision(6));
  return {
    ends: [power(first), power(last)],
    labels: [...decades, last].map(power),
    marks: decades.flatMap((decade) => [2, 3, 4, 5, 6, 7, 8, 9].map((digit) => digit * power(decade))),
    at: (value) => (Math.log10(value) - first) / (last - first),
  };
}
