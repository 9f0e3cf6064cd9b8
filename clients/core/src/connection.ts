import { decodeMessage, encodeMessage, isFrame, MAJOR_VERSION } from "@tryon/protocol";
import type { ClientMessage, ErrorMessage, GoodbyeMessage, ServerMessage, TopologyMessage, WelcomeMessage } from "@tryon/protocol";

import { Backoff } from "./backoff.ts";
import { ServerClock } from "./clock.ts";

/** Where a connection stands. `closed` is final: the client asked for it, or the server said not to come back. */
export type Link =
  | { readonly state: "connecting" }
  | { readonly state: "open" }
  | { readonly state: "reconnecting"; readonly attempt: number; readonly waitMs: number; readonly reason: string }
  | { readonly state: "closed"; readonly reason: string };

/** The part of a WebSocket that is used here; a test passes its own. */
export interface Socket {
  binaryType: string;
  onopen: (() => void) | null;
  onmessage: ((event: { data: unknown }) => void) | null;
  onclose: ((event: { code: number; reason: string }) => void) | null;
  send(data: Uint8Array): void;
  close(code?: number, reason?: string): void;
}

/** What surrounds a connection: sockets, time and chance. */
export interface Surroundings {
  openSocket(): Socket;
  /** our steady clock [ms] */
  now(): number;
  /** calls back once after `ms`; returns what cancels it */
  after(ms: number, callback: () => void): () => void;
  random(): number;
}

/** Who is told what arrives. */
export interface Listener {
  link(link: Link): void;
  /** A connection begins: what was decoded on an earlier one is no base for its frames. */
  welcome(message: WelcomeMessage): void;
  /** @throws Error when the topology can't be used */
  topology(message: TopologyMessage): void;
  /**
   * @returns the number to acknowledge, or `missing_base` when the frame builds on one that is not here
   * @throws Error when the frame can't be read
   */
  frame(bytes: Uint8Array, receivedMs: number): number | "missing_base";
  message(message: ServerMessage): void;
}

export interface ConnectionOptions {
  readonly client: string;
  /** silence after which the server is taken for gone [ms] */
  readonly silenceMs: number;
  readonly pingMs: number;
}

const DEFAULTS: ConnectionOptions = { client: "tryon web", silenceMs: 12_000, pingMs: 3_000 };
const NORMAL = 1000;
const COMING_BACK = 4000; // closed so, the connection's seat in the session is kept for a while

/**
 * One lasting connection to a session: greets, acknowledges, asks for what is missing, notices silence, and comes back
 * after a loss. It owns no socket class and no timer: those are handed in (`Surroundings`).
 *
 * Messages asked for with `send` while the link is down are refused (false), never queued: a stale command that is
 * carried out much later surprises more than one that visibly did nothing.
 */
export class Connection {
  readonly clock = new ServerClock();
  private readonly backoff: Backoff;
  private readonly options: ConnectionOptions;
  private socket: Socket | undefined;
  private cancelTimer: (() => void) | undefined;
  private cancelBeat: (() => void) | undefined;
  private resumeToken: string | null = null;
  private epoch: string | undefined;
  private welcomed = false;
  private keyframeAsked = false;
  private heardMs = 0;
  private farewell: GoodbyeMessage | undefined;
  private fatal: ErrorMessage | undefined;

  constructor(
    private readonly surroundings: Surroundings,
    private readonly listener: Listener,
    options: Partial<ConnectionOptions> = {},
  ) {
    this.options = { ...DEFAULTS, ...options };
    this.backoff = new Backoff(() => surroundings.random());
  }

  /** Starts; returns at once. */
  open(): void {
    this.listener.link({ state: "connecting" });
    this.attempt();
  }

  /** Leaves for good. */
  close(reason = "left"): void {
    if (this.welcomed) this.send({ type: "bye", reason });
    this.drop(NORMAL, reason);
    this.listener.link({ state: "closed", reason });
  }

  /** Sends a message if the link is up; returns whether it was sent. */
  send(message: ClientMessage): boolean {
    if (!this.welcomed || !this.socket) return false;
    this.socket.send(encodeMessage(message));
    return true;
  }

  private attempt(): void {
    const socket = this.surroundings.openSocket();
    this.socket = socket;
    this.welcomed = false;
    this.keyframeAsked = false;
    this.farewell = undefined;
    this.fatal = undefined;
    this.heardMs = this.surroundings.now();
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.greet();
    socket.onmessage = (event) => this.receive(event.data);
    socket.onclose = (event) => this.lost(event.reason || `the connection was closed (code ${event.code})`);
    this.beat();
  }

  private greet(): void {
    const hello: ClientMessage = {
      type: "hello",
      versions: [MAJOR_VERSION],
      client: this.options.client,
      codecs: ["zstd"],
      resume: this.resumeToken,
    };
    this.socket?.send(encodeMessage(hello));
  }

  /** Pings, and gives up on a server that has been silent for too long, be it before or after its welcome. */
  private beat(): void {
    this.cancelBeat = this.surroundings.after(this.options.pingMs, () => {
      const now = this.surroundings.now();
      if (now - this.heardMs > this.options.silenceMs) {
        this.lost("the server has fallen silent");
        return;
      }
      if (this.ping(now)) this.backoff.reset();
      this.beat();
    });
  }

  private ping(now: number): boolean {
    return this.send({ type: "ping", t: now / 1000 });
  }

  private receive(data: unknown): void {
    const now = this.surroundings.now();
    this.heardMs = now;
    if (!(data instanceof ArrayBuffer)) {
      this.lost("the server sent text, which this protocol doesn't use");
      return;
    }
    const bytes = new Uint8Array(data);
    try {
      if (isFrame(bytes)) {
        this.takeFrame(bytes, now);
      } else {
        const message = decodeMessage(bytes);
        if (message) this.takeMessage(message, now);
      }
    } catch (error) {
      this.lost(error instanceof Error ? error.message : String(error));
    }
  }

  private takeFrame(bytes: Uint8Array, now: number): void {
    const answer = this.listener.frame(bytes, now);
    if (typeof answer === "number") {
      this.keyframeAsked = false;
      this.backoff.reset();
      this.send({ type: "ack", seq: answer });
    } else if (!this.keyframeAsked) {
      this.keyframeAsked = this.send({ type: "keyframe_request", reason: "the frame it builds on is not here" });
    }
  }

  private takeMessage(message: ServerMessage, now: number): void {
    switch (message.type) {
      case "welcome":
        this.takeWelcome(message, now);
        return;
      case "topology":
        this.listener.topology(message);
        return;
      case "pong":
        this.clock.observeExchange(message.t * 1000, message.clock * 1000, now);
        return;
      case "goodbye":
        this.farewell = message;
        break;
      case "error":
        if (message.fatal) this.fatal = message;
        break;
    }
    this.listener.message(message);
  }

  private takeWelcome(message: WelcomeMessage, now: number): void {
    if (message.epoch !== this.epoch) this.clock.reset();
    this.epoch = message.epoch;
    this.resumeToken = message.resume_token ?? null;
    this.clock.observe(message.clock * 1000, now);
    this.welcomed = true;
    this.ping(now);
    this.listener.link({ state: "open" });
    this.listener.welcome(message);
  }

  /** The link is down, whoever ended it: come back later, unless the server said that this is the end. */
  private lost(reason: string): void {
    const { farewell, fatal } = this;
    this.drop(COMING_BACK, "");
    if (fatal) {
      this.listener.link({ state: "closed", reason: fatal.message });
    } else if (farewell && typeof farewell.retry_after !== "number") {
      this.listener.link({ state: "closed", reason: farewell.reason });
    } else {
      const asked = farewell?.retry_after ?? 0;
      const waitMs = Math.max(this.backoff.next(), asked * 1000 * (1 + this.surroundings.random()));
      const why = farewell?.reason ?? reason;
      this.listener.link({ state: "reconnecting", attempt: this.backoff.attempts, waitMs, reason: why });
      this.cancelTimer = this.surroundings.after(waitMs, () => this.attempt());
    }
  }

  /** Lets go of the socket and of every timer; what the old socket still says is not heard. */
  private drop(code: number, reason: string): void {
    this.cancelTimer?.();
    this.cancelBeat?.();
    this.welcomed = false;
    const socket = this.socket;
    this.socket = undefined;
    if (!socket) return;
    socket.onopen = null;
    socket.onmessage = null;
    socket.onclose = null;
    socket.close(code, reason);
  }
}
