import { decadeAxis, evenAxis, type AccuracyChoice, type Axis, type Price } from "@tryon/core";

import { significant } from "./format.ts";
import { put, svg } from "./svg.ts";

/** The drawing's own size; it is scaled with its element. */
const [WIDTH, HEIGHT] = [276, 196];
const ROOM = { left: 44, right: WIDTH - 8, top: 18, bottom: HEIGHT - 34 };
/** what axes hold while nothing else is known [ms, mm] */
const USUAL_MS = 20;
const USUAL_MM = 0.1;
/** how much of a dot is left when it is the oldest one */
const FAINTEST = 0.12;
/** beside a line that is further along its axis than this, a label goes to the side with more room */
const FAR = 0.6;

/** What frames' accuracy takes: the estimated error of each over the time of solving it, and what was asked for. */
export class PricePlot {
  constructor(private readonly element: SVGSVGElement) {
    put(element, { viewBox: `0 0 ${WIDTH} ${HEIGHT}` });
  }

  /** @param prices oldest first */
  draw(prices: readonly Price[], choice: AccuracyChoice): void {
    const asked = choice.accuracy === null ? null : 1000 * choice.accuracy;
    const times = evenAxis(Math.max(...prices.map(({ solverMs }) => solverMs), choice.deadlineMs ?? 0) || USUAL_MS);
    const errors = errorAxis([...prices.map(({ errorMm }) => errorMm), ...(asked === null ? [] : [asked])]);
    const lines = [...askedLine(errors, asked), ...deadlineLine(times, choice.deadlineMs)];
    this.element.replaceChildren(...grid(times, errors), ...lines, ...dots(prices, times, errors));
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

function askedLine(errors: Axis, askedMm: number | null): SVGElement[] {
  if (askedMm === null) return [];
  const y = up(errors, askedMm);
  const below = errors.at(askedMm) > 0.9;
  return [
    line("asked", [ROOM.left, y], [ROOM.right, y]),
    text("asked-label", ROOM.right - 3, below ? y + 10 : y - 4, `${significant(askedMm, 2)} mm`),
  ];
}

function deadlineLine(times: Axis, deadlineMs: number | null): SVGElement[] {
  if (deadlineMs === null) return [];
  const x = across(times, deadlineMs);
  const label = text("deadline-label", x, ROOM.top - 6, `deadline ${significant(deadlineMs, 4)} ms`);
  put(label, { "text-anchor": times.at(deadlineMs) > FAR ? "end" : "start" });
  return [line("deadline", [x, ROOM.top - 3], [x, ROOM.bottom]), label];
}

function dots(prices: readonly Price[], times: Axis, errors: Axis): SVGElement[] {
  const last = prices.length - 1;
  return prices.map(({ errorMm, solverMs, lateMs }, i) => {
    const late = lateMs > 0 ? " late" : "";
    const place = { cx: across(times, solverMs), cy: up(errors, errorMm) };
    if (i === last) return svg("circle", { class: `dot newest${late}`, ...place, r: 4.5 });
    const opacity = FAINTEST + (1 - FAINTEST) * ((i + 1) / prices.length) ** 2;
    return svg("circle", { class: `dot${late}`, ...place, r: 2.6, opacity });
  });
}

function line(kind: string, [x1, y1]: readonly [number, number], [x2, y2]: readonly [number, number]): SVGElement {
  return svg("line", { class: kind, x1, y1, x2, y2 });
}

function text(kind: string, x: number, y: number, content: string): SVGElement {
  return svg("text", { class: kind, x, y }, content);
}
