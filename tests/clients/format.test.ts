import assert from "node:assert/strict";
import { test } from "node:test";

import { format, simulatedTime, withUnit } from "../../clients/web/src/format.ts";

test("a figure that is not known is a dash without a unit, thousands stand apart", () => {
  assert.equal(format(NaN, 2), "–");
  assert.equal(withUnit(Infinity, 2, "mm"), "–");
  assert.equal(withUnit(10635, 0, "B"), "10\u2009635 B");
  assert.equal(withUnit(0.994, 2, ""), "0.99");
});

test("the motion's clock never shows a negative time", () => {
  assert.equal(simulatedTime(-0.42), "starts in 0.4 s");
  assert.equal(simulatedTime(-0.05), "starts in 0.1 s");
  assert.equal(simulatedTime(-0.04), "0.0 s");
  assert.equal(simulatedTime(3.26), "3.3 s");
  assert.equal(simulatedTime(NaN), "–");
});
