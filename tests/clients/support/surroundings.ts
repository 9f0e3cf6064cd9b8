/** A connection's surroundings without network or time: a test says what happens, and when. */
import { decode } from "@msgpack/msgpack";
import { encode } from "@msgpack/msgpack";
import type { ClientMessage, ServerMessage } from "@tryon/protocol";

import type { Socket, Surroundings } from "../../../clients/core/src/connection.ts";

export class FakeSocket implements Socket {
  binaryType = "blob";
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;
  readonly sent: ClientMessage[] = [];
  closed = false;

  send(data: Uint8Array): void {
    this.sent.push(decode(data) as ClientMessage);
  }

  close(): void {
    this.closed = true;
  }

  /** The bytes arrive at the client, in a buffer of their own as a browser hands them out. */
  deliver(bytes: Uint8Array): void {
    this.onmessage?.({ data: bytes.slice().buffer });
  }

  say(message: ServerMessage): void {
    this.deliver(encode(message));
  }

  types(): string[] {
    return this.sent.map(({ type }) => type);
  }
}

interface Timer {
  readonly due: number;
  readonly callback: () => void;
}

export class FakeSurroundings implements Surroundings {
  readonly sockets: FakeSocket[] = [];
  private clock = 1_000_000;
  private readonly timers = new Set<Timer>();

  openSocket(): FakeSocket {
    const socket = new FakeSocket();
    this.sockets.push(socket);
    return socket;
  }

  now(): number {
    return this.clock;
  }

  after(ms: number, callback: () => void): () => void {
    const timer = { due: this.clock + ms, callback };
    this.timers.add(timer);
    return () => this.timers.delete(timer);
  }

  random(): number {
    return 0.5;
  }

  /** Lets time go by and calls what falls due, in order. */
  wait(ms: number): void {
    const end = this.clock + ms;
    for (;;) {
      const next = [...this.timers].filter(({ due }) => due <= end).sort((a, b) => a.due - b.due)[0] as Timer | undefined;
      if (!next) break;
      this.timers.delete(next);
      this.clock = next.due;
      next.callback();
    }
    this.clock = end;
  }

  /** The newest socket. */
  get socket(): FakeSocket {
    return this.sockets[this.sockets.length - 1];
  }

  /** How many timers are set. */
  get pending(): number {
    return this.timers.size;
  }
}

export function welcome(changes: Partial<Extract<ServerMessage, { type: "welcome" }>> = {}): ServerMessage {
  return {
    type: "welcome",
    version: 1,
    session: "s",
    epoch: "e1",
    server: "test",
    clock: 50,
    credit: 2,
    topology_id: 0,
    subjects: [],
    motions: [],
    fabrics: [],
    resume_token: "token-1",
    ...changes,
  };
}
