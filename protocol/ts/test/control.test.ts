import assert from "node:assert/strict";
import { test } from "node:test";

import { decode } from "@msgpack/msgpack";

import { CLIENT_MESSAGE_TYPES, ProtocolError, SERVER_MESSAGE_TYPES } from "../src/index.ts";
import { decodeMessage, encodeMessage, isFrame, isPoseMessage } from "../src/index.ts";
import type { ClientMessage } from "../src/index.ts";
import { messageNames, readBytes, readJson } from "./vectors.ts";

function typesOf(side: "client" | "server"): string[] {
  const types = messageNames(side).map((name) => (readJson(`messages/${name}.json`) as { type: string }).type);
  return [...new Set(types)].sort();
}

test("every message type of the union has a golden vector", () => {
  assert.deepEqual(typesOf("client"), [...CLIENT_MESSAGE_TYPES].sort());
  assert.deepEqual(typesOf("server"), [...SERVER_MESSAGE_TYPES].sort());
});

for (const name of messageNames("server")) {
  test(`${name} decodes to its map`, () => {
    assert.deepEqual(decodeMessage(readBytes(`messages/${name}.bin`)), readJson(`messages/${name}.json`));
  });
}

for (const name of messageNames("client")) {
  test(`${name} is encoded to bytes that hold its map`, () => {
    const message = readJson(`messages/${name}.json`) as ClientMessage;
    const bytes = encodeMessage(message);
    assert.deepEqual(decode(bytes), message);
    assert.deepEqual(decode(readBytes(`messages/${name}.bin`)), message);
    assert.equal(isFrame(bytes), false);
  });
}

test("a field left undefined is not sent", () => {
  assert.deepEqual(decode(encodeMessage({ type: "play", request: undefined })), { type: "play" });
});

test("guards tell messages apart by their type", () => {
  assert.equal(isPoseMessage({ type: "pose" }), true);
  assert.equal(isPoseMessage({ type: "ping" }), false);
});

test("a message of unknown type is ignored", () => {
  assert.equal(decodeMessage(Uint8Array.of(0x81, 0xa4, 0x74, 0x79, 0x70, 0x65, 0xa1, 0x78)), null);
});

for (const [what, bytes] of [
  ["no bytes", []],
  ["a number", [5]],
  ["a map without a type", [0x80]],
  ["a map cut short", [0x81, 0xa4, 0x74]],
  ["a type that is a number", [0x81, 0xa4, 0x74, 0x79, 0x70, 0x65, 0x01]],
] as const) {
  test(`${what} is refused as a control message`, () => {
    assert.throws(
      () => decodeMessage(Uint8Array.from(bytes)),
      (error) => error instanceof ProtocolError && error.code === "malformed_message" && error.remedy !== "",
    );
  });
}
