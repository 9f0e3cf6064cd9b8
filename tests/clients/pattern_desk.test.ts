import assert from "node:assert/strict";
import { test } from "node:test";

import { PatternDesk } from "@tryon/core";
import type { ClientMessage, DesignMessage } from "@tryon/protocol";

import { design, rectangle } from "./support/patterns.ts";

const CORNER = { kind: "vertex", vertex: 2 } as const;

/** A desk whose pictures are drawn when the test says so. */
function desk(message: DesignMessage = design()) {
  const sent: ClientMessage[] = [];
  const waiting = new Set<() => void>();
  const counted = { changes: 0 };
  const at = new PatternDesk({
    send: (said) => sent.push(said),
    beforePicture: (callback) => {
      waiting.add(callback);
      return () => waiting.delete(callback);
    },
    changed: () => (counted.changes += 1),
  });
  at.take(message);
  const picture = () => {
    const due = [...waiting];
    waiting.clear();
    for (const callback of due) callback();
  };
  const corner = () => at.design?.panels[0].vertices[2];
  return { at, sent, picture, waiting, corner, counted };
}

/** The pattern with its front's corner moved. */
function moved(by: readonly [number, number], changes: Partial<DesignMessage> = {}): DesignMessage {
  const { panels } = design();
  const vertices = panels[0].vertices.map(([x, y], i) => (i === 2 ? ([x + by[0], y + by[1]] as const) : ([x, y] as const)));
  return design({ panels: [{ ...panels[0], vertices }, panels[1]], ...changes });
}

function refusal(request: number | null) {
  return { type: "error", code: "edit_refused", place: "by", message: "no", remedy: "less", request } as const;
}

test("a drag is told at most once per picture, from where it began, and for good on letting go", () => {
  const { at, sent, picture, corner } = desk();
  assert.ok(at.begin("front", CORNER));
  for (const by of [[0.01, 0], [0.02, 0], [0.03, -0.01]] as const) at.moveBy(by);
  assert.deepEqual(corner(), [0.53, 0.74], "the outline follows at once");
  assert.deepEqual(sent, []);
  picture();
  picture();
  const edit = { kind: "move_vertex", panel: "front", vertex: 2, by: [0.03, -0.01] };
  assert.deepEqual(sent, [{ type: "edit", edit, mirror: false, hold: true, request: 1 }]);
  at.moveBy([0.04, 0]);
  at.mirror = true;
  at.release();
  picture();
  assert.deepEqual(sent.slice(1), [{ type: "edit", edit: { ...edit, by: [0.04, 0] }, mirror: true, hold: false, request: 2 }]);
  assert.ok(at.waiting);
  assert.deepEqual(corner(), [0.54, 0.75], "it stays until the server answers");
  at.take(moved([0.04, 0], { done: [{ id: 1, kind: "move_vertex", panel: "front" }] }));
  at.edited({ type: "edited", id: 1, change: "value", request: 2 });
  assert.ok(!at.waiting);
  assert.deepEqual(corner(), [0.54, 0.75]);
});

test("an edge is dragged out of its piece, by as much as goes across it", () => {
  const { at, sent, picture, corner } = desk();
  assert.ok(at.begin("front", { kind: "edge", edge: 0 }));
  at.moveBy([0.2, -0.04]);
  picture();
  const edit = { kind: "lengthen", panel: "front", edge: 0, by: 0.04 };
  assert.deepEqual(sent, [{ type: "edit", edit, mirror: false, hold: true, request: 1 }]);
  assert.deepEqual(corner(), [0.5, 0.75], "where it goes the server knows");
  at.moveBy([0, 0.03]);
  at.release();
  assert.deepEqual(sent.slice(1), [{ type: "edit", edit: { ...edit, by: -0.03 }, mirror: false, hold: false, request: 2 }]);
  assert.ok(!at.begin("front", { kind: "edge", edge: 9 }));
});

test("an edge that was moved along itself is where it was", () => {
  const { at, sent, picture } = desk();
  assert.ok(at.begin("front", { kind: "edge", edge: 0 }));
  at.moveBy([0.2, 0]);
  at.release();
  picture();
  assert.deepEqual(sent, []);
  assert.ok(!at.waiting);
});

test("a handle is moved as the handle of its edge", () => {
  const { at, sent } = desk();
  assert.ok(at.begin("back", { kind: "handle", edge: 0, handle: 1 }));
  at.moveBy([0, -0.05]);
  at.release();
  const [message] = sent;
  assert.ok(message.type === "edit");
  assert.deepEqual(message.edit, { kind: "move_handle", panel: "back", edge: 0, handle: 1, by: [0, -0.05] });
});

test("a drag that is dropped shows the pattern as it was, and says so if it was shown", () => {
  const { at, sent, picture, corner, waiting } = desk();
  at.begin("front", CORNER);
  at.moveBy([0.1, 0.1]);
  at.cancel();
  assert.equal(waiting.size, 0);
  assert.deepEqual([corner(), sent], [[0.5, 0.75], []], "nobody has been told of it");
  at.begin("front", CORNER);
  at.moveBy([0.1, 0.1]);
  picture();
  at.take(moved([0.1, 0.1], { held: true }));
  at.moveBy([0.2, 0.1]);
  at.cancel();
  picture();
  assert.deepEqual(sent.slice(1), [{ type: "edit", edit: null, hold: true, request: 2 }]);
  assert.deepEqual(corner(), [0.5, 0.75]);
});

test("a drag that ends where it began is none", () => {
  const { at, sent, picture } = desk();
  at.begin("front", CORNER);
  at.moveBy([0.1, 0]);
  picture();
  at.moveBy([0, 0]);
  at.release();
  assert.deepEqual(sent.slice(1), [{ type: "edit", edit: null, hold: true, request: 2 }]);
});

test("while the server shows what is dragged, the grip stays with the pointer and the rest follows", () => {
  const { at, corner } = desk();
  at.begin("front", CORNER);
  at.moveBy([0.03, 0]);
  const behind = moved([0.01, 0], { held: true });
  at.take({ ...behind, panels: [behind.panels[0], rectangle("back", 0.6, 0.75)] });
  const back = () => at.design?.panels[1].vertices[2];
  assert.deepEqual(corner(), [0.53, 0.75]);
  assert.deepEqual(back(), [0.6, 0.75]);
  at.cancel();
  assert.deepEqual(back(), [0.5, 0.75]);
});

test("an edit that is refused on letting go is taken back, one that another client was refused is not ours", () => {
  const { at, sent, picture, corner } = desk();
  at.begin("front", CORNER);
  at.moveBy([0.1, 0]);
  picture();
  at.release();
  assert.equal(at.refused(refusal(null)), false);
  assert.deepEqual(corner(), [0.6, 0.75]);
  assert.equal(at.refused(refusal(2)), true);
  assert.deepEqual(corner(), [0.5, 0.75]);
  assert.deepEqual(sent.slice(2), [{ type: "edit", edit: null, hold: true, request: 3 }]);
  assert.ok(!at.waiting);
});

test("a pattern that another client changes meanwhile is what a drag goes on from", () => {
  const { at, sent, corner } = desk();
  at.begin("front", CORNER);
  at.moveBy([0.01, 0]);
  at.take(moved([0.2, 0]));
  assert.deepEqual(corner(), [0.71, 0.75]);
  at.release();
  const [message] = sent;
  assert.ok(message.type === "edit");
  assert.deepEqual(message.edit?.by, [0.01, 0]);
});

test("a drag of a piece that is there no longer ends", () => {
  const { at, sent } = desk();
  at.begin("front", CORNER);
  at.moveBy([0.01, 0]);
  at.take(design({ panels: [rectangle("back", 0.5, 0.75)], seams: [] }));
  assert.equal(at.draggedBy, undefined);
  at.release();
  assert.deepEqual(sent, []);
  assert.equal(at.begin("front", CORNER), false);
  assert.equal(at.begin("back", { kind: "vertex", vertex: 9 }), false);
});

test("undo and redo are asked for when there is something to them", () => {
  const { at, sent } = desk();
  at.undo();
  at.redo();
  assert.deepEqual(sent, []);
  at.take(design({ done: [{ id: 4, kind: "cut", panel: "front" }], undone: 1 }));
  at.undo();
  at.redo();
  assert.deepEqual(sent, [
    { type: "undo", request: 1 },
    { type: "redo", request: 2 },
  ]);
});

test("with the connection the pattern goes, and with it what was dragged", () => {
  const { at, sent, picture } = desk();
  at.begin("front", CORNER);
  at.moveBy([0.1, 0]);
  at.forget();
  picture();
  at.release();
  assert.equal(at.design, undefined);
  assert.deepEqual(sent, []);
});

test("a pattern that can't be drawn is none, whatever is in it", () => {
  const [front, back] = design().panels;
  const with0 = (edge: object) => design({ panels: [{ ...front, edges: [{ ...front.edges[0], ...edge }] }, back], seams: [] });
  const bad: unknown[] = [
    { panels: null },
    { panels: [], seams: [] },
    { panels: [null] },
    { panels: [front, front] },
    { panels: [{ ...front, edges: [] }, back] },
    { panels: [{ ...front, vertices: [[0, NaN]] }, back] },
    with0({ ends: [0, 4] }),
    with0({ ends: [0] }),
    with0({ shape: "spiral" }),
    with0({ handles: [] }),
    with0({ points: [[0, 0]] }),
    with0({ points: [[0, 0], [1e300, 0]] }),
    { seams: [{ first: [0, 4], second: [1, 1] }] },
    { seams: [{ first: [0, 1], second: null }] },
    { done: [{}] },
    { undone: -1 },
    { notes: [7] },
  ];
  for (const changes of bad) {
    const { at } = desk();
    assert.throws(() => at.take({ ...design(), ...(changes as Partial<DesignMessage>) }), Error, JSON.stringify(changes));
    assert.equal(at.design, undefined);
  }
});
