import assert from "node:assert/strict";
import { test } from "node:test";

import type { FramePrice, ReportMessage } from "@tryon/protocol";
import { decadeAxis, evenAxis } from "../../clients/core/src/axis.ts";
import { accuracyAt, DIAL_END, positionOf } from "../../clients/core/src/dial.ts";
import { PriceLog } from "../../clients/core/src/price_log.ts";
import { significant } from "../../clients/web/src/format.ts";
import { inWords, usualMs } from "../../clients/web/src/price_plot.ts";

const REPORT: ReportMessage = {
  type: "report", seq: 1, t_sim: 0, iterations: 1, residual: 0, min_gap: null, max_stretch: 1, body_lag: 0, pairs: 0, retries: 0,
  times_ms: {}, solver_ms: 9.3, frames_per_second: 30, real_time_factor: 1, error: 1.25e-4,
};

test("an even axis begins at 0, holds the most, and has three to six round labels", () => {
  assert.deepEqual(evenAxis(11).labels, [0, 5, 10, 15]);
  assert.deepEqual(evenAxis(0.3).labels, [0, 0.1, 0.2, 0.3]);
  for (let most = 0.013; most < 20_000; most *= 1.07) {
    const { ends, labels, at } = evenAxis(most);
    assert.ok(ends[0] === 0 && ends[1] >= most * (1 - 1e-6) && ends[1] <= 1.5 * most, `${most} in ${ends[1]}`);
    assert.ok(labels.length >= 3 && labels.length <= 6, `${most}: ${labels.join(" ")}`);
    assert.match(labels[1].toExponential(), /^[125]e/);
    assert.equal(at(0), 0);
    assert.equal(at(ends[1]), 1);
    assert.ok(Math.abs(at(most / 2) - most / 2 / ends[1]) < 1e-12);
  }
});

test("a logarithmic axis has whole decades, each as long as the others", () => {
  const { ends, labels, marks, at } = decadeAxis(0.02, 0.7);
  assert.deepEqual(ends, [0.01, 1]);
  assert.deepEqual(labels, [0.01, 0.1, 1]);
  assert.equal(marks.length, 16);
  assert.ok(marks.every((mark) => at(mark) > 0 && at(mark) < 1));
  for (const [value, place] of [[0.01, 0], [0.1, 0.5], [1, 1], [Math.sqrt(0.1), 0.75]]) assert.ok(Math.abs(at(value) - place) < 1e-12);
});

test("a logarithmic axis has a decade where there is one value, and none more for a value at its end", () => {
  assert.deepEqual(decadeAxis(0.1, 0.1).ends, [0.1, 1]);
  assert.deepEqual(decadeAxis(0.001, 0.01).ends, [0.001, 0.01]);
  assert.deepEqual(decadeAxis(0.3, 0.4).ends, [0.1, 1]);
});

test("the dial goes from 0.01 to 3 mm in round numbers, evenly by their logarithms", () => {
  const all = Array.from({ length: DIAL_END + 1 }, (_, position) => accuracyAt(position));
  assert.equal(all[0], 1e-5);
  assert.equal(all[DIAL_END], 3e-3);
  for (const [position, accuracy] of all.entries()) {
    assert.equal(positionOf(accuracy), position);
    assert.ok(Math.abs(Math.log10(accuracy / 1e-5) - position / 10) < 0.025, `${accuracy} at ${position}`);
  }
  assert.equal(positionOf(2.4e-4), positionOf(2.5e-4));
  assert.equal(positionOf(1e-6), 0);
  assert.equal(positionOf(0.1), DIAL_END);
});

test("the newest prices are kept, of all frames that reports tell of, whose error is known", () => {
  const log = new PriceLog(3);
  const told = (...solved: FramePrice[]) => log.add({ ...REPORT, solved }, 11);
  assert.ok(told({ solver_ms: 1, error: 1e-4 }, { solver_ms: 2, error: null }, { solver_ms: 3, error: 0 }, { solver_ms: 4, error: 1.25e-4, late_ms: 0.5 }));
  assert.deepEqual(log.prices.map(({ solverMs }) => solverMs), [1, 4]);
  assert.deepEqual(log.prices[1], { errorMm: 0.125, solverMs: 4, lateMs: 0.5, deadlineMs: 11 });
  assert.ok(told({ solver_ms: 5, error: 1e-4 }, { solver_ms: 6, error: 1e-4 }));
  assert.deepEqual(log.prices.map(({ solverMs }) => solverMs), [4, 5, 6]);
  assert.equal(log.prices[2].lateMs, 0);
  assert.equal(told({ solver_ms: 7, error: null }), false);
  assert.equal(told(), false);
  assert.equal(log.prices.length, 3);
  log.reset();
  assert.deepEqual(log.prices, []);
});

test("of twenty frames the slowest is left out of what they usually take, of fewer none", () => {
  const taking = (times: readonly number[]) => times.map((solverMs) => ({ errorMm: 1, solverMs, lateMs: 0, deadlineMs: null }));
  const times = Array.from({ length: 19 }, (_, i) => 19 - i);
  assert.equal(usualMs([]), 0);
  assert.equal(usualMs(taking(times)), 19);
  assert.equal(usualMs(taking([5000, ...times])), 19);
  assert.equal(usualMs(taking([5000, 4000, ...times])), 4000);
});

test("the newest price in words says whether the deadline was met, if it stood by then", () => {
  const price = { errorMm: 0.1234, solverMs: 9.31, lateMs: 0, deadlineMs: 11 };
  assert.equal(inWords(price, 11), "0.12 mm in 9.3 ms; deadline 11 ms, met");
  assert.equal(inWords({ ...price, solverMs: 14.2, lateMs: 3.2 }, 11), "0.12 mm in 14.2 ms; deadline 11 ms, missed by 3.2 ms");
  assert.equal(inWords(price, 5), "0.12 mm in 9.3 ms; deadline 5 ms");
  assert.equal(inWords(price, null), "0.12 mm in 9.3 ms");
  assert.equal(inWords(undefined, null), "No frame was reported yet");
});

test("significant digits have no exponent and no idle zeros", () => {
  assert.equal(significant(0.25, 2), "0.25");
  assert.equal(significant(0.01, 2), "0.01");
  assert.equal(significant(100, 2), "100");
  assert.equal(significant(10_000, 4), "10000");
});
