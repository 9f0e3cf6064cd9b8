import { lengthOf, middleOf, sewnTo, type Design, type Grip, type Point } from "@tryon/core";

import { pathOf, put, svg } from "./svg.ts";

/** What is chosen: a piece, or one of its edges. */
export interface Chosen {
  readonly panel: string;
  readonly edge?: number;
}

/** Where a piece is drawn: its place (x, y) m is at origin + scale (x, -y) px. */
export interface Place {
  readonly scale: number;
  readonly origin: Point;
}

/** An element by which a grip is dragged, and where it is drawn [px]. */
export interface GripMark {
  readonly grip: Grip;
  readonly element: SVGCircleElement;
  at: Point;
}

interface EdgeMarks {
  readonly group: SVGGElement;
  /** wider than what is seen, to be met by a finger */
  readonly reach: SVGPathElement;
  readonly line: SVGPathElement;
  readonly arms: SVGPathElement;
  readonly handles: readonly GripMark[];
  readonly seam: SVGTextElement | undefined;
}

const CORNER_RADIUS = 4.5;
const HANDLE_RADIUS = 4;
/** of a seam's number from its edge [px] */
const NUMBER_INSIDE = 11;
/** a name that would have to be smaller is left out [px] */
const SMALLEST_NAME = 8.5;
const LARGEST_NAME = 13;
/** a piece narrower or lower than this shows handles and numbers only when it is chosen or pointed at [px] */
const SMALL = 90;
/** turns the hue from one seam to the next, so that neighbours differ [degrees] */
const HUE_STEP = 137.5;

/** One piece of a pattern as it is drawn: its cloth, its edges with their handles, its corners and its name. */
export class PieceDrawing {
  readonly element: SVGGElement;
  private readonly cloth = svg("path", { class: "cloth", tabindex: "0", role: "button" });
  private readonly edges: readonly EdgeMarks[];
  private readonly corners: readonly GripMark[];
  private readonly called: SVGTextElement;
  /** where other pieces lie on this one */
  private readonly patches: readonly SVGPathElement[];

  constructor(
    design: Design,
    readonly index: number,
  ) {
    const panel = design.panels[index];
    const name = nameOf(panel.name);
    this.cloth.setAttribute("aria-label", `Piece ${name}`);
    this.edges = panel.edges.map((_, i) => edgeMarks(design, index, i));
    this.corners = panel.vertices.map((_, vertex) => ({
      grip: { kind: "vertex", vertex },
      element: gripElement("corner", CORNER_RADIUS, `Corner ${vertex} of ${name}; arrow keys move it`),
      at: [0, 0],
    }));
    this.called = svg("text", { class: "called", "aria-hidden": "true" }, name);
    const corners = this.corners.map(({ element }) => element);
    this.patches = patchesOn(design, index).map(() => svg("path", { class: "patch" }));
    this.element = svg("g", { class: "piece", role: "group", "aria-label": name }, this.cloth, ...this.patches, this.called);
    this.element.append(...this.edges.map(({ group }) => group), ...corners);
  }

  /**
   * The grips that can be met just now: corners, and the handles that are seen.
   * @param hovered what is seen only below a pointer was seen before that was pressed: a finger is not there until then
   */
  grips(hovered: boolean): readonly GripMark[] {
    if (!hovered && this.element.matches(".small:not(.chosen)")) return this.corners;
    const seen = this.edges.filter(({ handles }) => handles.some(({ element }) => element.checkVisibility()));
    return [...this.corners, ...seen.flatMap(({ handles }) => handles)];
  }

  /** The edge, or none but the cloth, that an element of this piece stands for. */
  edgeOf(element: Element): number | undefined {
    const edge = this.edges.findIndex(({ group }) => group.contains(element));
    return edge < 0 ? undefined : edge;
  }

  /** What an element of this piece is called, where it is an edge or, unless edges are looked for, the piece. */
  labelOf(element: Element, edges: boolean): string | undefined {
    const edge = this.edgeOf(element);
    const meant = edge === undefined || !edges ? (edges ? undefined : this.cloth) : this.edges[edge].reach;
    return meant?.getAttribute("aria-label") ?? undefined;
  }

  /** Has the keys go to it. */
  focus(): void {
    this.cloth.focus({ preventScroll: true });
  }

  /** The grip that an element of this piece stands for. */
  gripOf(element: Element): Grip | undefined {
    return [...this.corners, ...this.edges.flatMap(({ handles }) => handles)].find((mark) => mark.element === element)?.grip;
  }

  /** The element that has the keys while a grip is dragged. */
  elementOf(grip: Grip): SVGElement | undefined {
    if (grip.kind === "vertex") return this.corners.at(grip.vertex)?.element;
    const edge = this.edges.at(grip.edge);
    return grip.kind === "edge" ? edge?.reach : edge?.handles.at(grip.handle)?.element;
  }

  /** Draws the piece as it is now. @param design with the parts that it had when this was made */
  update(design: Design, { scale, origin }: Place): void {
    const panel = design.panels[this.index];
    const onSheet = ([x, y]: Point): Point => [origin[0] + scale * x, origin[1] - scale * y];
    const outline = panel.edges.flatMap(({ points }) => points.map(onSheet));
    put(this.cloth, { d: `${pathOf(outline)}Z` });
    patchesOn(design, this.index).forEach(({ points }, i) => put(this.patches[i], { d: `${pathOf(points.map(onSheet))}Z` }));
    this.measure(outline);
    const inside = turnsLeft(outline) ? 1 : -1;
    panel.edges.forEach((edge, i) => {
      const marks = this.edges[i];
      const points = edge.points.map(onSheet);
      put(marks.reach, { d: pathOf(points) });
      put(marks.line, { d: pathOf(points) });
      marks.group.classList.toggle("straight", edge.shape === "line");
      const label = marks.group.dataset.label ?? "";
      put(marks.reach, { "aria-label": `${label}, ${(100 * lengthOf(edge)).toFixed(1)} cm` });
      const handles = edge.handles.map(onSheet);
      marks.handles.forEach((mark, k) => moveMark(mark, handles[k]));
      const [from, to] = [points[0], points[points.length - 1]];
      put(marks.arms, { d: edge.shape === "quadratic" || edge.shape === "cubic" ? armsOf(from, to, handles) : "" });
      if (marks.seam) {
        const [x, y] = onSheet(middleOf(edge));
        const [across, down] = [to[0] - from[0], to[1] - from[1]];
        const reach = (inside * NUMBER_INSIDE) / Math.max(1e-9, Math.hypot(across, down));
        put(marks.seam, { x: x + reach * down, y: y - reach * across });
      }
    });
    this.corners.forEach((mark, i) => moveMark(mark, onSheet(panel.vertices[i])));
  }

  /** Marks what is chosen of this piece; only what is chosen is walked through by the tab key. */
  mark(chosen: Chosen | undefined): void {
    this.element.classList.toggle("chosen", chosen !== undefined);
    this.cloth.setAttribute("aria-pressed", String(chosen !== undefined && chosen.edge === undefined));
    const stop = chosen ? "0" : "-1";
    this.edges.forEach(({ group, reach, handles }, i) => {
      const mine = chosen?.edge === i;
      group.classList.toggle("chosen", mine);
      put(reach, { tabindex: stop, "aria-pressed": String(mine) });
      for (const { element } of handles) element.setAttribute("tabindex", mine ? "0" : "-1");
    });
    for (const { element } of this.corners) element.setAttribute("tabindex", stop);
  }

  /** Writes the name in the middle, as large as it fits, and shows less where there is little room. */
  private measure(outline: readonly Point[]): void {
    const [xs, ys] = [outline.map(([x]) => x), outline.map(([, y]) => y)];
    const [left, right, top, bottom] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const letters = Math.max(1, this.called.textContent.length);
    const size = Math.min(LARGEST_NAME, (right - left - 40) / (0.56 * letters), (bottom - top) / 3);
    put(this.called, { x: (left + right) / 2, y: (top + bottom) / 2, "font-size": Math.max(0, size) });
    this.called.classList.toggle("unfit", size < SMALLEST_NAME);
    this.element.classList.toggle("small", Math.min(right - left, bottom - top) < SMALL);
  }
}

/** A name as people read it. */
export function nameOf(name: string): string {
  return name.replaceAll("_", " ");
}

function patchesOn(design: Design, index: number): Design["patches"] {
  return design.patches.filter(({ host }) => host === index);
}

function edgeMarks(design: Design, index: number, i: number): EdgeMarks {
  const panel = design.panels[index];
  const name = nameOf(panel.name);
  const sewn = sewnTo(design, index, i);
  const reach = svg("path", { class: "reach", role: "button" });
  const line = svg("path", { class: "line" });
  const arms = svg("path", { class: "arms" });
  const handles = panel.edges[i].handles.map(
    (_, handle): GripMark => ({
      grip: { kind: "handle", edge: i, handle },
      element: gripElement("handle", HANDLE_RADIUS, `Handle ${handle} of edge ${i} of ${name}; arrow keys move it`),
      at: [0, 0],
    }),
  );
  const seam = sewn && svg("text", { class: "number", "aria-hidden": "true" }, String(sewn.seam));
  const group = svg("g", { class: sewn ? "edge sewn" : "edge" }, reach, line, arms);
  group.append(...(seam ? [seam] : []), ...handles.map(({ element }) => element));
  if (sewn) group.style.setProperty("--hue", String(Math.round(((sewn.seam - 1) * HUE_STEP) % 360)));
  const other = sewn && `, seam ${sewn.seam} to ${nameOf(design.panels[sewn.panel].name)}`;
  group.dataset.label = `Edge ${i} of ${name}${other ?? ", open"}`;
  return { group, reach, line, arms, handles, seam };
}

function gripElement(kind: string, radius: number, label: string): SVGCircleElement {
  return svg("circle", { class: `grip ${kind}`, r: radius, role: "button", "aria-label": label });
}

function moveMark(mark: GripMark, at: Point): void {
  mark.at = at;
  put(mark.element, { cx: at[0], cy: at[1] });
}

/** Lines from a curve's handles to the ends that they pull at. */
function armsOf(from: Point, to: Point, handles: readonly Point[]): string {
  return `${pathOf([from, handles[0]])}${pathOf([handles[handles.length - 1], to])}`;
}

/** Whether an outline on the sheet, y down, goes counter-clockwise to the eye. */
function turnsLeft(outline: readonly Point[]): boolean {
  let area = 0;
  outline.forEach(([x, y], i) => {
    const [u, v] = outline[(i + 1) % outline.length];
    area += u * y - x * v;
  });
  return area > 0;
}
