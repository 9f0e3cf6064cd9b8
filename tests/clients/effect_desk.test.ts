import assert from "node:assert/strict";
import { test } from "node:test";

import type { EffectsMessage, EffectState, ErrorMessage } from "@tryon/protocol";
import { EffectDesk, type EffectRequest } from "../../clients/core/src/effect_desk.ts";
import { canBeAdded, isOf, newRow, polarOf, Scale, vectorOf, type RowsField } from "../../clients/core/src/effect_words.ts";

function desk(): { desk: EffectDesk; sent: EffectRequest[]; shows: () => number } {
  const sent: EffectRequest[] = [];
  let shows = 0;
  const made = new EffectDesk(
    (message) => sent.push(message),
    () => (shows += 1),
  );
  return { desk: made, sent, shows: () => shows };
}

function told(...effects: EffectState[]): EffectsMessage {
  return { type: "effects", effects, auto: false, plan: "" };
}

function wind(state: EffectState["state"], velocity: number[] = [1, 0, 0], more: Partial<EffectState> = {}): EffectState {
  return { name: "wind", state, parameters: { velocity }, ...more };
}

function refusal(request: number): ErrorMessage {
  return { type: "error", code: "effect_refused", place: "$.parameters", message: "", remedy: "", fatal: false, request };
}

test("what was asked stands until the session tells it, and not what was told before", () => {
  const { desk: made, sent } = desk();
  made.take(told(wind("active")));
  made.ask("wind", "active", { velocity: [0, 0, 2] });
  const request = sent[0].request!;
  assert.deepEqual(sent, [{ type: "set_effect", name: "wind", parameters: { velocity: [0, 0, 2] }, state: "active", request }]);
  made.take(told(wind("active"))); // it was on its way
  assert.deepEqual(made.effect("wind")?.parameters, { velocity: [0, 0, 2] });
  assert.equal(made.effect("wind")?.pending, "binding");
  made.take(told(wind("active", [0, 0, 2], { pending: "compiling" })));
  assert.equal(made.effect("wind")?.pending, "compiling");
  made.take(told(wind("active", [0, 0, 2])));
  assert.equal(made.effect("wind")?.pending, undefined);
  made.take(told(wind("active", [0, 0, 5]))); // somebody else's
  assert.deepEqual(made.effect("wind")?.parameters, { velocity: [0, 0, 5] });
});

test("what is asked before the garment is worn stands until it is", () => {
  const { desk: made, sent } = desk();
  made.ask("wind", "active");
  assert.equal(made.awaited("wind"), "active");
  assert.equal(sent.length, 1);
  made.take({ ...told(), kept: [{ name: "wind", state: "armed" }] });
  assert.equal(made.known, false);
  assert.equal(made.awaited("wind"), "armed", "as it is kept");
  assert.equal(made.effect("wind"), undefined);
  made.take({ ...told(wind("absent")), kept: [{ name: "wind", state: "armed", refused: "It is calm." }] });
  assert.equal(made.known, true);
  assert.equal(made.kept("wind")?.refused, "It is calm.");
  assert.equal(made.effect("wind")?.state, "absent");
});

test("what is refused is as the session told it before, and nobody else's refusal matters", () => {
  const { desk: made, sent } = desk();
  made.take(told(wind("active")));
  made.ask("wind", "active", { velocity: [0, 99, 0] });
  const { request } = sent[0];
  assert.equal(made.refused(refusal(request! + 1)), undefined);
  assert.deepEqual(made.effect("wind")?.parameters, { velocity: [0, 99, 0] });
  assert.equal(made.refused(refusal(request!)), "wind");
  assert.deepEqual(made.effect("wind"), wind("active"));
  assert.deepEqual(made.fault("wind")?.parameters, { velocity: [0, 99, 0] });
  made.ask("wind", "active", { velocity: [0, 1, 0] });
  assert.equal(made.fault("wind"), undefined);
});

test("an effect that another takes the place of is settled when it is armed", () => {
  const { desk: made } = desk();
  made.take(told({ name: "air_drag", state: "absent" }));
  made.ask("air_drag", "active");
  made.take(told({ name: "air_drag", state: "armed" }));
  assert.deepEqual(made.effect("air_drag"), { name: "air_drag", state: "armed" });
});

test("taking off, arming and measuring are said as such", () => {
  const { desk: made, sent } = desk();
  made.ask("wind", "absent");
  made.setAuto(true);
  made.setAuto(false);
  made.measure();
  assert.deepEqual(
    sent.map(({ type, ...rest }) => [type, "name" in rest ? rest.name : ""]),
    [["remove_effect", "wind"], ["set_effect", "auto"], ["remove_effect", "auto"], ["measure_effects", ""]],
  );
  assert.equal(new Set(sent.map(({ request }) => request)).size, 4);
});

test("nothing is known of another session", () => {
  const { desk: made, shows } = desk();
  made.take(told(wind("active")));
  made.ask("wind", "absent");
  made.forget();
  assert.equal(made.known, false);
  assert.equal(made.effect("wind"), undefined);
  assert.equal(shows(), 3);
});

test("a direction is the vector that it was made of", () => {
  assert.deepEqual(vectorOf({ size: 2, heading: 90, rise: 0 }), [2, 0, 0]);
  assert.deepEqual(vectorOf({ size: 9.81, heading: 0, rise: -90 }), [0, -9.81, 0]);
  assert.deepEqual(polarOf([0, -9.81, 0]), { size: 9.81, heading: 0, rise: -90 });
  assert.deepEqual(polarOf([0, 0, 0]), { size: 0, heading: 0, rise: 0 });
  for (const vector of [[1, 2, -3], [-4, 0.5, 1], [0, 3, 0]] as const) {
    for (const [k, value] of vectorOf(polarOf(vector)).entries()) assert.ok(Math.abs(value - vector[k]) < 1e-3);
  }
});

test("a slider's positions are values in bounds, and back", () => {
  for (const [low, high, whole] of [[0, 20, false], [1e-6, 1e-2, false], [-200, 1000, false], [1, 64, true]] as const) {
    const scale = new Scale(low, high, whole);
    assert.equal(scale.positionOf(low), 0);
    assert.equal(scale.positionOf(high), scale.end);
    assert.equal(scale.positionOf(10 * high), scale.end);
    for (let position = 0; position <= scale.end; position += 7) {
      const value = scale.valueAt(position);
      assert.ok(value >= low && value <= high);
      assert.ok(Math.abs(scale.positionOf(value) - position) <= 1, `${position} of ${low} to ${high}`);
    }
  }
  assert.equal(new Scale(1e-6, 1e-2, false).valueAt(100), 1e-4, "where bounds are far apart, by ratios");
});

test("a line is of the garment that its pieces are of, and one that names none of any", () => {
  const along = [{ panel: "coat/front", edge: 2 }];
  assert.ok(isOf("coat", { along, ratio: 0.8 }));
  assert.ok(!isOf("skirt", { along, ratio: 0.8 }));
  assert.ok(isOf("skirt", { first: "coat/front", second: "skirt/back" }));
  assert.ok(isOf("skirt", { along: [{ panel: "front", edge: 2 }] }));
  assert.ok(isOf("skirt", { first: "denim", second: "skin", static: 0.4 }));
});

test("entries can be made of all but curves", () => {
  const told = { about: "", unit: "", live: false } as const;
  const kinetic = { ...told, kind: "number", name: "kinetic", default: null, low: 0, high: 2, open: true, whole: false } as const;
  const first = { ...told, kind: "choice", name: "first", default: "denim", of: ["denim", "linen"] } as const;
  const panel = { ...told, kind: "panel", name: "panel", default: "", besides: [] } as const;
  const rows: RowsField = { ...told, kind: "rows", name: "materials", default: [], fields: [first, kinetic, panel] };
  assert.ok(canBeAdded(rows));
  assert.deepEqual(newRow(rows.fields), { first: "denim", kinetic: null, panel: "" });
  const warp = { ...told, kind: "curve", name: "warp", default: [] } as const;
  assert.ok(!canBeAdded({ ...rows, fields: [...rows.fields, warp] }));
});
