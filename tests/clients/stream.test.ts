import assert from "node:assert/strict";
import { test } from "node:test";

import { ZSTDDecoder } from "zstddec";

import { GarmentScene } from "../../clients/core/src/garment_scene.ts";
import { Stream } from "../../clients/core/src/stream.ts";
import type { ToPage } from "../../clients/core/src/worker_messages.ts";
import { readBytes, streamEntries, type FrameNumbers } from "../../protocol/ts/test/vectors.ts";
import { FakeSurroundings, welcome } from "./support/surroundings.ts";

const GRID = 6.25e-5;

const zstd = new ZSTDDecoder();
await zstd.init();

interface Parts {
  readonly around: FakeSurroundings;
  readonly stream: Stream;
  readonly posted: ToPage[];
  readonly scene: GarmentScene;
}

/** A stream on a fake socket and the scene that its messages feed, welcomed. */
function watch(): Parts {
  const around = new FakeSurroundings();
  const posted: ToPage[] = [];
  const scene = new GarmentScene((buffer) => stream.recycle(buffer));
  const stream: Stream = new Stream(
    around,
    (data, size) => zstd.decode(data, size),
    (message, transfer) => {
      posted.push(message);
      assert.equal(transfer.length, message.kind === "frame" ? 1 : 0);
      if (message.kind === "topology") scene.setTopology(message);
      if (message.kind === "frame") scene.offer(message.buffer, message.figures);
    },
  );
  stream.open();
  around.socket.onopen?.();
  around.socket.say(welcome());
  return { around, stream, posted, scene };
}

function assertShows({ scene }: Parts, expected: FrameNumbers, uvCorners: number[]): void {
  const { cloth, body, figures } = scene;
  assert.ok(cloth && body && figures);
  assert.equal(figures.seq, expected.seq);
  assert.equal(figures.simulatedMs, expected.t_sim * 1000);
  assert.equal(figures.keyframe, expected.stands_alone);
  assert.deepEqual(figures.root, expected.root);
  const drawn = [...cloth.index];
  assert.deepEqual(drawn.flatMap((vertex) => [cloth.uv[2 * vertex], cloth.uv[2 * vertex + 1]]), uvCorners);
  const { anchor } = figures;
  expected.body.flat().forEach((place, i) => assert.ok(Math.abs(body.positions[i] + anchor[i % 3] - place) <= 1e-5));
  for (const shape of [cloth, body]) {
    for (let i = 0; i < shape.normals.length; i += 3) {
      const length = Math.hypot(shape.normals[i], shape.normals[i + 1], shape.normals[i + 2]);
      assert.ok(Math.abs(length - 1) < 1e-5, `normal ${i / 3} has length ${length}`);
    }
  }
}

test("the golden stream arrives in the scene with its numbers, and every frame is acknowledged", () => {
  const parts = watch();
  const { around, scene } = parts;
  let corners: number[] = [];
  let faces: number[] = [];
  const seqs: number[] = [];
  for (const entry of streamEntries()) {
    around.socket.deliver(readBytes(`stream/${entry.file}`));
    if ("topology" in entry) {
      corners = entry.topology.uv.flat(2);
      faces = entry.topology.faces.flat();
      assert.equal(scene.vertexCount, entry.topology.cloth_vertex_count);
      assert.equal(scene.take(), false, "no frame of the new topology has come yet");
      continue;
    }
    seqs.push(entry.frame.seq);
    assert.equal(scene.take(), true);
    assertShows(parts, entry.frame, corners);
    const { cloth } = scene;
    assert.ok(cloth);
    faces.forEach((vertex, corner) => {
      for (let axis = 0; axis < 3; axis += 1) {
        const place = Math.fround(GRID * entry.frame.cloth_units[vertex][axis] - scene.figures!.anchor[axis]);
        assert.equal(cloth.positions[3 * cloth.index[corner] + axis], place);
      }
    });
  }
  const acks = around.socket.sent.filter((message) => message.type === "ack").map(({ seq }) => seq);
  assert.deepEqual(acks, seqs);
  assert.ok(seqs.length > 3);
});

test("of frames that come between two pictures the newest is shown", () => {
  const { around, scene } = watch();
  for (const name of ["00_topology", "01_key", "02_delta1", "03_delta2"]) around.socket.deliver(readBytes(`stream/${name}.bin`));
  const before = scene.frameVersion;
  assert.equal(scene.take(), true);
  assert.equal(scene.figures?.seq, 3);
  assert.equal(scene.frameVersion, before + 1);
  assert.equal(scene.take(), false);
});

test("vertex arrays and buffers are used again, not allocated per frame", () => {
  const { around, scene, posted } = watch();
  around.socket.deliver(readBytes("stream/00_topology.bin"));
  const arrays = new Set<unknown>();
  const buffers = new Set<unknown>();
  for (const name of ["01_key", "02_delta1", "03_delta2"]) {
    around.socket.deliver(readBytes(`stream/${name}.bin`));
    scene.take();
    arrays.add(scene.cloth?.positions).add(scene.cloth?.normals).add(scene.body?.positions).add(scene.body?.normals);
    const last = posted[posted.length - 1];
    assert.ok(last.kind === "frame");
    buffers.add(last.buffer);
  }
  assert.equal(arrays.size, 4);
  assert.equal(buffers.size, 1);
});

test("a difference whose base is not here asks for a keyframe and shows nothing", () => {
  const { around, scene } = watch();
  around.socket.deliver(readBytes("stream/00_topology.bin"));
  around.socket.deliver(readBytes("stream/02_delta1.bin"));
  assert.equal(scene.take(), false);
  assert.deepEqual(around.socket.types().slice(-1), ["keyframe_request"]);
  around.socket.deliver(readBytes("stream/01_key.bin"));
  assert.equal(scene.take(), true);
});

test("after a reconnection numbers may begin anew", () => {
  const { around, scene } = watch();
  for (const name of ["00_topology", "01_key", "02_delta1"]) around.socket.deliver(readBytes(`stream/${name}.bin`));
  around.socket.onclose?.({ code: 1006, reason: "" });
  around.wait(1_000);
  around.socket.onopen?.();
  around.socket.say(welcome({ epoch: "e2", clock: 1 }));
  for (const name of ["00_topology", "01_key"]) around.socket.deliver(readBytes(`stream/${name}.bin`));
  assert.equal(scene.take(), true);
  assert.equal(scene.figures?.seq, 1);
});

test("a frame's age is measured on our clock", () => {
  const { around, scene } = watch();
  const published = (streamEntries()[1] as unknown as { frame: FrameNumbers }).frame.t_published;
  around.socket.say({ type: "pong", t: around.now() / 1000, clock: published });
  around.wait(40);
  for (const name of ["00_topology", "01_key"]) around.socket.deliver(readBytes(`stream/${name}.bin`));
  scene.take();
  assert.ok(scene.figures);
  assert.ok(Math.abs(around.now() - scene.figures.publishedMs - 40) < 1e-6);
});

test("malformed bytes end the connection instead of being shown", () => {
  const { around, scene, posted } = watch();
  around.socket.deliver(readBytes("stream/00_topology.bin"));
  around.socket.deliver(readBytes("malformed/raw_cut.bin"));
  assert.equal(scene.take(), false);
  const last = posted[posted.length - 1];
  assert.ok(last.kind === "link" && last.link.state === "reconnecting");
});

test("the pattern and the answers to its edits are handed on, edits are sent", () => {
  const { around, stream, posted } = watch();
  for (const name of ["design", "edited"]) around.socket.deliver(readBytes(`messages/server_${name}.bin`));
  assert.deepEqual(posted.slice(-2).map(({ kind }) => kind), ["design", "edited"]);
  stream.send({ type: "undo", request: 7 });
  assert.deepEqual(around.socket.sent.at(-1), { type: "undo", request: 7 });
});
