/**
 * A dial of accuracies from 0.01 to 3 mm, ten to a decade, evenly spaced as their logarithms go: the preferred numbers
 * of the series R"10 (ISO 497), which are round.
 */
const SERIES = [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8];
/** its first accuracy [m] */
const FINEST = 1e-5;

/** The dial's last position; the first is 0. */
export const DIAL_END = 25;

/** The accuracy at a position, a whole number [m]. */
export function accuracyAt(position: number): number {
  const decade = Math.floor(position / SERIES.length);
  return Number((FINEST * SERIES[position % SERIES.length] * 10 ** decade).toPrecision(2));
}

/** The position of the accuracy nearest to this one [m]; of one beyond the dial's ends that end. */
export function positionOf(accuracy: number): number {
  const position = Math.round(SERIES.length * Math.log10(accuracy / FINEST));
  return Math.min(DIAL_END, Math.max(0, position));
}
