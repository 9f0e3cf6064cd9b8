import type { DesignPanel } from "@tryon/protocol";

import type { Point } from "./pattern_design.ts";

/** Where pieces are drawn: place (x, y) of piece i is at origins[i] + scale (x, -y), y down. */
export interface Layout {
  /** pixels per metre, the same for all pieces */
  readonly scale: number;
  /** where each piece's own origin is drawn [px] */
  readonly origins: readonly Point[];
}

interface Box {
  readonly left: number;
  readonly bottom: number;
  readonly width: number;
  readonly height: number;
}

/**
 * Lays pieces out in rows, in their order, apart from each other, as large as they fit into width x height pixels. Where
 * there is no room, the scale is 0.
 * @param gap between pieces and to the border [px]
 */
export function layOut(panels: readonly DesignPanel[], width: number, height: number, gap: number): Layout {
  const boxes = panels.map(boxOf);
  let best = { scale: 0, breaks: rowsWithin(boxes, Infinity) };
  for (let first = 0; first < boxes.length; first += 1) {
    for (let last = first; last < boxes.length; last += 1) {
      const widest = boxes.slice(first, last + 1).reduce((sum, box) => sum + box.width, 0);
      const breaks = rowsWithin(boxes, widest);
      const scale = scaleOf(boxes, breaks, width, height, gap);
      if (scale > best.scale) best = { scale, breaks };
    }
  }
  return { scale: best.scale, origins: place(boxes, best, width, height, gap) };
}

/** Numbers of the pieces that begin a row, when rows are filled up to this width [m]. */
function rowsWithin(boxes: readonly Box[], widest: number): readonly number[] {
  const breaks: number[] = [];
  let filled = 0;
  boxes.forEach((box, i) => {
    if (i === 0 || filled + box.width > widest * (1 + 1e-9)) {
      breaks.push(i);
      filled = 0;
    }
    filled += box.width;
  });
  return breaks;
}

function rowsOf(boxes: readonly Box[], breaks: readonly number[]): readonly (readonly Box[])[] {
  return breaks.map((start, i) => boxes.slice(start, breaks.at(i + 1)));
}

/** The largest scale in which these rows fit. */
function scaleOf(boxes: readonly Box[], breaks: readonly number[], width: number, height: number, gap: number): number {
  const rows = rowsOf(boxes, breaks);
  const across = rows.map((row) => (width - gap * (row.length + 1)) / row.reduce((sum, box) => sum + box.width, 0));
  const down = (height - gap * (rows.length + 1)) / rows.reduce((sum, row) => sum + tallest(row), 0);
  return Math.max(0, Math.min(down, ...across));
}

/** Rows from the top, each in the middle of the width with its pieces on one line; what is left is shared above and below. */
function place(
  boxes: readonly Box[],
  { scale, breaks }: { scale: number; breaks: readonly number[] },
  width: number,
  height: number,
  gap: number,
): Point[] {
  const rows = rowsOf(boxes, breaks);
  const used = rows.reduce((sum, row) => sum + scale * tallest(row) + gap, gap);
  let top = (height - used) / 2 + gap;
  return rows.flatMap((row) => {
    const length = row.reduce((sum, box) => sum + scale * box.width + gap, -gap);
    let left = (width - length) / 2;
    const floor = top + scale * tallest(row);
    top = floor + gap;
    return row.map((box): Point => {
      const origin = [left - scale * box.left, floor + scale * box.bottom] as const;
      left += scale * box.width + gap;
      return origin;
    });
  });
}

function tallest(row: readonly Box[]): number {
  return Math.max(...row.map(({ height }) => height));
}

/** What a piece takes up: its outline, and the handles of its curves. Never empty, so that a scale can be found. */
function boxOf(panel: DesignPanel): Box {
  const points = panel.edges.flatMap(({ points: along, handles }) => [...along, ...handles]);
  const [xs, ys] = [points.map(([x]) => x), points.map(([, y]) => y)];
  const [left, bottom] = [Math.min(...xs), Math.min(...ys)];
  return { left, bottom, width: Math.max(1e-3, Math.max(...xs) - left), height: Math.max(1e-3, Math.max(...ys) - bottom) };
}
