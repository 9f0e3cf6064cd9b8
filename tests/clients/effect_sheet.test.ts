import assert from "node:assert/strict";
import { test } from "node:test";

import type { EffectFault } from "../../clients/core/src/effect_desk.ts";
import { placesOf, wordsOf, withPlace } from "../../clients/core/src/effect_places.ts";
import { EffectSheet } from "../../clients/core/src/effect_sheet.ts";
import type { EffectField, EffectParameters, EffectWord } from "../../clients/core/src/effect_words.ts";

const TOLD = { about: "", unit: "", live: false } as const;
const RATIO: EffectField = { ...TOLD, kind: "number", name: "ratio", default: 0.8, low: 0.2, high: 1.5, open: false, whole: false };
const ALONG: EffectField = { ...TOLD, kind: "edges", name: "along", default: [] };
const SPOT: EffectField[] = [
  { ...TOLD, kind: "panel", name: "on", default: "", besides: [] },
  { ...TOLD, kind: "coordinate", name: "right", default: null, low: -10, high: 10, axis: "x", of: "on" },
  { ...TOLD, kind: "coordinate", name: "up", default: null, low: -10, high: 10, axis: "y", of: "on" },
];
const HEM = { panel: "front", edge: 0 };
const SIDE = { panel: "front", edge: 1 };

function rows(name: string, ...fields: EffectField[]): EffectField {
  return { ...TOLD, kind: "rows", name, default: [], fields };
}

function sheet(...fields: EffectField[]): { made: EffectSheet; asked: EffectParameters[] } {
  const word: EffectWord = { name: "some", title: "Some", about: "", kept: false, lined: true, fields };
  const asked: EffectParameters[] = [];
  return { made: new EffectSheet(word, (parameters) => asked.push(parameters)), asked };
}

function fault(place: string, parameters: EffectParameters): EffectFault {
  return { parameters, place, message: "no", remedy: "another" };
}

test("places are told by the kinds of fields, whatever these are called", () => {
  const two: EffectField = { ...TOLD, kind: "edges", name: "zipped", default: [] };
  const pieces: EffectField = { ...TOLD, kind: "panels", name: "inside", default: [] };
  const other: EffectField = { ...TOLD, kind: "panel", name: "other", default: "", besides: ["body"] };
  const found = placesOf([RATIO, ALONG, two, pieces, other, ...SPOT]);
  const summary = found.map(({ kind, name, several, open, besides }) => [kind, name, several, open, besides.join()]);
  assert.deepEqual(summary, [
    ["edge", "along", true, false, ""],
    ["edge", "zipped", true, false, ""],
    ["piece", "inside", true, true, ""],
    ["piece", "other", false, false, "body"],
    ["spot", "on", false, false, ""],
  ]);
});

test("what is chosen is named, once, and said", () => {
  const [along] = placesOf([ALONG]);
  const one = withPlace(along, { along: [] }, HEM, false);
  assert.deepEqual(withPlace(along, one, SIDE, false), { along: [SIDE] });
  const both = withPlace(along, one, SIDE, true);
  assert.deepEqual(both, { along: [HEM, SIDE] });
  assert.deepEqual(withPlace(along, both, HEM, true), { along: [SIDE, HEM] });
  assert.deepEqual(wordsOf(along, both), ["front, edge 0", "front, edge 1"]);
  const [spot] = placesOf(SPOT);
  const pinned = withPlace(spot, {}, { panel: "back", at: [0.125, -0.3] }, false);
  assert.deepEqual(pinned, { on: "back", right: 0.125, up: -0.3 });
  assert.deepEqual(wordsOf(spot, pinned), ["back, at 12.5, -30.0 cm"]);
  assert.deepEqual(wordsOf(spot, { on: "back", right: null, up: null }), [], "a piece alone is no spot");
});

test("a line is a draft until it is told where, and is asked for then", () => {
  const { made, asked } = sheet(rows("lines", ALONG, RATIO));
  made.take({ lines: [{ along: [HEM], ratio: 1 }] }, undefined);
  const begun = made.begin("lines");
  assert.equal(made.untold(begun)?.name, "along");
  const drawn = made.change(begun, { ...begun.row, ratio: 0.5 })!;
  assert.deepEqual(asked, []);
  assert.deepEqual(made.entries("lines").map(({ draft }) => draft), [false, true]);
  assert.equal(made.count, 1);
  const placed = made.place(drawn, made.untold(drawn)!, SIDE, false)!;
  assert.equal(placed.draft, false);
  assert.deepEqual(asked, [{ lines: [{ along: [HEM], ratio: 1 }, { along: [SIDE], ratio: 0.5 }] }]);
  assert.deepEqual(made.entries("lines").map(({ draft }) => draft), [false, false]);
});

test("an entry with two places is whole when both are told", () => {
  const other: EffectField = { ...ALONG, name: "other" };
  const { made, asked } = sheet(rows("pairs", ALONG, other));
  const begun = made.begin("pairs");
  const half = made.place(begun, made.untold(begun)!, HEM, false)!;
  assert.deepEqual([half.draft, made.untold(half)?.name, asked.length], [true, "other", 0]);
  made.place(half, made.untold(half)!, SIDE, false);
  assert.deepEqual(asked, [{ pairs: [{ along: [HEM], other: [SIDE] }] }]);
});

test("an entry that needs no place is asked for as it begins", () => {
  const { made, asked } = sheet(rows("numbers", RATIO));
  assert.equal(made.begin("numbers").draft, false);
  assert.deepEqual(asked, [{ numbers: [{ ratio: 0.8 }] }]);
});

test("a line that is refused is a draft again, with why, and what is worn stands", () => {
  const { made, asked } = sheet(rows("lines", ALONG, RATIO));
  const worn = { lines: [{ along: [HEM], ratio: 1 }] };
  made.take(worn, undefined);
  made.begin("lines"); // one that is not whole stays what it is
  const begun = made.begin("lines");
  made.place(begun, made.untold(begun)!, SIDE, false);
  const why = fault("$.parameters.lines[1].along[0]", asked[0]);
  made.take(worn, why);
  made.take(worn, why); // told again, as anything else changes
  assert.deepEqual(made.entries("lines").map(({ row, draft }) => [row.along, draft]), [[[HEM], false], [[], true], [[SIDE], true]]);
  assert.deepEqual(made.fault, { list: "lines", index: 2, message: "no", remedy: "another" });
  made.remove(made.entries("lines")[2]);
  assert.equal(made.fault, undefined);
  assert.equal(made.entries("lines").length, 2);
});

test("a refusal of what is worn already is at its line, and one of all at the effect", () => {
  const { made } = sheet(rows("lines", ALONG, RATIO), RATIO);
  const worn = { lines: [{ along: [HEM], ratio: 1 }], ratio: 1 };
  made.take(worn, fault("$.parameters.lines[0].along[0]", { lines: [{ along: [SIDE], ratio: 1 }] }));
  assert.deepEqual([made.fault?.list, made.fault?.index, made.entries("lines").length], ["lines", 0, 1]);
  made.take(worn, fault("$.parameters.lines", worn));
  assert.deepEqual([made.fault?.list, made.fault?.index], ["lines", undefined]);
  made.take(worn, fault("$.parameters.ratio", worn));
  assert.equal(made.fault?.list, undefined);
});

test("a line that somebody else took away is not changed any more", () => {
  const { made, asked } = sheet(rows("lines", ALONG, RATIO));
  made.take({ lines: [{ along: [HEM], ratio: 1 }] }, undefined);
  const [line] = made.entries("lines");
  made.take({ lines: [] }, undefined);
  assert.equal(made.change(line, { along: [SIDE], ratio: 1 }), undefined);
  made.remove(line);
  assert.deepEqual(asked, []);
});

test("a place that is no entry's is asked for at once", () => {
  const pieces: EffectField = { ...TOLD, kind: "panels", name: "inside", default: [] };
  const { made, asked } = sheet(pieces, RATIO);
  made.take({ inside: [], ratio: 1 }, undefined);
  const [inside] = placesOf([pieces]);
  made.place(undefined, inside, { panel: "front" }, false);
  made.place(undefined, inside, { panel: "back" }, true);
  assert.deepEqual(asked.at(-1), { inside: ["front", "back"], ratio: 1 });
});
