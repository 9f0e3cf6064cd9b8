import { decadeAxis, evenAxis, type AccuracyChoice, type Axis, type Price } from "@tryon/core";

import { significant } from "./format.ts";
import { put, svg } from "./svg.ts";

/** The drawing's own size; it is scaled with its element. */
const [WIDTH, HEIGHT] = [276, 196];
const ROOM = { left: 44, right: WIDTH - 14, top: 18, bottom: HEIGHT - 34 };
/** what axes hold while nothing else is known [ms, mm] */
const USUAL_MS = 20;
const USUAL_MM = 0.1;
/** how much of a dot is left when it is the oldest one */
const FAINTEST = 0.12;
/** beside a line that is further along its axis than this, a label goes to the side with more room */
const FAR = 0.6;
/** above this there is no room for a label over its line */
const HIGH = 0.9;
/** share of the prices that the axis of time may leave out, so that one slow frame does not press all others together */
const BEYOND = 0.05;

/** What was asked for: a line, and what is written at it, over all that is drawn. */
interface Limit {
  readonly line: SVGElement;
  readonly label: SVGElement;
}

/** What frames' accuracy takes: the estimated error of each over the time of solving it, and what was asked for. */
export class PricePlot {
  constructor(private readonly element: SVGSVGElement) {
    put(element, { viewBox: `0 0 ${WIDTH} ${HEIGHT}` });
  }

  /** @param prices oldest first */
  draw(prices: readonly Price[], choice: AccuracyChoice): void {
    const asked = choice.accuracy === null ? null : 1000 * choice.accuracy;
    const times = evenAxis(Math.max(usualMs(prices), choice.deadlineMs ?? 0) || USUAL_MS);
    const errors = errorAxis([...prices.map(({ errorMm }) => errorMm), ...(asked === null ? [] : [asked])]);
    const limits = [askedLimit(errors, asked), deadlineLimit(times, choice.deadlineMs)].filter((limit) => limit !== undefined);
    const [lines, labels] = [limits.map(({ line }) => line), limits.map(({ label }) => label)];
    this.element.replaceChildren(...grid(times, errors), ...lines, ...dots(prices, times, errors), ...labels);
    this.element.setAttribute("aria-label", inWords(prices.at(-1), choice.deadlineMs));
  }
}

/** The newest frame's error and time, and whether it kept the deadline, if that stood by then. */
export function inWords(newest: Price | undefined, deadlineMs: number | null): string {
  const price = newest ? `${significant(newest.errorMm, 2)} mm in ${newest.solverMs.toFixed(1)} ms` : "No frame was reported yet";
  if (deadlineMs === null) return price;
  const verdict = newest?.deadlineMs === deadlineMs ? `, ${newest.lateMs > 0 ? `missed by ${newest.lateMs.toFixed(1)} ms` : "met"}` : "";
  return `${price}; deadline ${significant(deadlineMs, 4)} ms${verdict}`;
}

/** The time that all but the dearest few frames took at most [ms]; 0 without any. */
export function usualMs(prices: readonly Price[]): number {
  const times = prices.map(({ solverMs }) => solverMs).sort((a, b) => a - b);
  return times.at(times.length - 1 - Math.floor(BEYOND * times.length)) ?? 0;
}

function errorAxis(errors: readonly number[]): Axis {
  return errors.length ? decadeAxis(Math.min(...errors), Math.max(...errors)) : decadeAxis(USUAL_MM, USUAL_MM);
}

function across(axis: Axis, value: number): number {
  return ROOM.left + axis.at(value) * (ROOM.right - ROOM.left);
}

function up(axis: Axis, value: number): number {
  return ROOM.bottom - axis.at(value) * (ROOM.bottom - ROOM.top);
}

function grid(times: Axis, errors: Axis): SVGElement[] {
  const level = (kind: string, value: number) => line(kind, [ROOM.left, up(errors, value)], [ROOM.right, up(errors, value)]);
  const middle = (ROOM.top + ROOM.bottom) / 2;
  return [
    ...errors.marks.map((value) => level("mark", value)),
    ...errors.labels.map((value) => level("grid", value)),
    ...errors.labels.map((value) => text("of-errors", ROOM.left - 5, up(errors, value), String(value))),
    ...times.labels.map((value) => line("grid", [across(times, value), ROOM.top], [across(times, value), ROOM.bottom])),
    ...times.labels.map((value) => text("of-times", across(times, value), ROOM.bottom + 12, String(value))),
    text("title", (ROOM.left + ROOM.right) / 2, HEIGHT - 6, "time of solving a frame, ms"),
    svg("text", { class: "title", transform: `translate(9 ${middle}) rotate(-90)` }, "estimated error, mm"),
  ];
}

function askedLimit(errors: Axis, askedMm: number | null): Limit | undefined {
  if (askedMm === null) return undefined;
  const y = up(errors, askedMm);
  const below = errors.at(askedMm) > HIGH;
  return {
    line: line("asked", [ROOM.left, y], [ROOM.right, y]),
    label: text("asked-label", ROOM.right - 3, below ? y + 11 : y - 4, `about ${significant(askedMm, 2)} mm`),
  };
}

function deadlineLimit(times: Axis, deadlineMs: number | null): Limit | undefined {
  if (deadlineMs === null) return undefined;
  const x = across(times, deadlineMs);
  const label = text("deadline-label", x, ROOM.top - 6, `deadline ${significant(deadlineMs, 4)} ms`);
  put(label, { "text-anchor": times.at(deadlineMs) > FAR ? "end" : "start" });
  return { line: line("deadline", [x, ROOM.top - 3], [x, ROOM.bottom]), label };
}

/** One for each price, fainter the older it is; at the border stands an arrow for one that took longer than it. */
function dots(prices: readonly Price[], times: Axis, errors: Axis): SVGElement[] {
  return prices.map(({ errorMm, solverMs, lateMs }, i) => {
    const newest = i === prices.length - 1;
    const kind = `dot${lateMs > 0 ? " late" : ""}${newest ? " newest" : ""}`;
    const [y, r] = [up(errors, errorMm), newest ? 4.5 : 2.6];
    const opacity = newest ? 1 : FAINTEST + (1 - FAINTEST) * ((i + 1) / prices.length) ** 2;
    if (solverMs <= times.ends[1]) return svg("circle", { class: kind, cx: across(times, solverMs), cy: y, r, opacity });
    const [tip, back] = [ROOM.right + 2 * r, ROOM.right + 1];
    return svg("path", { class: `${kind} beyond`, d: `M${tip} ${y}L${back} ${y - r}V${y + r}Z`, opacity });
  });
}

function line(kind: string, [x1, y1]: readonly [number, number], [x2, y2]: readonly [number, number]): SVGElement {
  return svg("line", { class: kind, x1, y1, x2, y2 });
}

function text(kind: string, x: number, y: number, content: string): SVGElement {
  return svg("text", { class: kind, x, y }, content);
}
