import assert from "node:assert/strict";
import { test } from "node:test";

import { layOut, lengthOf, middleOf, readDesign, sewnTo } from "@tryon/core";
import { decodeMessage, type DesignEdge, type DesignPanel } from "@tryon/protocol";

import { withGripAt } from "../../clients/core/src/pattern_shape.ts";
import { readBytes } from "../../protocol/ts/test/vectors.ts";
import { design, rectangle } from "./support/patterns.ts";

type Points = readonly (readonly [number, number])[];

/** A piece of one edge that goes from the origin to (1, 0), and back. */
function curved(shape: DesignEdge["shape"], handles: Points): DesignPanel {
  const vertices = [[0, 0], [1, 0]] as const;
  const back: DesignEdge = { ends: [1, 0], shape: "line", handles: [[0.7, 0], [0.3, 0]], points: [[1, 0], [0, 0]] };
  return { name: "p", label: "", vertices, edges: [{ ends: [0, 1], shape, handles, points: vertices }, back] };
}

function assertNear(found: Points, expected: Points): void {
  assert.equal(found.length, expected.length);
  found.flat().forEach((value, i) => assert.ok(Math.abs(value - expected.flat()[i]) < 1e-9, `${found.join(" ")} is not ${expected.join(" ")}`));
}

test("the golden pattern is sound, and its seam joins two edges", () => {
  const message = decodeMessage(readBytes("messages/server_design.bin"));
  assert.ok(message?.type === "design");
  const read = readDesign(message);
  assert.deepEqual(sewnTo(read, 0, 1), { seam: 3, panel: 1, edge: 2 });
  assert.deepEqual(sewnTo(read, 1, 2), { seam: 3, panel: 0, edge: 1 });
  assert.equal(sewnTo(read, 0, 0), undefined);
});

test("curves that meet at a moved corner turn and stretch with their chord", () => {
  const up = { kind: "vertex", vertex: 1 } as const;
  const cubic = withGripAt(curved("cubic", [[0.25, 0.5], [0.75, 0.5]]), up, [0, 2]);
  assertNear(cubic.edges[0].handles, [[-1, 0.5], [-1, 1.5]]);
  const { points } = cubic.edges[0];
  assertNear([points[0], points[12], points[24]], [[0, 0], [-0.75, 1], [0, 2]]);
  assertNear(cubic.edges[1].points, [[0, 2], [0, 0]]);
});

test("a moved handle bends its edge: a quadratic one, a straight one that becomes cubic, an arc across its chord", () => {
  const handle = { kind: "handle", edge: 0, handle: 0 } as const;
  const quadratic = withGripAt(curved("quadratic", [[0.5, 0.5]]), handle, [0.5, 1]).edges[0];
  assertNear([quadratic.points[12]], [[0.5, 0.5]]);
  const line = withGripAt(rectangle("r", 3, 1), { kind: "handle", edge: 0, handle: 1 }, [2, -1]).edges[0];
  assert.equal(line.shape, "cubic");
  assertNear(line.handles, [[1, 0], [2, -1]]);
  for (const side of [1, -1]) {
    const arc = withGripAt(curved("arc", [[0.5, 0.1]]), handle, [0.9, 0.5 * side]).edges[0];
    assertNear(arc.handles, [[0.5, 0.5 * side]]);
    assertNear([arc.points[0], arc.points[6], arc.points[12], arc.points[24]], [
      [0, 0],
      [0.5 - Math.SQRT1_2 / 2, (Math.SQRT1_2 / 2) * side],
      [0.5, 0.5 * side],
      [1, 0],
    ]);
    assert.ok(Math.abs(lengthOf(arc) - Math.PI / 2) < 2e-3);
  }
  const flat = withGripAt(curved("arc", [[0.5, 0.1]]), handle, [0.5, 0]).edges[0];
  assertNear(flat.points, [[0, 0], [1, 0]]);
});

test("the middle of an edge is half way along it", () => {
  const corner: DesignEdge = { ends: [0, 1], shape: "arc", handles: [[3, 0]], points: [[0, 0], [3, 0], [3, 1]] };
  assert.deepEqual(middleOf(corner), [2, 0]);
  const none: DesignEdge = { ...corner, points: [[1, 1], [1, 1]] };
  assert.deepEqual(middleOf(none), [1, 1]);
});

test("pieces are laid out to one scale, inside the sheet, and apart from each other", () => {
  const shirt = [
    rectangle("front", 0.5, 0.75),
    rectangle("back", 0.5, 0.75),
    rectangle("left sleeve", 0.4, 0.25),
    rectangle("right sleeve", 0.4, 0.25),
    rectangle("collar", 0.5, 0.06),
  ];
  const gap = 20;
  for (const [width, height] of [[400, 700], [700, 400], [1200, 200], [300, 300]]) {
    const { scale, origins } = layOut(shirt, width, height, gap);
    assert.ok(scale > 0);
    const boxes = origins.map(([x, y], i) => {
      const [w, h] = shirt[i].vertices[2];
      return { left: x, right: x + scale * w, top: y - scale * h, bottom: y };
    });
    for (const [i, one] of boxes.entries()) {
      assert.ok(one.left >= gap - 1e-6 && one.right <= width - gap + 1e-6, `piece ${i} in ${width} x ${height}`);
      assert.ok(one.top >= gap - 1e-6 && one.bottom <= height - gap + 1e-6, `piece ${i} in ${width} x ${height}`);
      for (const other of boxes.slice(i + 1)) {
        const apart = [one.left - other.right, other.left - one.right, one.top - other.bottom, other.top - one.bottom];
        assert.ok(Math.max(...apart) >= gap - 1e-6, `in ${width} x ${height}`);
      }
    }
  }
});

test("a wide sheet has the pieces side by side, a tall one below each other", () => {
  const { panels } = design();
  const wide = layOut(panels, 1000, 400, 10).origins;
  assert.equal(wide[0][1], wide[1][1]);
  const tall = layOut(panels, 400, 1200, 10).origins;
  assert.equal(tall[0][0], tall[1][0]);
});

test("pieces that do not begin at their origin, that are nothing, or a sheet without room are no fault", () => {
  const far = rectangle("far", 0.5, 0.5);
  const away = { ...far, edges: far.edges.map((edge) => ({ ...edge, points: edge.points.map(([x, y]) => [x - 3, y + 2] as const), handles: [] })) };
  const { scale, origins } = layOut([away], 120, 120, 10);
  assertNear([origins[0]], [[10 + 3 * scale, 110 + 2 * scale]]);
  const cramped = layOut([away, far], 10, 0, 10);
  assert.deepEqual([cramped.scale, cramped.origins.length], [0, 2]);
  assert.deepEqual(layOut([], 100, 100, 10).origins, []);
  assert.ok(Number.isFinite(layOut([rectangle("nothing", 0, 0)], 100, 100, 10).scale));
});
