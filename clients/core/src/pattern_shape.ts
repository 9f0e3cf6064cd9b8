import type { DesignEdge, DesignPanel } from "@tryon/protocol";

import type { Point } from "./pattern_design.ts";

/** What of a piece can be dragged: a corner, an edge as a whole, or a handle of one. */
export type Grip =
  | { readonly kind: "edge"; readonly edge: number }
  | { readonly kind: "vertex"; readonly vertex: number }
  | { readonly kind: "handle"; readonly edge: number; readonly handle: number };

/** Pieces that a curve is drawn in. */
const STEPS = 24;
/** a rise over this chord is none */
const FLAT = 1e-6;

/** Where a grip is [m], of an edge its middle; nothing when the piece has none such. */
export function placeOf(panel: DesignPanel, grip: Grip): Point | undefined {
  if (grip.kind === "vertex") return panel.vertices.at(grip.vertex);
  if (grip.kind === "edge") {
    const edge = panel.edges.at(grip.edge);
    return edge && middleOf(edge);
  }
  return panel.edges.at(grip.edge)?.handles.at(grip.handle);
}

/**
 * The piece with a grip put elsewhere, as the server will have it: curves that meet at a corner stretch with it and keep
 * their shape in proportion, a straight edge whose handle is moved becomes a cubic one, an arc's middle moves across its
 * chord. What else follows, such as what is sewn to it, the server knows; of an edge, which goes along those beside it,
 * all of it.
 */
export function withGripAt(panel: DesignPanel, grip: Grip, place: Point): DesignPanel {
  if (grip.kind === "edge") return panel;
  if (grip.kind === "handle") {
    const edges = panel.edges.map((edge, i) => (i === grip.edge ? bent(edge, panel.vertices, grip.handle, place) : edge));
    return { ...panel, edges };
  }
  const vertices = panel.vertices.map((vertex, i) => (i === grip.vertex ? place : vertex));
  const edges = panel.edges.map((edge) => (edge.ends.includes(grip.vertex) ? stretched(edge, panel.vertices, vertices) : edge));
  return { ...panel, vertices, edges };
}

/** Length along an edge as it is drawn [m]. */
export function lengthOf({ points }: DesignEdge): number {
  let length = 0;
  for (let i = 1; i < points.length; i += 1) length += Math.hypot(points[i][0] - points[i - 1][0], points[i][1] - points[i - 1][1]);
  return length;
}

/** The place half way along an edge as it is drawn [m]. */
export function middleOf(edge: DesignEdge): Point {
  let left = lengthOf(edge) / 2;
  const { points } = edge;
  for (let i = 1; i < points.length; i += 1) {
    const step = Math.hypot(points[i][0] - points[i - 1][0], points[i][1] - points[i - 1][1]);
    if (step >= left && step > 0) return mix(points[i - 1], points[i], left / step);
    left -= step;
  }
  return points[points.length - 1];
}

/** How far a move of an edge goes out of its piece, across its chord [m]. */
export function outwards(panel: DesignPanel, edge: number, by: Point): number {
  const { ends } = panel.edges[edge];
  const [x, y] = minus(panel.vertices[ends[1]], panel.vertices[ends[0]]);
  const length = Math.hypot(x, y);
  return length > 0 ? (turnOf(panel) * (by[0] * y - by[1] * x)) / length : 0;
}

/** 1 of a piece whose outline goes counter-clockwise, else -1. */
function turnOf({ edges }: DesignPanel): 1 | -1 {
  const outline = edges.flatMap(({ points }) => points);
  const area = outline.reduce((sum, [x, y], i) => {
    const [u, v] = outline[(i + 1) % outline.length];
    return sum + x * v - y * u;
  }, 0);
  return area > 0 ? 1 : -1;
}

function bent(edge: DesignEdge, vertices: readonly Point[], handle: number, place: Point): DesignEdge {
  const [a, b] = [vertices[edge.ends[0]], vertices[edge.ends[1]]];
  const put = edge.shape === "arc" ? acrossChord(a, b, place) : place;
  const handles = edge.handles.map((old, i) => (i === handle ? put : old));
  const shape = edge.shape === "line" ? "cubic" : edge.shape;
  return { ...edge, shape, handles, points: drawn(shape, a, b, handles) };
}

/** The edge carried from its old chord to its new one: turned and scaled with it. */
function stretched(edge: DesignEdge, before: readonly Point[], after: readonly Point[]): DesignEdge {
  const [a, b] = [before[edge.ends[0]], before[edge.ends[1]]];
  const [newA, newB] = [after[edge.ends[0]], after[edge.ends[1]]];
  const chord = minus(b, a);
  const square = chord[0] ** 2 + chord[1] ** 2;
  if (square === 0) return edge;
  const handles = edge.handles.map((handle) => {
    const [x, y] = minus(handle, a);
    const along = (x * chord[0] + y * chord[1]) / square;
    const across = (y * chord[0] - x * chord[1]) / square;
    const [u, v] = minus(newB, newA);
    return [newA[0] + along * u - across * v, newA[1] + along * v + across * u] as const;
  });
  return { ...edge, handles, points: drawn(edge.shape, newA, newB, handles) };
}

/** Points along an edge with these ends and handles. */
function drawn(shape: DesignEdge["shape"], a: Point, b: Point, handles: readonly Point[]): readonly Point[] {
  switch (shape) {
    case "line":
      return [a, b];
    case "arc":
      return arc(a, b, handles[0]);
    case "quadratic":
    case "cubic":
      return Array.from({ length: STEPS + 1 }, (_, i) => bezier([a, ...handles, b], i / STEPS));
  }
}

/** The point at t of a Bezier curve, by de Casteljau. */
function bezier(controls: readonly Point[], t: number): Point {
  let row = controls;
  while (row.length > 1) row = row.slice(1).map((point, i) => mix(row[i], point, t));
  return row[0];
}

/** A circle's arc from a to b through the middle between them. */
function arc(a: Point, b: Point, middle: Point): readonly Point[] {
  const [x, y] = minus(b, a);
  const chord = Math.hypot(x, y);
  const foot = mix(a, b, 0.5);
  const rise = chord > 0 ? ((middle[1] - foot[1]) * x - (middle[0] - foot[0]) * y) / chord : 0;
  if (Math.abs(rise) <= FLAT * chord) return [a, b];
  const radius = chord ** 2 / (8 * rise) + rise / 2;
  const sweep = 4 * Math.atan((2 * rise) / chord);
  return Array.from({ length: STEPS + 1 }, (_, i) => {
    const angle = sweep * (i / STEPS - 0.5);
    const [out, along] = [rise - radius + radius * Math.cos(angle), radius * Math.sin(angle)];
    return [foot[0] + (along * x - out * y) / chord, foot[1] + (along * y + out * x) / chord] as const;
  });
}

/** The place on the chord's perpendicular bisector that is nearest to this one. */
function acrossChord(a: Point, b: Point, place: Point): Point {
  const [x, y] = minus(b, a);
  const square = x ** 2 + y ** 2;
  if (square === 0) return place;
  const foot = mix(a, b, 0.5);
  const rise = ((place[1] - foot[1]) * x - (place[0] - foot[0]) * y) / square;
  return [foot[0] - rise * y, foot[1] + rise * x];
}

function minus(one: Point, other: Point): Point {
  return [one[0] - other[0], one[1] - other[1]];
}

function mix(a: Point, b: Point, t: number): Point {
  return [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
}
