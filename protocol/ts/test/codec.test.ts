import assert from "node:assert/strict";
import { test } from "node:test";

import { FrameDecoder, GRID, ProtocolError, decodeMessage, isFrame, isTopologyMessage, readTopology } from "../src/index.ts";
import type { DecodedFrame, Topology } from "../src/index.ts";
import { malformedEntries, readBytes, streamEntries } from "./vectors.ts";
import type { FrameNumbers, TopologyNumbers } from "./vectors.ts";
import { loadInflate } from "./zstd.ts";

const BODY_TOLERANCE = 1e-5; // m, PROTOCOL.md section 8
const inflate = await loadInflate();

function topologyFrom(bytes: Uint8Array): Topology {
  const message = decodeMessage(bytes);
  assert.ok(message !== null && isTopologyMessage(message));
  return readTopology(message, inflate);
}

function assertTopology(topology: Topology, expected: TopologyNumbers): void {
  const { body } = topology;
  assert.equal(topology.topologyId, expected.topology_id);
  assert.equal(topology.grid, expected.grid);
  assert.equal(topology.clothVertexCount, expected.cloth_vertex_count);
  assert.deepEqual([...topology.faces], expected.faces.flat());
  assert.deepEqual([...(topology.uv ?? [])], expected.uv.flat(2));
  assert.deepEqual([...(topology.panelOfFace ?? [])], expected.panel_of_face);
  assert.deepEqual(topology.panelNames, expected.panel_names);
  assert.deepEqual([...body.restVertices], expected.body.rest_vertices.flat());
  assert.deepEqual([...body.faces], expected.body.faces.flat());
  assert.deepEqual(body.jointNames, expected.body.joint_names);
  assert.deepEqual([...body.parents], expected.body.parents);
  assert.deepEqual([...body.restJoints], expected.body.rest_joints.flat());
  assert.deepEqual([...body.skinJoints], expected.body.skin_joints.flat());
  assert.deepEqual([...body.skinWeights], expected.body.skin_weights.flat());
}

function assertFrame(frame: DecodedFrame, expected: FrameNumbers, anchor: readonly number[]): void {
  assert.equal(frame.seq, expected.seq);
  assert.equal(frame.poseSeq, expected.pose_seq);
  assert.equal(frame.topologyId, expected.topology_id);
  assert.equal(frame.tSim, expected.t_sim);
  assert.equal(frame.tPublished, expected.t_published);
  assert.equal(frame.standsAlone, expected.stands_alone);
  assert.equal(frame.offsetCount, expected.offset_count);
  assert.deepEqual([...frame.root], expected.root);
  assert.deepEqual([...frame.rotations], expected.rotations.flat());
  assert.deepEqual([...frame.clothUnits], expected.cloth_units.flat());
  const cloth = expected.cloth_units.flat().map((unit, at) => Math.fround(GRID * unit - anchor[at % 3]));
  assert.deepEqual([...frame.cloth], cloth);
  const body = expected.body.flat();
  assert.equal(frame.body.length, body.length);
  const worst = Math.max(...body.map((place, at) => Math.abs(place - anchor[at % 3] - frame.body[at])));
  assert.ok(worst <= BODY_TOLERANCE, `a body vertex is off by ${worst} m`);
}

test("the golden stream decodes to its numbers", () => {
  // Far from the session's origin float32 can't hold 1e-5 m: there an anchor near the body must serve.
  const decoders = [[0, 0, 0], [0.5, 1, 7000]].map((anchor) => ({ anchor, decoder: new FrameDecoder(inflate, anchor) }));
  for (const entry of streamEntries()) {
    const bytes = readBytes(`stream/${entry.file}`);
    assert.equal(isFrame(bytes), "frame" in entry);
    for (const { anchor, decoder } of decoders) {
      if ("topology" in entry) {
        const topology = topologyFrom(bytes);
        assertTopology(topology, entry.topology);
        decoder.setTopology(topology);
      } else {
        const frame = decoder.decode(bytes);
        if (Math.abs(entry.frame.root[2] - anchor[2]) < 100) assertFrame(frame, entry.frame, anchor);
        assert.equal(decoder.lastSeq, entry.frame.seq);
      }
    }
  }
});

test("an anchor that follows the root keeps every frame of the golden stream precise", () => {
  const decoder = new FrameDecoder(inflate, "follow");
  const anchors = new Set<string>();
  for (const entry of streamEntries()) {
    const bytes = readBytes(`stream/${entry.file}`);
    if ("topology" in entry) {
      decoder.setTopology(topologyFrom(bytes));
      continue;
    }
    const frame = decoder.decode(bytes);
    assertFrame(frame, entry.frame, [...frame.anchor]);
    entry.frame.root.forEach((place, axis) => assert.ok(Math.abs(place - frame.anchor[axis]) <= 8));
    assert.ok(frame.anchor.every(Number.isInteger));
    anchors.add(frame.anchor.join());
  }
  assert.ok(anchors.has("0,0,0"), "near the session's origin nothing is moved");
  assert.ok(anchors.size > 1);
});

test("frames at an odd place in a larger buffer decode alike", () => {
  const decoder = new FrameDecoder(inflate);
  decoder.setTopology(topologyFrom(readBytes("stream/00_topology.bin")));
  const bytes = readBytes("stream/01_key.bin");
  const buffer = new Uint8Array(bytes.length + 3);
  buffer.set(bytes, 3);
  const [, first] = streamEntries();
  assert.ok("frame" in first);
  assertFrame(decoder.decode(buffer.subarray(3)), first.frame, [0, 0, 0]);
});

test("decoding allocates no arrays of its own", () => {
  const decoder = new FrameDecoder(inflate);
  decoder.setTopology(topologyFrom(readBytes("stream/00_topology.bin")));
  const one = decoder.decode(readBytes("stream/01_key.bin"));
  const { cloth, body, root, rotations } = one;
  const two = decoder.decode(readBytes("stream/02_delta1.bin"));
  assert.equal(two, one);
  assert.deepEqual(
    [two.cloth === cloth, two.body === body, two.root === root, two.rotations === rotations],
    [true, true, true, true],
  );
});

for (const { file, code } of malformedEntries()) {
  test(`${file} is refused with ${code}, and the stream goes on`, () => {
    const decoder = new FrameDecoder(inflate);
    decoder.setTopology(topologyFrom(readBytes("stream/00_topology.bin")));
    const refused = (): DecodedFrame => decoder.decode(readBytes(`malformed/${file}`));
    assert.throws(refused, (error) => error instanceof ProtocolError && error.code === code && error.place !== "");
    decoder.decode(readBytes("stream/01_key.bin"));
    const before = structuredClone(decoder.decode(readBytes("stream/02_delta1.bin")));
    if (code !== "missing_base") assert.throws(refused, ProtocolError);
    const after = decoder.decode(readBytes("stream/03_delta2.bin"));
    assert.equal(before.seq, 2);
    const third = streamEntries()[3];
    assert.ok("frame" in third);
    assertFrame(after, third.frame, [0, 0, 0]);
  });
}

test("a difference without its base, or a second time, is refused", () => {
  const decoder = new FrameDecoder(inflate);
  const decode = (name: string) => () => decoder.decode(readBytes(`stream/${name}.bin`));
  const withCode = (code: string) => (error: unknown) => error instanceof ProtocolError && error.code === code;
  assert.throws(decode("01_key"), withCode("unknown_topology"));
  decoder.setTopology(topologyFrom(readBytes("stream/00_topology.bin")));
  decode("01_key")();
  assert.throws(decode("03_delta2"), withCode("missing_base"));
  decode("02_delta1")();
  assert.throws(decode("02_delta1"), withCode("stale_frame"));
  decode("09_key_standalone")();
  assert.throws(decode("13_key"), withCode("unknown_topology"));
});

test("a topology whose arrays don't fit is refused", () => {
  const message = decodeMessage(readBytes("messages/server_topology.bin"));
  assert.ok(message !== null && isTopologyMessage(message));
  const { cloth, body } = message;
  const { parents } = body;
  for (const wrong of [
    { ...message, cloth: { ...cloth, faces: { ...cloth.faces, dtype: "int32" as const } } },
    { ...message, cloth: { ...cloth, faces: { ...cloth.faces, data: cloth.faces.data.subarray(4) } } },
    { ...message, cloth: { ...cloth, vertex_count: 5 } },
    { ...message, body: { ...body, rest_joints: { ...body.rest_joints, shape: [4, 3] } } },
    { ...message, body: { ...body, parents: { ...parents, data: parents.data.slice().fill(0) } } },
  ]) {
    assert.throws(
      () => readTopology(wrong, inflate),
      (error) => error instanceof ProtocolError && error.code === "invalid_array",
    );
  }
});
