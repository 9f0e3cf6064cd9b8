/** Entry point of the worker: owns the socket and the decoder, so that the page's thread is left to drawing. */
import { SUBPROTOCOL, type Inflate } from "@tryon/protocol";
import { ZSTDDecoder } from "zstddec";

import type { Socket, Surroundings } from "./connection.ts";
import { Stream } from "./stream.ts";
import type { ToPage, ToWorker } from "./worker_messages.ts";

/** The part of a dedicated worker's global scope that is used here. */
interface WorkerScope {
  postMessage(message: ToPage, transfer: Transferable[]): void;
  onmessage: ((event: MessageEvent<ToWorker>) => void) | null;
  close(): void;
}

const scope = self as unknown as WorkerScope;
const zstd = new ZSTDDecoder();
const ready = zstd.init();
const inflate: Inflate = (data, size) => zstd.decode(data, size);
let stream: Stream | undefined;

function surroundings(url: string): Surroundings {
  return {
    openSocket: () => new WebSocket(url, [SUBPROTOCOL]) as unknown as Socket,
    now: () => performance.timeOrigin + performance.now(),
    after: (ms, callback) => {
      const timer = setTimeout(callback, ms);
      return () => clearTimeout(timer);
    },
    random: Math.random,
  };
}

scope.onmessage = ({ data }) => {
  switch (data.kind) {
    case "open":
      void ready.then(() => {
        stream = new Stream(surroundings(data.url), inflate, (message, transfer) => scope.postMessage(message, transfer));
        stream.open();
      });
      return;
    case "send":
      stream?.send(data.message);
      return;
    case "recycle":
      stream?.recycle(data.buffer);
      return;
    case "close":
      stream?.close();
      scope.close();
      return;
  }
};
