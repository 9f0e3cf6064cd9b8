import assert from "node:assert/strict";
import { test } from "node:test";

import { ServerClock } from "../../clients/core/src/clock.ts";

const OFFSET = 7_300;

test("the offset is not a number before the first sample", () => {
  assert.ok(Number.isNaN(new ServerClock().offsetMs));
});

test("one-way samples: the fastest message sets the offset, later slow ones do not move it", () => {
  const clock = new ServerClock();
  const delays = [40, 12, 3, 80, 25];
  delays.forEach((delay, i) => clock.observe(i * 10, i * 10 + OFFSET + delay));
  assert.equal(clock.offsetMs, OFFSET + 3);
  assert.equal(clock.toOurs(100), 100 + OFFSET + 3);
});

test("an exchange takes the delay out, and the shortest round trip is the one that counts", () => {
  const clock = new ServerClock();
  clock.observe(0, OFFSET + 40);
  clock.observeExchange(OFFSET + 100, 120, OFFSET + 160); // 20 up, 40 down: off by 10
  assert.equal(clock.offsetMs, OFFSET + 10);
  clock.observeExchange(OFFSET + 200, 202, OFFSET + 204);
  assert.equal(clock.offsetMs, OFFSET);
  clock.observeExchange(OFFSET + 300, 310, OFFSET + 420);
  assert.equal(clock.offsetMs, OFFSET);
});

test("no estimate lies above a one-way sample, which bounds it", () => {
  const clock = new ServerClock();
  clock.observeExchange(OFFSET, 10, OFFSET + 100); // all of the delay on the way back: the middle is 40 late
  assert.equal(clock.offsetMs, OFFSET + 40);
  clock.observe(200, OFFSET + 200 + 5);
  assert.equal(clock.offsetMs, OFFSET + 5);
});

test("a clock that drifts is followed after two windows at most", () => {
  const clock = new ServerClock(1_000);
  clock.observe(0, OFFSET);
  for (let t = 100; t <= 4_000; t += 100) clock.observe(t, t + OFFSET + t / 100);
  assert.ok(clock.offsetMs > OFFSET + 15 && clock.offsetMs <= OFFSET + 30, `${clock.offsetMs}`);
});

test("after a reset nothing is known any more", () => {
  const clock = new ServerClock();
  clock.observeExchange(OFFSET, 0, OFFSET);
  clock.reset();
  assert.ok(Number.isNaN(clock.offsetMs));
});

test("times that are not finite are refused", () => {
  const clock = new ServerClock();
  assert.throws(() => clock.observe(NaN, 1), RangeError);
  assert.throws(() => clock.observeExchange(0, Infinity, 1), RangeError);
});
