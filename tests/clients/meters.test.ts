import assert from "node:assert/strict";
import { test } from "node:test";

import { PaceMeter, RateMeter } from "../../clients/core/src/meters.ts";

test("a steady stream reads its rate, a stopped one falls to 0", () => {
  const meter = new RateMeter(60);
  for (let t = 0; t <= 3_000; t += 50) meter.tick(t);
  assert.ok(Math.abs(meter.rate(3_000) - 20) < 1e-9);
  assert.equal(meter.rate(10_000), 0);
});

test("a rate needs two events", () => {
  const meter = new RateMeter();
  assert.equal(meter.rate(0), 0);
  meter.tick(0);
  assert.equal(meter.rate(0), 0);
});

test("pace is simulated per wall time over the last samples", () => {
  const meter = new PaceMeter(10);
  assert.ok(Number.isNaN(meter.pace));
  for (let i = 0; i < 50; i += 1) meter.tick(i * 10, i * (i < 25 ? 10 : 20) - (i < 25 ? 0 : 250));
  assert.ok(Math.abs(meter.pace - 0.5) < 1e-9);
});

test("a motion that starts over starts the pace afresh", () => {
  const meter = new PaceMeter();
  meter.tick(1_000, 0);
  meter.tick(2_000, 1_000);
  meter.tick(0, 1_100);
  assert.ok(Number.isNaN(meter.pace));
  meter.tick(500, 2_100);
  assert.equal(meter.pace, 0.5);
});
