import { ProtocolError, malformed } from "./errors.ts";
import { Codec, FLAG_OFFSETS_ZSTD, FRAME_HEADER_BYTES, FRAME_KIND, FRAME_MAGIC, ORIGIN_LIMIT } from "./generated.ts";
import { inflateExactly } from "./inflate.ts";
import type { Inflate } from "./inflate.ts";
import { Skinner } from "./skinning.ts";
import type { Topology } from "./topology.ts";

const BYTES_PER_OFFSET = 10;
const REACH = 32768;
/** an anchor that follows is moved along an axis when the root is farther from it than this [m] */
const FOLLOW_BEYOND = 8;

/**
 * One published frame. The object and its arrays belong to the decoder and are overwritten by the next `decode`.
 * Positions are flat (n,3) in metres, relative to `anchor`.
 */
export interface DecodedFrame {
  seq: number;
  /** client pose that the body goes to, or is at; 0: none yet, or the server plays a motion */
  poseSeq: number;
  topologyId: number;
  /** s, simulated time, poses' clock */
  tSim: number;
  /** s, the server's steady clock */
  tPublished: number;
  standsAlone: boolean;
  /** (3) m, the point of the session's space that `cloth` and `body` are relative to */
  anchor: Float64Array;
  /** (N,3) m */
  cloth: Float32Array;
  /** (N,3) grid units of the session, as sent */
  clothUnits: Int32Array;
  /** (B,3) m, the simulated body surface */
  body: Float32Array;
  /** body vertices that had an offset from the posed skin */
  offsetCount: number;
  /** (3) m in the session's frame, not relative to the anchor */
  root: Float64Array;
  /** (J,4) x, y, z, w */
  rotations: Float32Array;
}

interface Header {
  codec: number;
  flags: number;
  topologyId: number;
  seq: number;
  baseSeq: number;
  poseSeq: number;
  origin: Int32Array;
  tSim: number;
  tPublished: number;
  clothVertices: number;
  joints: number;
  headerBytes: number;
  clothBytes: number;
  offsetCount: number;
}

/** Decodes the frames of one connection, PROTOCOL.md section 7. After `setTopology` it allocates nothing by itself. */
export class FrameDecoder {
  private readonly header: Header = {
    codec: 0,
    flags: 0,
    topologyId: 0,
    seq: 0,
    baseSeq: 0,
    poseSeq: 0,
    origin: new Int32Array(3),
    tSim: 0,
    tPublished: 0,
    clothVertices: 0,
    joints: 0,
    headerBytes: 0,
    clothBytes: 0,
    offsetCount: 0,
  };
  private readonly anchor = new Float64Array(3);
  private readonly follows: boolean;
  private readonly pendingRoot = new Float64Array(3);
  private pendingRotations = new Float32Array(0);
  private topology: Topology | null = null;
  private skinner: Skinner | null = null;
  private frame: DecodedFrame | null = null;
  /** units of the newest frame, of the one before it, and room for the next */
  private last = new Int32Array(0);
  private before = new Int32Array(0);
  private spare = new Int32Array(0);
  /** how many of `last` and `before` hold the stream's newest frames: 0, 1 or 2 */
  private held = 0;
  private seq = 0;

  /**
   * @param inflate zstd, of your choice
   * @param anchor (3) m, a point of the session's space that positions are given relative to: near the viewer, so that
   *   float32 keeps its precision far from the session's origin. "follow": whole metres that stay near the root; they
   *   are 0 while it is near the session's origin, and each frame says what they are
   */
  constructor(
    private readonly inflate: Inflate,
    anchor: ArrayLike<number> | "follow" = [0, 0, 0],
  ) {
    this.follows = anchor === "follow";
    if (anchor !== "follow") this.anchor.set(anchor);
  }

  /** Number of the newest decoded frame, to be acknowledged; 0 before the first one. */
  get lastSeq(): number {
    return this.seq;
  }

  /** Frames refer to this topology from now on; the next one must stand alone. */
  setTopology(topology: Topology): void {
    const joints = topology.body.jointNames.length;
    const cloth = 3 * topology.clothVertexCount;
    this.topology = topology;
    this.skinner = new Skinner(topology.body);
    this.last = new Int32Array(cloth);
    this.before = new Int32Array(cloth);
    this.spare = new Int32Array(cloth);
    this.held = 0;
    this.pendingRotations = new Float32Array(4 * joints);
    this.frame = {
      seq: 0,
      poseSeq: 0,
      topologyId: topology.topologyId,
      tSim: 0,
      tPublished: 0,
      standsAlone: false,
      anchor: new Float64Array(3),
      cloth: new Float32Array(cloth),
      clothUnits: this.last,
      body: new Float32Array(topology.body.restVertices.length),
      offsetCount: 0,
      root: new Float64Array(3),
      rotations: new Float32Array(4 * joints),
    };
  }

  /**
   * Read one frame. Throws ProtocolError "missing_base" (send `keyframe_request`), "unknown_topology" (wait for
   * `topology`), "stale_frame", "unknown_codec", "malformed_frame" or "malformed_compression"; the decoder and the
   * frame it returned last are as before.
   */
  decode(data: Uint8Array): DecodedFrame {
    const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
    const header = this.readHeader(view);
    const { topology, skinner, frame } = this;
    if (topology === null || skinner === null || frame === null || topology.topologyId !== header.topologyId) {
      throw new ProtocolError(
        "unknown_topology",
        "frame.topology_id",
        `The frame is of topology ${header.topologyId}, which was not received.`,
        "Wait for its `topology` message.",
      );
    }
    this.checkAgainstStream(header, topology);
    const poseEnd = header.headerBytes + 24 + 16 * header.joints;
    const clothEnd = poseEnd + header.clothBytes;
    if (clothEnd > data.length) {
      throw malformed("frame.cloth_bytes", `The frame ends at byte ${data.length}, the cloth block at ${clothEnd}.`);
    }
    this.readPose(view, header.headerBytes);
    this.readCloth(header, data.subarray(poseEnd, clothEnd));
    const offsets = this.readOffsets(header, data.subarray(clothEnd), topology.body.restVertices.length / 3);

    if (this.follows) this.followRoot();
    skinner.pose(this.pendingRoot, this.pendingRotations, frame.body, this.anchor);
    addOffsets(offsets, header.offsetCount, topology.grid, frame.body);
    this.commit(header, frame, topology.grid);
    return frame;
  }

  private followRoot(): void {
    for (let axis = 0; axis < 3; axis++) {
      if (Math.abs(this.pendingRoot[axis] - this.anchor[axis]) > FOLLOW_BEYOND) {
        this.anchor[axis] = Math.round(this.pendingRoot[axis]);
      }
    }
  }

  private commit(header: Header, frame: DecodedFrame, grid: number): void {
    const units = this.spare;
    this.spare = this.before;
    this.before = this.last;
    this.last = units;
    this.held = header.baseSeq === 0 ? 1 : 2;
    this.seq = header.seq;
    for (let i = 0; i < units.length; i += 3) {
      frame.cloth[i] = grid * units[i] - this.anchor[0];
      frame.cloth[i + 1] = grid * units[i + 1] - this.anchor[1];
      frame.cloth[i + 2] = grid * units[i + 2] - this.anchor[2];
    }
    frame.seq = header.seq;
    frame.poseSeq = header.poseSeq;
    frame.tSim = header.tSim;
    frame.tPublished = header.tPublished;
    frame.standsAlone = header.baseSeq === 0;
    frame.clothUnits = units;
    frame.offsetCount = header.offsetCount;
    frame.anchor.set(this.anchor);
    frame.root.set(this.pendingRoot);
    frame.rotations.set(this.pendingRotations);
  }

  private readHeader(view: DataView): Header {
    if (view.byteLength < FRAME_HEADER_BYTES) {
      throw malformed("frame", `${view.byteLength} bytes are shorter than the header of ${FRAME_HEADER_BYTES}.`);
    }
    if (view.getUint8(0) !== FRAME_MAGIC || view.getUint8(1) !== FRAME_KIND) {
      throw malformed("frame.magic", `It begins with ${view.getUint8(0)} ${view.getUint8(1)}.`);
    }
    const header = this.header;
    header.codec = view.getUint8(2);
    header.flags = view.getUint8(3);
    header.topologyId = view.getUint32(4, true);
    header.seq = view.getUint32(8, true);
    header.baseSeq = view.getUint32(12, true);
    header.poseSeq = view.getUint32(16, true);
    for (let axis = 0; axis < 3; axis++) header.origin[axis] = view.getInt32(20 + 4 * axis, true);
    header.tSim = view.getFloat64(32, true);
    header.tPublished = view.getFloat64(40, true);
    header.clothVertices = view.getUint32(48, true);
    header.joints = view.getUint16(52, true);
    header.headerBytes = view.getUint16(54, true);
    header.clothBytes = view.getUint32(56, true);
    header.offsetCount = view.getUint32(60, true);
    if (header.codec > Codec.DELTA2) {
      throw new ProtocolError(
        "unknown_codec",
        "frame.codec",
        `Codec ${header.codec} isn't known.`,
        "Update this client, or ask for codec 0.",
      );
    }
    if (header.headerBytes < FRAME_HEADER_BYTES || header.headerBytes > view.byteLength) {
      throw malformed("frame.header_bytes", `A header of ${header.headerBytes} bytes doesn't fit.`);
    }
    const alone = header.codec === Codec.RAW || header.codec === Codec.KEY;
    if (header.seq === 0 || (header.baseSeq === 0) !== alone || header.baseSeq >= header.seq) {
      throw malformed("frame.base_seq", `Frame ${header.seq} can't have the base ${header.baseSeq}.`);
    }
    if (!Number.isFinite(header.tSim) || !Number.isFinite(header.tPublished)) {
      throw malformed("frame.t_sim", "A time isn't finite.");
    }
    for (let axis = 0; axis < 3; axis++) {
      if (Math.abs(header.origin[axis]) > ORIGIN_LIMIT) {
        throw malformed("frame.origin", `The origin ${header.origin[axis]} is too near the end of int32.`);
      }
    }
    return header;
  }

  private checkAgainstStream(header: Header, topology: Topology): void {
    if (header.seq <= this.seq) {
      throw new ProtocolError(
        "stale_frame",
        "frame.seq",
        `Frame ${header.seq} comes after frame ${this.seq}.`,
        "Use a new decoder for a new connection.",
      );
    }
    if (header.clothVertices !== topology.clothVertexCount || header.joints !== topology.body.jointNames.length) {
      throw malformed("frame.cloth_vertices", "The counts aren't those of the topology.");
    }
    const needed = header.codec === Codec.DELTA2 ? 2 : header.codec === Codec.DELTA1 ? 1 : 0;
    if (needed > 0 && (this.held < needed || this.seq !== header.baseSeq)) {
      throw new ProtocolError(
        "missing_base",
        "frame.base_seq",
        `Frame ${header.seq} is a difference to frames up to ${header.baseSeq} that were not received.`,
        "Send `keyframe_request` and ignore frames until one stands alone.",
      );
    }
  }

  private readPose(view: DataView, start: number): void {
    const rotations = this.pendingRotations;
    if (start + 24 + 4 * rotations.length > view.byteLength) {
      throw malformed("frame", "It ends within the pose.");
    }
    for (let axis = 0; axis < 3; axis++) this.pendingRoot[axis] = view.getFloat64(start + 8 * axis, true);
    if (!this.pendingRoot.every(Number.isFinite)) throw malformed("frame.root", "The root isn't finite.");
    for (let i = 0; i < rotations.length; i++) rotations[i] = view.getFloat32(start + 24 + 4 * i, true);
    for (let i = 0; i < rotations.length; i += 4) {
      const length = Math.hypot(rotations[i], rotations[i + 1], rotations[i + 2], rotations[i + 3]);
      if (!(Math.abs(length - 1) <= 0.01)) {
        throw malformed(`frame.rotations[${i / 4}]`, "It isn't a unit quaternion.");
      }
    }
  }

  /** Writes the units of this frame into `spare`. */
  private readCloth(header: Header, block: Uint8Array): void {
    const { last, before, spare } = this;
    const { codec, origin, clothVertices: count } = header;
    const size = 6 * count;
    if (codec === Codec.RAW && block.length !== size) {
      throw malformed("frame.cloth_bytes", `${block.length} bytes for ${count} vertices of 6.`);
    }
    const bytes = codec === Codec.RAW ? block : inflateExactly(this.inflate, block, size, "frame.cloth");
    for (let axis = 0; axis < 3; axis++) {
      let running = origin[axis];
      for (let vertex = 0; vertex < count; vertex++) {
        const at = 3 * vertex + axis;
        let unit: number;
        if (codec === Codec.RAW) {
          unit = origin[axis] + (((bytes[2 * at] | (bytes[2 * at + 1] << 8)) << 16) >> 16);
        } else {
          const zigzag = bytes[axis * count + vertex] | (bytes[(axis + 3) * count + vertex] << 8);
          const value = (zigzag >> 1) ^ -(zigzag & 1);
          if (codec === Codec.KEY) unit = running += value;
          else if (codec === Codec.DELTA1) unit = last[at] + value;
          else unit = 2 * last[at] - before[at] + value;
        }
        if (Math.abs(unit - origin[axis]) > REACH) {
          throw malformed("frame.cloth", "A vertex lies out of reach of the frame's origin.");
        }
        spare[at] = unit;
      }
    }
  }

  /** The offset block, inflated and checked. */
  private readOffsets(header: Header, block: Uint8Array, vertexCount: number): Uint8Array {
    const count = header.offsetCount;
    if (count > vertexCount) {
      throw malformed("frame.offset_count", `${count} offsets for ${vertexCount} body vertices.`);
    }
    const size = BYTES_PER_OFFSET * count;
    const compressed = (header.flags & FLAG_OFFSETS_ZSTD) !== 0 && count > 0;
    const bytes = compressed ? inflateExactly(this.inflate, block, size, "frame.offsets") : block;
    if (bytes.length !== size) throw malformed("frame.offsets", `${bytes.length} bytes for ${count} offsets.`);
    let vertex = 0;
    for (let k = 0; k < count; k++) {
      const gap = gapAt(bytes, count, k);
      vertex += gap;
      if ((k > 0 && gap === 0) || vertex >= vertexCount) {
        throw malformed("frame.offsets", "The vertex numbers don't ascend within the body.");
      }
    }
    return bytes;
  }
}

function gapAt(planes: Uint8Array, count: number, k: number): number {
  return planes[k] + 256 * (planes[count + k] + 256 * (planes[2 * count + k] + 256 * planes[3 * count + k]));
}

function addOffsets(planes: Uint8Array, count: number, grid: number, body: Float32Array): void {
  let vertex = 0;
  for (let k = 0; k < count; k++) {
    vertex += gapAt(planes, count, k);
    for (let axis = 0; axis < 3; axis++) {
      const zigzag = planes[(4 + axis) * count + k] | (planes[(7 + axis) * count + k] << 8);
      body[3 * vertex + axis] += grid * ((zigzag >> 1) ^ -(zigzag & 1));
    }
  }
}
