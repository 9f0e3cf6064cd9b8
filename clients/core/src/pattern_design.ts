import type { DesignEdge, DesignMessage, DesignPanel } from "@tryon/protocol";

/** A place in a piece's own plane [m], y up. */
export type Point = readonly [number, number];

/** A pattern as it is worn, found sound: every number is finite, every index names something that is there. */
export type Design = Required<DesignMessage>;

/** Handles of an edge by what it is drawn as. */
const HANDLES: Readonly<Record<DesignEdge["shape"], number>> = { line: 2, cubic: 2, quadratic: 1, arc: 1 };
/** further out lies no garment [m] */
const FARTHEST = 1e3;

/**
 * Takes a server's `design` for drawing.
 * @throws Error naming what of it can't be drawn
 */
export function readDesign(message: DesignMessage): Design {
  const panels = listOf(message.panels, "panels");
  must(panels.length > 0, "panels", "is empty");
  panels.forEach((panel, i) => checkPanel(panel, `panels[${i}]`));
  const names = new Set(panels.map(({ name }) => name));
  must(names.size === panels.length, "panels", "has two of one name");
  listOf(message.seams, "seams").forEach((seam, i) => {
    for (const side of [seam.first, seam.second]) {
      const place = `seams[${i}]`;
      const edges = inRange(listOf(side, place).at(0), panels.length) ? panels[side[0]].edges.length : 0;
      must(inRange(side.at(1), edges), place, "names an edge that is not there");
    }
    must(inRange(seam.number ?? 0, Infinity), `seams[${i}].number`, "is no number");
  });
  listOf(message.done, "done").forEach(({ kind, panel }, i) => {
    must(typeof kind === "string" && typeof panel === "string", `done[${i}]`, "is no edit");
  });
  must(inRange(message.undone, Infinity), "undone", "is no number of edits");
  const patches = listOf(message.patches ?? [], "patches");
  patches.forEach(({ panel, host, points }, i) => {
    const known = inRange(panel, panels.length) && inRange(host, panels.length);
    must(known, `patches[${i}]`, "names a panel that is not there");
    checkPoints(points, `patches[${i}].points`);
  });
  const notes = listOf(message.notes ?? [], "notes");
  must(notes.every((note) => typeof note === "string"), "notes", "is no text");
  return { ...message, notes, patches, garment: message.garment ?? "" };
}

function checkPanel(panel: DesignPanel, place: string): void {
  must(typeof panel.name === "string" && typeof panel.label === "string", place, "has no name");
  checkPoints(panel.vertices, `${place}.vertices`);
  must(listOf(panel.edges, `${place}.edges`).length > 0, place, "has no edges");
  panel.edges.forEach((edge, i) => {
    const here = `${place}.edges[${i}]`;
    const [from, to] = listOf(edge.ends, here);
    const count = panel.vertices.length;
    must(inRange(from, count) && inRange(to, count), here, "ends at a vertex that is not there");
    checkPoints(edge.handles, `${here}.handles`);
    must(HANDLES[edge.shape] === edge.handles.length, here, "has a shape that is not known");
    checkPoints(edge.points, `${here}.points`);
    must(edge.points.length >= 2, `${here}.points`, "is no line");
  });
}

function checkPoints(points: readonly Point[], place: string): void {
  const sound = (value: unknown) => typeof value === "number" && Math.abs(value) <= FARTHEST;
  must(listOf(points, place).every((point) => listOf(point, place).length === 2 && point.every(sound)), place, "is no list of points");
}

function listOf<Item>(value: readonly Item[], place: string): readonly Item[] {
  must(Array.isArray(value), place, "is no list");
  return value;
}

function inRange(value: unknown, count: number): boolean {
  return Number.isInteger(value) && (value as number) >= 0 && (value as number) < count;
}

function must(holds: boolean, place: string, otherwise: string): void {
  if (!holds) throw new Error(`design.${place} ${otherwise}`);
}

/** What an edge is sewn to, and the number by which people know their seam, from 1. */
export interface Sewn {
  readonly seam: number;
  readonly panel: number;
  readonly edge: number;
}

/** Where this edge is sewn to; nothing of an open one. */
export function sewnTo(design: Design, panel: number, edge: number): Sewn | undefined {
  for (const [place, { first, second, number }] of design.seams.entries()) {
    const seam = number === undefined || number === 0 ? place + 1 : number;
    if (first[0] === panel && first[1] === edge) return { seam, panel: second[0], edge: second[1] };
    if (second[0] === panel && second[1] === edge) return { seam, panel: first[0], edge: first[1] };
  }
  return undefined;
}

/** Whether two patterns have the same pieces, corners, edges and seams, so that one can be drawn over the other. */
export function sameParts(one: Design, other: Design): boolean {
  const parts = ({ panels, seams }: Design) =>
    JSON.stringify([panels.map(({ name, vertices, edges }) => [name, vertices.length, edges.map(({ ends }) => ends)]), seams]);
  return parts(one) === parts(other);
}
