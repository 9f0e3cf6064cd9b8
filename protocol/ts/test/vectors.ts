import { readFileSync, readdirSync } from "node:fs";

const FOLDER = new URL("../../vectors/", import.meta.url);

export function readBytes(name: string): Uint8Array {
  return new Uint8Array(readFileSync(new URL(name, FOLDER)));
}

export function readJson(name: string): unknown {
  return JSON.parse(readFileSync(new URL(name, FOLDER), "utf-8"), (_key, value: unknown) =>
    typeof value === "object" && value !== null && "$base64" in value
      ? new Uint8Array(Buffer.from(String(value.$base64), "base64"))
      : value,
  );
}

/** Names of the messages without their ending. */
export function messageNames(side: "client" | "server"): string[] {
  return readdirSync(new URL("messages/", FOLDER))
    .filter((name) => name.startsWith(side) && name.endsWith(".bin"))
    .map((name) => name.slice(0, -4));
}

export interface FrameNumbers {
  seq: number;
  pose_seq: number;
  topology_id: number;
  t_sim: number;
  t_published: number;
  stands_alone: boolean;
  offset_count: number;
  root: number[];
  rotations: number[][];
  cloth_units: number[][];
  body: number[][];
}

export interface TopologyNumbers {
  topology_id: number;
  grid: number;
  cloth_vertex_count: number;
  faces: number[][];
  uv: number[][][];
  panel_of_face: number[];
  panel_names: string[];
  body: {
    rest_vertices: number[][];
    faces: number[][];
    joint_names: string[];
    parents: number[];
    rest_joints: number[][];
    skin_joints: number[][];
    skin_weights: number[][];
  };
}

export type StreamEntry = { file: string } & ({ topology: TopologyNumbers } | { frame: FrameNumbers });

export function streamEntries(): StreamEntry[] {
  return readJson("stream/stream.json") as StreamEntry[];
}

export function malformedEntries(): { file: string; code: string }[] {
  return readJson("malformed/malformed.json") as { file: string; code: string }[];
}
