/** What can be drawn now: arrays that live as long as a topology and are overwritten by each frame. */

import type { GarmentTopology } from "@tryon/protocol";

import type { FrameFigures, FrameLayout, TopologyEvent } from "./worker_messages.ts";

/**
 * One surface: the arrays a renderer uploads. `positions` [m] and `normals` (unit) hold the newest frame taken; the
 * positions are relative to its `figures.anchor`.
 */
export interface Shape {
  readonly positions: Float32Array;
  readonly normals: Float32Array;
  readonly uv: Float32Array;
  readonly index: Uint32Array;
  /** line segments x 2 along the seams; empty for a body */
  readonly seams: Uint32Array;
}

/** Offsets [floats] of the four arrays in a frame's buffer. */
export function layoutOf(clothVertices: number, bodyVertices: number): FrameLayout {
  const cloth = clothVertices * 3;
  const body = bodyVertices * 3;
  return { clothPositions: 0, clothNormals: cloth, bodyPositions: 2 * cloth, bodyNormals: 2 * cloth + body, length: 2 * (cloth + body) };
}

/**
 * The garment and the body as last received. A renderer compares the two version numbers, which only grow, with those
 * it has drawn. `offer` keeps only the newest frame, `take` writes it into arrays that are allocated once per topology.
 */
export class GarmentScene {
  cloth: Shape | undefined;
  body: Shape | undefined;
  /** what is worn, from the innermost outwards, each with its share of the triangles; empty: one garment */
  garments: readonly GarmentTopology[] = [];
  /** simulated vertices of the garment: fewer than are drawn, since a seam is drawn once per piece */
  vertexCount = 0;
  faceCount = 0;
  topologyVersion = 0;
  frameVersion = 0;
  /** figures of the frame that `take` wrote last; undefined while the arrays hold no frame of this topology */
  figures: FrameFigures | undefined;
  private layout: FrameLayout = layoutOf(0, 0);
  private pending: Float32Array | undefined;
  private pendingFigures: FrameFigures | undefined;

  /** @param recycle gets back every buffer that is not needed any more */
  constructor(private readonly recycle: (buffer: ArrayBuffer) => void) {}

  setTopology(event: TopologyEvent): void {
    this.discard();
    const { cloth, body } = event;
    this.layout = layoutOf(cloth.source.length, body.vertexCount);
    this.cloth = shape(cloth.source.length, cloth.uv, cloth.index, cloth.seams);
    this.body = shape(body.vertexCount, new Float32Array(body.vertexCount * 2), body.index, new Uint32Array(0));
    this.garments = event.garments;
    this.vertexCount = event.vertexCount;
    this.faceCount = cloth.index.length / 3;
    this.topologyVersion += 1;
    this.frameVersion += 1;
    this.figures = undefined;
  }

  /** A frame has arrived; one that was offered before and not taken is given back undrawn. */
  offer(buffer: ArrayBuffer, figures: FrameFigures): void {
    this.discard();
    if (buffer.byteLength !== this.layout.length * Float32Array.BYTES_PER_ELEMENT) {
      this.recycle(buffer);
      return;
    }
    this.pending = new Float32Array(buffer);
    this.pendingFigures = figures;
  }

  /** Writes the newest frame into the arrays; returns whether there was one. */
  take(): boolean {
    const { pending, layout, cloth, body } = this;
    if (!pending || !cloth || !body) return false;
    cloth.positions.set(pending.subarray(layout.clothPositions, layout.clothNormals));
    cloth.normals.set(pending.subarray(layout.clothNormals, layout.bodyPositions));
    body.positions.set(pending.subarray(layout.bodyPositions, layout.bodyNormals));
    body.normals.set(pending.subarray(layout.bodyNormals, layout.length));
    this.figures = this.pendingFigures;
    this.frameVersion += 1;
    this.discard();
    return true;
  }

  private discard(): void {
    if (this.pending) this.recycle(this.pending.buffer as ArrayBuffer);
    this.pending = undefined;
    this.pendingFigures = undefined;
  }
}

function shape(vertices: number, uv: Float32Array, index: Uint32Array, seams: Uint32Array): Shape {
  return { positions: new Float32Array(vertices * 3), normals: new Float32Array(vertices * 3), uv, index, seams };
}
