import assert from "node:assert/strict";
import { test } from "node:test";

import { Wearer, type TrackedFrame } from "@tryon/core";
import type { PoseMessage, SkeletonMessage } from "@tryon/protocol";

type Place = readonly [number, number, number];
const UPRIGHT = { x: 0, y: 0, z: 0, w: 1 };
const MUST = ["hips", ...["left", "right"].flatMap((side) => ["arm-upper", "arm-lower", "hand-wrist"].map((part) => `${side}-${part}`))];

/** A frame whose spaces are names; a place is missing where the tracker has lost it. */
function frameOf(places: Record<string, Place>, body: readonly string[] | null, turn = UPRIGHT): TrackedFrame<string> {
  const posed = (name: string) => {
    const place = places[name] as Place | undefined;
    return place && { transform: { position: { x: place[0], y: place[1], z: place[2] }, orientation: turn } };
  };
  return {
    body: body && new Map(body.map((name) => [name, name])),
    getPose: (space) => posed(space),
    getViewerPose: () => posed("viewer"),
  };
}

function bodyFrame(without: readonly string[] = []): TrackedFrame<string> {
  const places = Object.fromEntries([...MUST, "viewer"].filter((name) => !without.includes(name)).map((name, k) => [name, [k, 1, 0] as const]));
  return frameOf(places, MUST);
}

const poseIn = (messages: readonly unknown[]) => messages.at(-1) as PoseMessage;

test("a tracked body is announced once and then sent joint by joint", () => {
  const wearer = new Wearer<string>("wearer");
  const [skeleton, pose] = wearer.read(bodyFrame(), [], "floor", 3.5) as [SkeletonMessage, PoseMessage];
  assert.equal(skeleton.type, "skeleton");
  assert.equal(skeleton.convention, "webxr");
  assert.equal(wearer.tracking, "body");
  assert.deepEqual([pose.type, pose.convention, pose.frame, pose.clock, pose.t, pose.seq], ["pose", "webxr", "session", "sender", 3.5, 1]);
  for (const name of [...MUST, "viewer"]) assert.ok(skeleton.joint_names.includes(name), name);
  assert.equal(pose.positions?.length, skeleton.joint_names.length);
  assert.deepEqual(pose.positions[skeleton.joint_names.indexOf("hips")], [0, 1, 0]);
  const again = wearer.read(bodyFrame(), [], "floor", 3.6);
  assert.equal(again.length, 1);
  assert.equal(poseIn(again).seq, 2);
});

test("a joint that is lost has no confidence, and nothing of it is a number that counts", () => {
  const wearer = new Wearer<string>("wearer");
  const [skeleton] = wearer.read(bodyFrame(), [], "floor", 0.9) as [SkeletonMessage, PoseMessage];
  const [pose] = wearer.read(bodyFrame(["left-hand-wrist"]), [], "floor", 1) as [PoseMessage];
  const lost = skeleton.joint_names.indexOf("left-hand-wrist");
  assert.equal(pose.confidence?.[lost], 0);
  assert.equal(pose.confidence[skeleton.joint_names.indexOf("hips")], 1);
  assert.deepEqual(pose.positions?.[lost], [0, 0, 0]);
});

test("without a body head and hands are sent, and a body that appears is announced", () => {
  const wearer = new Wearer<string>("wearer");
  const hands = [{ handedness: "left", hand: { get: (joint: string) => (joint === "wrist" ? "w" : undefined) } }];
  const [skeleton, pose] = wearer.read(frameOf({ viewer: [0, 1.6, 0], w: [0.2, 1, -0.3] }, null), hands, "floor", 1) as [SkeletonMessage, PoseMessage];
  assert.equal(wearer.tracking, "head and hands");
  assert.deepEqual([skeleton.convention, pose.convention], ["head-hands", "head-hands"]);
  assert.deepEqual(pose.confidence, [1, 1, 0]);
  assert.deepEqual(pose.positions?.[1], [0.2, 1, -0.3]);
  const later = wearer.read(bodyFrame(), [], "floor", 2);
  assert.deepEqual(later.map(({ type }) => type), ["skeleton", "pose"]);
  assert.equal(poseIn(later).seq, 2);
});

test("a hand around a controller has its back outward: +X of a right grip, -X of a left one, becomes +Y", () => {
  for (const [handedness, outward] of [["right", 1], ["left", -1]] as const) {
    const wearer = new Wearer<string>("wearer");
    const frame = frameOf({ viewer: [0, 1.6, 0], grip: [0, 1, 0] }, null);
    const pose = poseIn(wearer.read(frame, [{ handedness, gripSpace: "grip" }], "floor", 1));
    const [x, y, z, w] = pose.rotations![handedness === "left" ? 1 : 2];
    const back = [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)]; // column Y of the rotation
    assert.ok(Math.abs(back[0] - outward) < 1e-12 && Math.abs(back[1]) < 1e-12 && Math.abs(back[2]) < 1e-12, String(back));
  }
});

test("a body that lacks a joint which must be seen once is head and hands till it is seen, and again after a silence", () => {
  const wearer = new Wearer<string>("wearer");
  const lacking = bodyFrame(["left-hand-wrist"]);
  const sent = (frame: TrackedFrame<string>, t: number) => wearer.read(frame, [], "floor", t).map((message) => `${message.type} ${message.convention}`);
  assert.deepEqual(sent(lacking, 1), ["skeleton head-hands", "pose head-hands"]);
  assert.equal(wearer.tracking, "head and hands");
  assert.deepEqual(sent(bodyFrame(), 1.02), ["skeleton webxr", "pose webxr"]);
  assert.deepEqual(sent(lacking, 1.04), ["pose webxr"]);
  assert.equal(wearer.tracking, "body");
  assert.deepEqual(sent(lacking, 1.54), ["skeleton head-hands", "pose head-hands"]);
  assert.deepEqual(sent(bodyFrame(["hips"]), 1.56), ["pose head-hands"]);
});

test("a place that is guessed is none: of a hand that hand is not seen, of the head nothing is", () => {
  const wearer = new Wearer<string>("wearer");
  const guessed = (name: string, frame: TrackedFrame<string>): TrackedFrame<string> => {
    const marked = (space: string) => {
      const posed = frame.getPose(space, "floor");
      return posed && { ...posed, emulatedPosition: space === name };
    };
    return { ...frame, getPose: marked, getViewerPose: () => marked("viewer") };
  };
  const frame = frameOf({ viewer: [0, 1.6, 0], wrist: [0.2, 1, 0], grip: [0.3, 1, 0] }, null);
  const hands = [
    { handedness: "left", hand: { get: () => "wrist" } },
    { handedness: "right", gripSpace: "grip" },
  ];
  for (const [name, confidence] of [["nobody's", [1, 1, 1]], ["wrist", [1, 0, 1]], ["grip", [1, 1, 0]]] as const) {
    assert.deepEqual(poseIn(wearer.read(guessed(name, frame), hands, "floor", 1)).confidence, confidence);
  }
  assert.deepEqual(wearer.read(guessed("viewer", frame), hands, "floor", 2), []);
  assert.deepEqual(wearer.read(guessed("viewer", bodyFrame()), hands, "floor", 2), []);
  assert.equal(wearer.tracking, "nothing");
});

test("the wrist of a hand around a controller is where a Quest's own hand has it beside its grip", () => {
  // of IWER's hands (configs/hand/relaxed, left): the grip's and the wrist's axes and places
  const grip = { x: [-0.00053, -0.86486, -0.50201], y: [-0.27411, -0.48265, 0.83181], z: [-0.9617, 0.13805, -0.23681], at: [-0.02879, 0.00171, 0.04537] };
  const wrist = { x: [0.9617, -0.13805, 0.23681], y: [0.00053, 0.86486, 0.50201], z: [-0.27411, -0.48265, 0.83181], at: [-0.04914, 0.00215, 0.11702] };
  const [x, y, z] = grip.at;
  const held = { transform: { position: { x, y, z }, orientation: quaternionOf(grip) } };
  const frame: TrackedFrame<string> = { body: null, getPose: () => held, getViewerPose: () => held };
  const pose = poseIn(new Wearer<string>("wearer").read(frame, [{ handedness: "left", gripSpace: "grip" }], "floor", 1));
  const turn = quaternionOf(wrist);
  const [a, b, c, d] = pose.rotations![1];
  assert.ok(Math.abs(a * turn.x + b * turn.y + c * turn.z + d * turn.w) > 0.9999, String(pose.rotations![1]));
  const off = Math.hypot(...pose.positions![1].map((value, axis) => value - wrist.at[axis]));
  assert.ok(off < 0.005, `${off} m`);
});

/** Of axes that are a rotation's columns. */
function quaternionOf({ x, y, z }: { x: number[]; y: number[]; z: number[] }) {
  const w = 0.5 * Math.sqrt(Math.max(1 + x[0] + y[1] + z[2], 0));
  const k = 0.25 / w;
  return { x: k * (y[2] - z[1]), y: k * (z[0] - x[2]), z: k * (x[1] - y[0]), w };
}

test("nothing is sent while nothing is tracked", () => {
  const wearer = new Wearer<string>("wearer");
  assert.deepEqual(wearer.read(frameOf({}, null), [], "floor", 1), []);
  assert.equal(wearer.tracking, "nothing");
});
