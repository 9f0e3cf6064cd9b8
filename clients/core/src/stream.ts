import { FrameDecoder, ProtocolError, readTopology } from "@tryon/protocol";
import type { ClientMessage, DecodedFrame, Inflate, ServerMessage, TopologyMessage, WelcomeMessage } from "@tryon/protocol";

import { Connection, type ConnectionOptions, type Link, type Listener, type Surroundings } from "./connection.ts";
import { FrameBuffers } from "./frame_buffers.ts";
import { layoutOf } from "./garment_scene.ts";
import { vertexNormals } from "./normals.ts";
import { buildRenderMesh, gather, type RenderMesh } from "./render_mesh.ts";
import type { FrameLayout, ToPage } from "./worker_messages.ts";

/** What a topology needs prepared once. */
interface Prepared {
  readonly faces: Uint32Array;
  readonly bodyFaces: Uint32Array;
  readonly mesh: RenderMesh;
  readonly layout: FrameLayout;
  /** normals of the simulated garment, vertices x 3 */
  readonly normals: Float32Array;
}

/**
 * The worker's side of a session: decodes what the connection brings and makes it ready to be drawn. Positions, normals
 * and seams are computed here, so that the page's thread only uploads them.
 */
export class Stream implements Listener {
  private readonly connection: Connection;
  private readonly buffers = new FrameBuffers();
  private decoder: FrameDecoder;
  private prepared: Prepared | undefined;

  /** @param post hands a message to the page; the buffers in `transfer` change hands with it */
  constructor(
    private readonly surroundings: Surroundings,
    private readonly inflate: Inflate,
    private readonly post: (message: ToPage, transfer: Transferable[]) => void,
    options: Partial<ConnectionOptions> = {},
  ) {
    this.decoder = new FrameDecoder(inflate, "follow");
    this.connection = new Connection(surroundings, this, options);
  }

  open(): void {
    this.connection.open();
  }

  close(): void {
    this.connection.close();
  }

  send(message: ClientMessage): void {
    this.connection.send(message);
  }

  recycle(buffer: ArrayBuffer): void {
    this.buffers.giveBack(buffer);
  }

  // Listener ---------------------------------------------------------------------------------------------------------

  link(link: Link): void {
    this.post({ kind: "link", link }, []);
  }

  welcome(message: WelcomeMessage): void {
    this.decoder = new FrameDecoder(this.inflate, "follow"); // sequence numbers may begin anew
    this.prepared = undefined;
    this.post({ kind: "welcome", message }, []);
  }

  topology(message: TopologyMessage): void {
    const topology = readTopology(message, this.inflate);
    this.decoder.setTopology(topology);
    const mesh = buildRenderMesh(topology.faces, topology.uv, topology.panelOfFace);
    const bodyVertices = topology.body.restVertices.length / 3;
    const layout = layoutOf(mesh.source.length, bodyVertices);
    this.prepared = {
      faces: topology.faces,
      bodyFaces: topology.body.faces,
      mesh,
      layout,
      normals: new Float32Array(topology.clothVertexCount * 3),
    };
    this.buffers.resize(layout.length * Float32Array.BYTES_PER_ELEMENT);
    const body = { vertexCount: bodyVertices, index: topology.body.faces };
    const { topologyId: id, clothVertexCount: vertexCount, garments } = topology;
    this.post({ kind: "topology", id, vertexCount, cloth: mesh, garments, body }, []);
  }

  frame(bytes: Uint8Array, receivedMs: number): number | "missing_base" {
    let frame: DecodedFrame;
    try {
      frame = this.decoder.decode(bytes);
    } catch (error) {
      if (error instanceof ProtocolError && error.code === "missing_base") return "missing_base";
      throw error;
    }
    this.connection.clock.observe(frame.tPublished * 1000, receivedMs);
    const buffer = this.buffers.take();
    this.fill(new Float32Array(buffer), frame);
    const figures = {
      seq: frame.seq,
      simulatedMs: frame.tSim * 1000,
      receivedMs,
      publishedMs: this.connection.clock.toOurs(frame.tPublished * 1000),
      bytes: bytes.length,
      keyframe: frame.standsAlone,
      decodeMs: this.surroundings.now() - receivedMs,
      anchor: [frame.anchor[0], frame.anchor[1], frame.anchor[2]] as const,
      root: [frame.root[0], frame.root[1], frame.root[2]] as const,
    };
    this.post({ kind: "frame", buffer, figures }, [buffer]);
    return frame.seq;
  }

  message(message: ServerMessage): void {
    switch (message.type) {
      case "status":
        this.post({ kind: "status", message }, []);
        return;
      case "report":
        this.post({ kind: "report", message }, []);
        return;
      case "effects":
        this.post({ kind: "effects", message }, []);
        return;
      case "outfit":
        this.post({ kind: "outfit", message }, []);
        return;
      case "design":
        this.post({ kind: "design", message }, []);
        return;
      case "edited":
        this.post({ kind: "edited", message }, []);
        return;
      case "error":
        this.post({ kind: "error", message }, []);
        return;
      case "goodbye":
        this.post({ kind: "goodbye", message }, []);
        return;
    }
  }

  /** Writes positions and normals of garment and body where the layout wants them. */
  private fill(out: Float32Array, frame: DecodedFrame): void {
    const { faces, bodyFaces, mesh, layout, normals } = this.prepared!;
    gather(mesh.source, frame.cloth, out, layout.clothPositions);
    vertexNormals(frame.cloth, faces, normals);
    gather(mesh.source, normals, out, layout.clothNormals);
    out.set(frame.body, layout.bodyPositions);
    vertexNormals(frame.body, bodyFaces, out.subarray(layout.bodyNormals, layout.length));
  }
}
