/** What the page and its worker say to each other. */

import type {
  ClientMessage,
  DesignMessage,
  EditedMessage,
  EffectsMessage,
  ErrorMessage,
  GarmentTopology,
  GoodbyeMessage,
  OutfitMessage,
  ReportMessage,
  StatusMessage,
  WelcomeMessage,
} from "@tryon/protocol";

import type { Link } from "./connection.ts";
import type { RenderMesh } from "./render_mesh.ts";

/** Where the four arrays lie in a frame's buffer, in floats from its start. */
export interface FrameLayout {
  readonly clothPositions: number;
  readonly clothNormals: number;
  readonly bodyPositions: number;
  readonly bodyNormals: number;
  readonly length: number;
}

/** What there is to say about one frame besides its vertices. */
export interface FrameFigures {
  readonly seq: number;
  /** simulated time [ms] */
  readonly simulatedMs: number;
  /** when it arrived, on the steady clock that the page shares with its worker [ms] */
  readonly receivedMs: number;
  /** when the server published it, on the same clock [ms] */
  readonly publishedMs: number;
  readonly bytes: number;
  readonly keyframe: boolean;
  /** time spent decoding, skinning and computing normals [ms] */
  readonly decodeMs: number;
  /** what the frame's positions are relative to: a point of the session's space near the wearer, whole metres */
  readonly anchor: readonly [number, number, number];
  /** where the wearer's root joint is, in the session's space [m] */
  readonly root: readonly [number, number, number];
}

export interface TopologyEvent {
  readonly kind: "topology";
  readonly id: number;
  /** simulated vertices of the garment */
  readonly vertexCount: number;
  readonly cloth: RenderMesh;
  /** what is worn, from the innermost outwards; empty: one garment, of which nothing is told */
  readonly garments: readonly GarmentTopology[];
  readonly body: { readonly vertexCount: number; readonly index: Uint32Array };
}

export type ToPage =
  | { readonly kind: "link"; readonly link: Link }
  | { readonly kind: "welcome"; readonly message: WelcomeMessage }
  | { readonly kind: "status"; readonly message: StatusMessage }
  | { readonly kind: "report"; readonly message: ReportMessage }
  | { readonly kind: "effects"; readonly message: EffectsMessage }
  | { readonly kind: "outfit"; readonly message: OutfitMessage }
  | { readonly kind: "design"; readonly message: DesignMessage }
  | { readonly kind: "edited"; readonly message: EditedMessage }
  | { readonly kind: "error"; readonly message: ErrorMessage }
  | { readonly kind: "goodbye"; readonly message: GoodbyeMessage }
  | { readonly kind: "frame"; readonly buffer: ArrayBuffer; readonly figures: FrameFigures }
  | TopologyEvent;

export type ToWorker =
  | { readonly kind: "open"; readonly url: string }
  | { readonly kind: "send"; readonly message: ClientMessage }
  | { readonly kind: "recycle"; readonly buffer: ArrayBuffer }
  | { readonly kind: "close" };
