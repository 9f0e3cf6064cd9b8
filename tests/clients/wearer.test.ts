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
  const [skeleton, pose] = wearer.read(bodyFrame(["left-hand-wrist"]), [], "floor", 1) as [SkeletonMessage, PoseMessage];
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

test("nothing is sent while nothing is tracked", () => {
  const wearer = new Wearer<string>("wearer");
  assert.deepEqual(wearer.read(frameOf({}, null), [], "floor", 1), []);
  assert.equal(wearer.tracking, "nothing");
});
