import type {
  ClientMessage,
  DesignMessage,
  EditedMessage,
  EffectsMessage,
  ErrorMessage,
  GoodbyeMessage,
  OutfitMessage,
  ReportMessage,
  StatusMessage,
  WelcomeMessage,
} from "@tryon/protocol";

import type { Link } from "./connection.ts";
import { GarmentScene } from "./garment_scene.ts";
import { RateMeter } from "./meters.ts";
import type { FrameFigures, ToPage, ToWorker } from "./worker_messages.ts";

/** Who is told what happens, on the page's thread. Frames are not told one by one: look at `scene` when drawing. */
export interface ClientEvents {
  link(link: Link): void;
  welcome(message: WelcomeMessage): void;
  status(message: StatusMessage): void;
  report(message: ReportMessage): void;
  effects(message: EffectsMessage): void;
  outfit(message: OutfitMessage): void;
  design(message: DesignMessage): void;
  edited(message: EditedMessage): void;
  error(message: ErrorMessage): void;
  goodbye(message: GoodbyeMessage): void;
}

/** Milliseconds since the epoch on a clock that never steps and that a page shares with its workers. */
export function steadyNow(): number {
  return performance.timeOrigin + performance.now();
}

/**
 * The page's end of one session: a worker holds the connection and decodes, this side keeps the scene and the figures.
 * Framework-free; it needs a browser's Worker and nothing else.
 */
export class Client {
  readonly scene: GarmentScene;
  /** frames that arrived */
  readonly arrivals = new RateMeter();
  /** figures of the newest frame that arrived, drawn or not */
  newest: FrameFigures | undefined;
  framesArrived = 0;
  private readonly worker: Worker;

  constructor(
    workerUrl: URL,
    private readonly events: ClientEvents,
  ) {
    this.worker = new Worker(workerUrl, { type: "module", name: "tryon stream" });
    this.scene = new GarmentScene((buffer) => this.post({ kind: "recycle", buffer }, [buffer]));
    this.worker.onmessage = (event: MessageEvent<ToPage>) => this.receive(event.data);
  }

  /** Connects to a session's stream and keeps connected. @param url ws: or wss: address of the stream */
  open(url: string): void {
    this.post({ kind: "open", url });
  }

  /** Asks something of the session; dropped while the link is down, as the link's state tells. */
  send(message: ClientMessage): void {
    this.post({ kind: "send", message });
  }

  /** Leaves the session and ends the worker once it has said goodbye. */
  close(): void {
    this.worker.onmessage = null;
    this.post({ kind: "close" });
  }

  private post(message: ToWorker, transfer: Transferable[] = []): void {
    this.worker.postMessage(message, transfer);
  }

  private receive(message: ToPage): void {
    switch (message.kind) {
      case "frame":
        this.arrivals.tick(steadyNow());
        this.framesArrived += 1;
        this.newest = message.figures;
        this.scene.offer(message.buffer, message.figures);
        return;
      case "topology":
        this.scene.setTopology(message);
        return;
      case "link":
        this.events.link(message.link);
        return;
      case "welcome":
        this.events.welcome(message.message);
        return;
      case "status":
        this.events.status(message.message);
        return;
      case "report":
        this.events.report(message.message);
        return;
      case "effects":
        this.events.effects(message.message);
        return;
      case "outfit":
        this.events.outfit(message.message);
        return;
      case "design":
        this.events.design(message.message);
        return;
      case "edited":
        this.events.edited(message.message);
        return;
      case "error":
        this.events.error(message.message);
        return;
      case "goodbye":
        this.events.goodbye(message.message);
        return;
    }
  }
}
