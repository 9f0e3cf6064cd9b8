import assert from "node:assert/strict";
import { test } from "node:test";

import { encode } from "@msgpack/msgpack";
import { FRAME_MAGIC } from "@tryon/protocol";
import type { ServerMessage, TopologyMessage, WelcomeMessage } from "@tryon/protocol";

import { Connection, type Link, type Listener } from "../../clients/core/src/connection.ts";
import { FakeSurroundings, welcome } from "./support/surroundings.ts";

class Heard implements Listener {
  readonly links: Link[] = [];
  readonly welcomes: WelcomeMessage[] = [];
  readonly messages: ServerMessage[] = [];
  answer: number | "missing_base" = 1;

  link(link: Link): void {
    this.links.push(link);
  }
  welcome(message: WelcomeMessage): void {
    this.welcomes.push(message);
  }
  topology(message: TopologyMessage): void {
    throw new Error(`topology ${message.topology_id} was not to come`);
  }
  frame(): number | "missing_base" {
    return this.answer;
  }
  message(message: ServerMessage): void {
    this.messages.push(message);
  }
  states(): string[] {
    return this.links.map(({ state }) => state);
  }
}

const FRAME = new Uint8Array([FRAME_MAGIC, 1]);

function connect(): { around: FakeSurroundings; heard: Heard; connection: Connection } {
  const around = new FakeSurroundings();
  const heard = new Heard();
  const connection = new Connection(around, heard, { silenceMs: 10_000, pingMs: 3_000 });
  connection.open();
  return { around, heard, connection };
}

function open(): ReturnType<typeof connect> {
  const parts = connect();
  parts.around.socket.onopen?.();
  parts.around.socket.say(welcome());
  return parts;
}

test("it says hello with what it speaks and is open after welcome", () => {
  const { around, heard } = connect();
  assert.deepEqual(heard.states(), ["connecting"]);
  around.socket.onopen?.();
  assert.deepEqual(around.socket.sent[0], { type: "hello", versions: [1], client: "tryon web", codecs: ["zstd"], resume: null });
  around.socket.say(welcome());
  assert.deepEqual(heard.states(), ["connecting", "open"]);
  assert.equal(around.socket.binaryType, "arraybuffer");
});

test("nothing is sent before welcome, and the sender is told", () => {
  const { around, connection } = connect();
  around.socket.onopen?.();
  assert.equal(connection.send({ type: "pause" }), false);
  around.socket.say(welcome());
  assert.equal(connection.send({ type: "pause" }), true);
  assert.deepEqual(around.socket.types(), ["hello", "ping", "pause"]);
});

test("every decoded frame is acknowledged with its number", () => {
  const { around, heard } = open();
  for (const seq of [5, 6]) {
    heard.answer = seq;
    around.socket.deliver(FRAME);
  }
  assert.deepEqual(around.socket.sent.slice(-2), [
    { type: "ack", seq: 5 },
    { type: "ack", seq: 6 },
  ]);
});

test("a missing base is asked for once, until a frame can be decoded again", () => {
  const { around, heard } = open();
  const asked = () => around.socket.types().filter((type) => type === "keyframe_request").length;
  heard.answer = "missing_base";
  around.socket.deliver(FRAME);
  around.socket.deliver(FRAME);
  assert.equal(asked(), 1);
  heard.answer = 9;
  around.socket.deliver(FRAME);
  heard.answer = "missing_base";
  around.socket.deliver(FRAME);
  assert.equal(asked(), 2);
});

test("a lost connection comes back with its token, after waits that double up to a limit", () => {
  const { around, heard } = open();
  around.socket.onclose?.({ code: 1006, reason: "" });
  const waits: number[] = [];
  for (let attempt = 1; attempt <= 8; attempt += 1) {
    const link = heard.links[heard.links.length - 1];
    assert.ok(link.state === "reconnecting");
    assert.equal(link.attempt, attempt);
    waits.push(link.waitMs);
    const before = around.sockets.length;
    around.wait(link.waitMs - 1);
    assert.equal(around.sockets.length, before, "it came back too early");
    around.wait(1);
    assert.equal(around.sockets.length, before + 1);
    around.socket.onclose?.({ code: 1006, reason: "" });
  }
  assert.deepEqual(waits.slice(0, 4), [187.5, 375, 750, 1_500]);
  assert.equal(waits[7], 6_000);
  around.wait(8_000);
  around.socket.onopen?.();
  assert.deepEqual(around.socket.sent[0], { type: "hello", versions: [1], client: "tryon web", codecs: ["zstd"], resume: "token-1" });
  around.socket.say(welcome({ resume_token: "token-2" }));
  assert.equal(heard.links[heard.links.length - 1].state, "open");
});

test("waits begin small again once frames arrive, not by a mere welcome", () => {
  const { around, heard } = open();
  const lose = (): number => {
    around.socket.onclose?.({ code: 1006, reason: "" });
    const link = heard.links[heard.links.length - 1];
    assert.ok(link.state === "reconnecting");
    around.wait(link.waitMs);
    around.socket.onopen?.();
    around.socket.say(welcome());
    return link.attempt;
  };
  assert.deepEqual([lose(), lose(), lose()], [1, 2, 3]);
  around.socket.deliver(FRAME);
  assert.equal(lose(), 1);
});

test("bytes that can't be read end the connection, which comes back", () => {
  const { around, heard } = open();
  const first = around.socket;
  first.deliver(new Uint8Array([0x92, 1]));
  assert.ok(first.closed);
  assert.equal(heard.links[heard.links.length - 1].state, "reconnecting");
});

test("what an old socket still says is not heard", () => {
  const { around, heard } = open();
  const old = around.socket;
  const { onmessage } = old;
  old.onclose?.({ code: 1006, reason: "" });
  assert.ok(onmessage !== null);
  assert.equal(old.onmessage, null);
  assert.equal(heard.messages.length, 0);
});

test("a server that falls silent is given up, one that answers pings is not", () => {
  const { around, heard } = open();
  for (let i = 0; i < 10; i += 1) {
    around.wait(3_000);
    around.socket.say({ type: "pong", t: around.now() / 1000, clock: 60 + i });
  }
  assert.equal(heard.links[heard.links.length - 1].state, "open");
  around.wait(15_000);
  const link = heard.links.find(({ state }) => state === "reconnecting");
  assert.ok(link?.state === "reconnecting" && link.reason.includes("silent"));
});

test("a server that never answers hello is given up too", () => {
  const { around, heard } = connect();
  around.socket.onopen?.();
  around.wait(13_000);
  assert.equal(heard.links[1].state, "reconnecting");
});

test("goodbye says when to come back, or that this was all", () => {
  const back = open();
  back.around.socket.say({ type: "goodbye", reason: "restart", retry_after: 2 });
  back.around.socket.onclose?.({ code: 1001, reason: "" });
  const link = back.heard.links[back.heard.links.length - 1];
  assert.ok(link.state === "reconnecting");
  assert.equal(link.waitMs, 3_000);
  assert.equal(link.reason, "restart");

  const over = open();
  over.around.socket.say({ type: "goodbye", reason: "ended", retry_after: null });
  over.around.socket.onclose?.({ code: 1000, reason: "" });
  assert.deepEqual(over.heard.links[over.heard.links.length - 1], { state: "closed", reason: "ended" });
  assert.equal(over.around.pending, 0);
});

test("a fatal error is the end, another one is only told", () => {
  const { around, heard } = open();
  const fault = { type: "error", code: "c", place: "$", message: "gone", remedy: "r" } as const;
  around.socket.say({ ...fault, fatal: false });
  assert.equal(heard.links[heard.links.length - 1].state, "open");
  around.socket.say({ ...fault, fatal: true });
  around.socket.onclose?.({ code: 4404, reason: "" });
  assert.deepEqual(heard.links[heard.links.length - 1], { state: "closed", reason: "gone" });
  assert.equal(heard.messages.length, 2);
});

test("closing says goodbye and leaves no timer behind", () => {
  const { around, heard, connection } = open();
  connection.close();
  assert.deepEqual(around.socket.types().slice(-1), ["bye"]);
  assert.ok(around.socket.closed);
  assert.equal(around.pending, 0);
  assert.equal(heard.links[heard.links.length - 1].state, "closed");
});

test("a message of a type that is not known yet is ignored", () => {
  const { around, heard } = open();
  around.socket.deliver(encode({ type: "weather", sunny: true }));
  assert.equal(heard.messages.length, 0);
  assert.equal(heard.links[heard.links.length - 1].state, "open");
});

test("the clock starts anew with another epoch, not with a mere reconnection", () => {
  const { around, connection } = open();
  const first = connection.clock.offsetMs;
  assert.equal(first, 1_000_000 - 50_000);
  around.socket.onclose?.({ code: 1006, reason: "" });
  around.wait(1_000);
  around.socket.onopen?.();
  around.socket.say(welcome({ clock: 50.5 })); // a slow message of the same server
  assert.equal(connection.clock.offsetMs, first);
  around.socket.onclose?.({ code: 1006, reason: "" });
  around.wait(1_000);
  around.socket.onopen?.();
  around.socket.say(welcome({ clock: 1, epoch: "e2" }));
  assert.equal(connection.clock.offsetMs, around.now() - 1_000);
});
