import type { Client } from "@tryon/core";
import { PaceMeter, steadyNow } from "@tryon/core";
import type { ReportMessage } from "@tryon/protocol";

import { byId, make, setText } from "./dom.ts";
import { format, simulatedTime, withUnit } from "./format.ts";

/** Every figure of the readout; NaN: not known (yet). Names end in their unit. */
export interface Figures {
  frames: number;
  fps: number;
  drawnFps: number;
  ageMs: number;
  solverMs: number;
  vertices: number;
  clearanceMm: number;
  minGapMm: number;
  maxStretchPercent: number;
  pace: number;
  bodyLagMm: number;
  pairs: number;
  iterations: number;
  errorMm: number;
  simulatedS: number;
  decodeMs: number;
  frameBytes: number;
  seq: number;
  rootX: number;
  rootY: number;
  rootZ: number;
}

interface Row {
  readonly figure: keyof Figures;
  readonly name: string;
  readonly title: string;
  readonly digits: number;
  readonly unit: string;
}

const ROWS: readonly Row[] = [
  { figure: "ageMs", name: "Frame age", title: "Time since the server published the frame on screen", digits: 0, unit: "ms" },
  { figure: "fps", name: "Frames", title: "Frames received per second", digits: 1, unit: "/s" },
  { figure: "solverMs", name: "Solver", title: "Time to solve one frame", digits: 0, unit: "ms" },
  { figure: "pace", name: "Simulated : wall time", title: "1 is real time", digits: 2, unit: "" },
  { figure: "simulatedS", name: "Simulated time", title: "On the motion's clock; the body first moves into the motion's first pose", digits: 1, unit: "s" },
  { figure: "vertices", name: "Garment vertices", title: "Vertices that are simulated", digits: 0, unit: "" },
  {
    figure: "clearanceMm",
    name: "Clearance",
    title: "Distance of cloth to cloth or to skin where it is nearest to its offset, the thickness kept between them; 0 would be touching",
    digits: 2,
    unit: "mm",
  },
  {
    figure: "minGapMm",
    name: "Clearance less offset",
    title: "Below 0, cloth is pressed closer than the offset; half the offset is the least that a frame may have",
    digits: 2,
    unit: "mm",
  },
  { figure: "maxStretchPercent", name: "Largest stretch", title: "Beyond the length of the pattern", digits: 1, unit: "%" },
  { figure: "bodyLagMm", name: "Body lag", title: "How far the simulated surface of the body stays behind its skin", digits: 2, unit: "mm" },
  {
    figure: "errorMm",
    name: "Solver error",
    title: "Estimated: how far the cloth's vertices are, as a root mean square, from where a solver without end would take them in this step",
    digits: 3,
    unit: "mm",
  },
  { figure: "pairs", name: "Contact pairs", title: "Near pairs that push on each other", digits: 0, unit: "" },
  { figure: "iterations", name: "Iterations", title: "Outer iterations of the last step", digits: 0, unit: "" },
  { figure: "decodeMs", name: "Decode", title: "Time to decode one frame and to shade it, in the page's worker", digits: 1, unit: "ms" },
  { figure: "frameBytes", name: "Frame size", title: "Bytes of the newest frame", digits: 0, unit: "B" },
];

/** The figures beside the picture. They are refreshed a few times a second and stand in the page as data attributes too. */
export class Readout {
  readonly figures: Figures = {
    frames: 0, fps: 0, drawnFps: 0, ageMs: NaN, solverMs: NaN, vertices: 0, clearanceMm: NaN, minGapMm: NaN, maxStretchPercent: NaN,
    pace: NaN, bodyLagMm: NaN, pairs: NaN, iterations: NaN, errorMm: NaN, simulatedS: NaN, decodeMs: NaN, frameBytes: NaN, seq: 0,
    rootX: NaN, rootY: NaN, rootZ: NaN,
  };
  private readonly board = byId("readout", HTMLDetailsElement);
  private readonly cells = new Map<keyof Figures, HTMLElement>();
  private readonly short = { fps: find("fps"), ageMs: find("age") };
  private readonly pace = new PaceMeter();
  private paceSeq = 0;

  constructor() {
    const list = byId("figures");
    for (const row of ROWS) {
      const cell = make("dd", {}, "–");
      this.cells.set(row.figure, cell);
      list.append(make("dt", { title: row.title }, row.name), cell);
    }
    byId("stages", HTMLDetailsElement).addEventListener("toggle", () => this.showStages());
  }

  private report: ReportMessage | undefined;

  setReport(report: ReportMessage): void {
    this.report = report;
    const { figures } = this;
    figures.solverMs = report.solver_ms;
    figures.minGapMm = report.min_gap === null ? NaN : report.min_gap * 1000;
    figures.clearanceMm = typeof report.gap_offset !== "number" ? NaN : figures.minGapMm + report.gap_offset * 1000;
    figures.maxStretchPercent = (report.max_stretch - 1) * 100;
    figures.bodyLagMm = report.body_lag * 1000;
    figures.pairs = report.pairs;
    figures.iterations = report.iterations;
    figures.errorMm = typeof report.error !== "number" ? NaN : report.error * 1000;
    this.showStages();
  }

  /** Forgets the session that is left. */
  reset(): void {
    this.report = undefined;
    this.pace.reset();
    this.paceSeq = 0;
    for (const key of Object.keys(this.figures) as (keyof Figures)[]) this.figures[key] = NaN;
    this.figures.frames = this.figures.fps = this.figures.vertices = this.figures.seq = 0;
    this.showStages();
  }

  /** Notes the frame that has just been drawn. */
  drawn(client: Client, drawnFps: number): void {
    const frame = client.scene.figures;
    if (!frame) return;
    const { figures } = this;
    figures.drawnFps = drawnFps;
    figures.seq = frame.seq;
    figures.simulatedS = frame.simulatedMs / 1000;
    figures.decodeMs = frame.decodeMs;
    figures.frameBytes = frame.bytes;
    figures.rootX = frame.root[0];
    figures.rootY = frame.root[1];
    figures.rootZ = frame.root[2];
    figures.vertices = client.scene.vertexCount;
    if (frame.seq !== this.paceSeq) {
      this.paceSeq = frame.seq;
      this.pace.tick(frame.simulatedMs, frame.publishedMs);
    }
  }

  /** Brings page and data attributes up to date. */
  refresh(client: Client | undefined): void {
    const { figures } = this;
    const now = steadyNow();
    const shown = client?.scene.figures;
    figures.frames = client?.framesArrived ?? 0;
    figures.fps = client?.arrivals.rate(now) ?? 0;
    figures.ageMs = shown ? now - shown.publishedMs : NaN;
    figures.pace = figures.fps > 0 ? this.pace.pace : NaN;
    for (const key of Object.keys(figures) as (keyof Figures)[]) {
      const value = figures[key];
      this.board.dataset[key] = Number.isFinite(value) ? String(Math.round(value * 1e4) / 1e4) : "";
    }
    setText(this.short.fps, format(figures.fps, 0));
    setText(this.short.ageMs, format(figures.ageMs, 0));
    if (!this.board.open) return;
    for (const row of ROWS) {
      const value = figures[row.figure];
      setText(this.cells.get(row.figure)!, row.figure === "simulatedS" ? simulatedTime(value) : withUnit(value, row.digits, row.unit));
    }
  }

  private showStages(): void {
    if (!byId("stages", HTMLDetailsElement).open) return;
    const times = Object.entries(this.report?.times_ms ?? {}).sort((a, b) => b[1] - a[1]);
    byId("stage-times").replaceChildren(
      ...times.flatMap(([stage, ms]) => [make("dt", {}, stage.replaceAll("_", " ")), make("dd", {}, `${ms.toFixed(1)} ms`)]),
    );
  }
}

function find(show: string): HTMLElement {
  return byId("readout").querySelector<HTMLElement>(`[data-show="${show}"]`)!;
}
