import assert from "node:assert/strict";
import { test } from "node:test";

import type { StatusMessage } from "@tryon/protocol";
import { AccuracyDesk, type AccuracyChoice } from "../../clients/core/src/accuracy_desk.ts";

const NOTHING: AccuracyChoice = { accuracy: null, deadlineMs: null, preset: null };
const FINE: AccuracyChoice = { accuracy: 2e-5, deadlineMs: null, preset: null };
const QUICK: AccuracyChoice = { accuracy: null, deadlineMs: 11, preset: null };
const FIT: AccuracyChoice = { accuracy: null, deadlineMs: null, preset: "fit" };

/** A desk with what it said to the session, and what it showed. */
function desk(): { desk: AccuracyDesk; sent: AccuracyChoice[]; shown: AccuracyChoice[] } {
  const [sent, shown]: AccuracyChoice[][] = [[], []];
  const made = new AccuracyDesk(
    ({ accuracy = null, deadline_ms: deadlineMs = null, preset = null }) => sent.push({ accuracy, deadlineMs, preset }),
    (choice) => shown.push(choice),
  );
  return { desk: made, sent, shown };
}

function status({ accuracy, deadlineMs, preset }: AccuracyChoice): StatusMessage {
  return { type: "status", state: "running", detail: "", progress: null, motion: null, fabric: "", playing: true, accuracy, deadline_ms: deadlineMs, preset };
}

test("what was before does not come back while a choice is on its way", () => {
  const { desk: made, sent, shown } = desk();
  made.choose(FINE);
  made.take(status(NOTHING));
  assert.deepEqual(made.choice, FINE);
  made.choose(NOTHING); // and back at once: its answers are both on their way
  made.take(status(FINE));
  assert.deepEqual(made.choice, NOTHING);
  made.take(status(NOTHING));
  assert.deepEqual(sent, [FINE, NOTHING]);
  assert.deepEqual(shown, [FINE, NOTHING]);
});

test("another client's choice is shown, and is none of this page's to say", () => {
  const { desk: made, sent, shown } = desk();
  made.choose(FINE);
  made.take(status(FINE));
  made.take(status(QUICK));
  made.take(status(QUICK));
  assert.deepEqual(shown, [FINE, QUICK]);
  assert.deepEqual(sent, [FINE]);
});

test("a choice is said again to a session that this page opens, until it has it", () => {
  const { desk: made, sent } = desk();
  made.choose(QUICK);
  made.take(status(QUICK));
  made.began(false);
  made.welcomed();
  made.take(status(NOTHING)); // the new session's own
  assert.deepEqual(made.choice, QUICK);
  made.welcomed(); // the connection was lost meanwhile
  made.take(status(QUICK));
  made.welcomed();
  assert.deepEqual(sent, [QUICK, QUICK, QUICK]);
});

test("a preset is said with the rest, again to the next session, and is followed where it could not be had", () => {
  const { desk: made, sent, shown } = desk();
  made.choose(FIT);
  made.take(status(NOTHING));
  assert.deepEqual(made.choice, FIT);
  made.take(status(FIT));
  made.began(false);
  made.welcomed();
  made.take(status(FIT));
  made.take(status(NOTHING)); // it could not be built
  assert.deepEqual(made.choice, NOTHING);
  assert.deepEqual(sent, [FIT, FIT]);
  assert.deepEqual(shown, [FIT, NOTHING]);
});

test("a session that is joined keeps its own choice", () => {
  const { desk: made, sent } = desk();
  made.choose(QUICK);
  made.began(true);
  made.welcomed();
  made.take(status(FINE));
  assert.deepEqual(made.choice, FINE);
  assert.deepEqual(sent, [QUICK]);
});

test("nothing is said to a new session where nothing was chosen, nor twice where nothing changed", () => {
  const { desk: made, sent, shown } = desk();
  made.began(false);
  made.welcomed();
  assert.deepEqual(sent, []);
  made.choose(FINE);
  made.choose({ ...FINE });
  assert.deepEqual(sent, [FINE]);
  assert.deepEqual(shown, [FINE, FINE]); // what was on its way to another choice shows this one again
});

test("a choice that the server rounds is the same", () => {
  const { desk: made } = desk();
  made.choose({ ...FINE, deadlineMs: 11.12345678 });
  made.take(status({ ...FINE, deadlineMs: 11.123457 }));
  made.take(status(FINE)); // it is answered, so another one's is followed
  assert.deepEqual(made.choice, FINE);
});
