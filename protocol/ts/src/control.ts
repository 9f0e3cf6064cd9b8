import { decode, encode } from "@msgpack/msgpack";

import { ProtocolError } from "./errors.ts";
import { FRAME_MAGIC, SERVER_MESSAGE_TYPES } from "./generated.ts";
import type { ClientMessage, ServerMessage } from "./generated.ts";

/** True when the bytes are a frame: they begin with 0xC1, which no MessagePack value begins with. */
export function isFrame(data: Uint8Array): boolean {
  return data.length > 0 && data[0] === FRAME_MAGIC;
}

/** The bytes of one control message. */
export function encodeMessage(message: ClientMessage): Uint8Array {
  return encode(message, { ignoreUndefined: true });
}

/**
 * Read one control message of the server. null: a type that this version doesn't know, to be ignored.
 * Throws ProtocolError "malformed_message" for anything but a MessagePack map with a string "type".
 */
export function decodeMessage(data: Uint8Array): ServerMessage | null {
  let value: unknown;
  try {
    value = decode(data);
  } catch (cause) {
    throw malformedMessage(String(cause));
  }
  if (typeof value !== "object" || value === null || !("type" in value) || typeof value.type !== "string") {
    throw malformedMessage('no map with a string "type"');
  }
  const known: readonly string[] = SERVER_MESSAGE_TYPES;
  return known.includes(value.type) ? (value as ServerMessage) : null;
}

function malformedMessage(detail: string): ProtocolError {
  return new ProtocolError(
    "malformed_message",
    "$",
    `The message isn't one MessagePack map (${detail}).`,
    "Send each control message as one binary websocket message that holds one MessagePack map.",
  );
}
