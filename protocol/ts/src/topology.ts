import { ProtocolError } from "./errors.ts";
import type { ArrayData, GarmentTopology, TopologyMessage } from "./generated.ts";
import { inflateExactly } from "./inflate.ts";
import type { Inflate } from "./inflate.ts";

const ELEMENTS = {
  uint8: Uint8Array,
  int16: Int16Array,
  uint16: Uint16Array,
  int32: Int32Array,
  uint32: Uint32Array,
  float32: Float32Array,
  float64: Float64Array,
} as const;

type DType = keyof typeof ELEMENTS;
type ArrayOf<D extends DType> = InstanceType<(typeof ELEMENTS)[D]>;

/** A body surface of B vertices bound to J joints. Arrays are flat, the last axis fastest. */
export interface BodySurface {
  /** (B,3) m, rest pose */
  restVertices: Float32Array;
  /** (F,3) vertex numbers, counter-clockwise from outside */
  faces: Uint32Array;
  /** J names, the order of a pose's rotations */
  jointNames: readonly string[];
  /** (J) parent of each joint, -1 for joint 0 */
  parents: Int32Array;
  /** (J,3) m, joint centres in the rest pose */
  restJoints: Float32Array;
  /** (B,K) joints that move each vertex */
  skinJoints: Uint16Array;
  /** (B,K) their weights */
  skinWeights: Float32Array;
}

/** What frames refer to. Arrays are flat, the last axis fastest. */
export interface Topology {
  topologyId: number;
  /** m, edge q of the grid */
  grid: number;
  /** N cloth vertices */
  clothVertexCount: number;
  /** (F,3) vertex numbers, counter-clockwise from outside */
  faces: Uint32Array;
  /** (F,3,2) m, pattern coordinates of the triangle corners; null: not told */
  uv: Float32Array | null;
  /** (F) index into panelNames; null: not told */
  panelOfFace: Uint16Array | null;
  panelNames: readonly string[];
  /** what is worn, from the innermost outwards; empty: one garment, of which nothing is told */
  garments: readonly GarmentTopology[];
  body: BodySurface;
}

/** Unpack a `topology` message. Throws ProtocolError "invalid_array" or "malformed_compression". */
export function readTopology(message: TopologyMessage, inflate: Inflate): Topology {
  const { cloth, body } = message;
  const read = <D extends DType>(array: ArrayData, place: string, dtype: D, shape: readonly number[]): ArrayOf<D> =>
    unpackArray(array, `$.${place}`, dtype, shape, inflate);
  const joints = body.joint_names.length;
  const vertices = body.rest_vertices.shape[0] ?? 0;
  const triangles = cloth.faces.shape[0] ?? 0;
  const influences = body.skin_joints.shape[1] ?? 0;
  const topology: Topology = {
    topologyId: message.topology_id,
    grid: message.grid,
    clothVertexCount: cloth.vertex_count,
    faces: read(cloth.faces, "cloth.faces", "uint32", [triangles, 3]),
    uv: cloth.uv ? read(cloth.uv, "cloth.uv", "float32", [triangles, 3, 2]) : null,
    panelOfFace: cloth.panel_of_face ? read(cloth.panel_of_face, "cloth.panel_of_face", "uint16", [triangles]) : null,
    panelNames: cloth.panel_names ?? [],
    garments: cloth.garments ?? [],
    body: {
      restVertices: read(body.rest_vertices, "body.rest_vertices", "float32", [vertices, 3]),
      faces: read(body.faces, "body.faces", "uint32", [body.faces.shape[0] ?? 0, 3]),
      jointNames: body.joint_names,
      parents: read(body.parents, "body.parents", "int32", [joints]),
      restJoints: read(body.rest_joints, "body.rest_joints", "float32", [joints, 3]),
      skinJoints: read(body.skin_joints, "body.skin_joints", "uint16", [vertices, influences]),
      skinWeights: read(body.skin_weights, "body.skin_weights", "float32", [vertices, influences]),
    },
  };
  checkIndices(topology.faces, cloth.vertex_count, "$.cloth.faces");
  checkIndices(topology.body.faces, vertices, "$.body.faces");
  checkIndices(topology.body.skinJoints, joints, "$.body.skin_joints");
  const inOrder = topology.body.parents.every((parent, joint) => (joint === 0 ? parent === -1 : parent >= 0 && parent < joint));
  if (!inOrder) throw invalid("$.body.parents", "They form no tree in order.");
  return topology;
}

function unpackArray<D extends DType>(
  array: ArrayData,
  place: string,
  dtype: D,
  shape: readonly number[],
  inflate: Inflate,
): ArrayOf<D> {
  if (array.dtype !== dtype) throw invalid(`${place}.dtype`, `The elements are ${array.dtype}, not ${dtype}.`);
  if (array.shape.length !== shape.length || array.shape.some((extent, axis) => extent !== shape[axis])) {
    throw invalid(`${place}.shape`, `The shape is [${array.shape.join(", ")}], not [${shape.join(", ")}].`);
  }
  const type = ELEMENTS[dtype];
  const size = shape.reduce((product, extent) => product * extent, type.BYTES_PER_ELEMENT);
  const bytes = array.codec === "zstd" ? inflateExactly(inflate, array.data, size, `${place}.data`) : array.data;
  if (bytes.length !== size) throw invalid(`${place}.data`, `${bytes.length} bytes came, not ${size}.`);
  return new type(bytes.slice().buffer) as ArrayOf<D>;
}

function checkIndices(indices: Uint32Array | Uint16Array, count: number, place: string): void {
  const wrong = indices.find((index) => index >= count);
  if (wrong !== undefined) throw invalid(place, `It names number ${wrong} of ${count}.`);
}

function invalid(place: string, message: string): ProtocolError {
  return new ProtocolError("invalid_array", place, message, "Send arrays as PROTOCOL.md section 4 defines them.");
}
