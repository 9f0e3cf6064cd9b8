"""Trackers that watch our own body: what each convention would send of a motion, in its own joints and axes."""

from __future__ import annotations

import numpy as np

from tryon_solver.body import BodyModel, Motion, Pose, quaternions
from tryon_solver.body.feet import world_tracks
from tryon_solver.body.tracking import Sample, SourceSkeleton, Tracker
from tryon_solver.body.tracking.conventions import (
    MEDIAPIPE_SIDED,
    SMPL_JOINTS,
    SMPL_MIDDLE,
    SMPL_PARENTS,
    SMPL_SIDED,
    WEBXR_MIDDLE,
    WEBXR_SIDED,
    sided,
)

OTHERS = {"waist": "spine_3", "chest": "spine_5"}  # parts that are not named as one of our joints
KNUCKLES = ("index", "little")


class Watched:
    """Our body in a motion, as (T, K) arrays of a convention's joints."""

    def __init__(self, body: BodyModel, motion: Motion, table: dict[str, str]) -> None:
        table = {part: joint for part, joint in table.items() if not part.endswith(KNUCKLES)}
        self.ours = [body.index_of[OTHERS.get(part, part)] for part in table]
        self.names = tuple(table.values())
        self.places, self.turns = world_tracks(body, motion)
        self.positions, self.rotations = self.places[:, self.ours], self.turns[:, self.ours]
        self.rest = body.rest_joints[self.ours]
        self.seen = np.ones(len(self.names), dtype=bool)

    def samples(self, rotations: np.ndarray | None) -> list[Sample]:
        return [
            Sample(None, self.positions[t], None if rotations is None else rotations[t], self.seen)
            for t in range(len(self.positions))
        ]


def webxr(body: BodyModel, motion: Motion, seed: int) -> tuple[SourceSkeleton, list[Sample]]:
    """Joints whose axes at rest point anywhere, as `seed` has it: 0 for axes along the world's."""
    watched = Watched(body, motion, sided(WEBXR_SIDED) | WEBXR_MIDDLE)
    rng = np.random.default_rng(seed)
    axes = quaternions.normalise(rng.normal(size=(len(watched.names), 4)))
    if seed == 0:
        axes[:] = quaternions.IDENTITY
    skeleton = SourceSkeleton("webxr", "session", watched.names, rest_positions=watched.rest, rest_rotations=axes)
    return skeleton, watched.samples(quaternions.multiply(watched.rotations, axes))


def mediapipe(body: BodyModel, motion: Motion, image: bool) -> tuple[SourceSkeleton, list[Sample]]:
    """Points alone; with `image` relative to the hips, in the axes of the image."""
    watched = Watched(body, motion, sided(MEDIAPIPE_SIDED))
    if image:
        hips = [watched.names.index(f"{side}_hip") for side in ("left", "right")]
        watched.positions = watched.positions - watched.positions[:, hips].mean(axis=1, keepdims=True)
        watched.positions = watched.positions * [1.0, -1.0, -1.0]
    skeleton = SourceSkeleton("mediapipe", "mediapipe-world" if image else "session", watched.names)
    return skeleton, watched.samples(None)


def smpl(body: BodyModel, motion: Motion) -> tuple[SourceSkeleton, list[Sample]]:
    """Local rotations of 24 joints that rest where ours do."""
    parts = {joint: part for part, joint in (sided(SMPL_SIDED) | SMPL_MIDDLE).items()}
    parts |= {"spine1": "spine_2", "spine2": "spine_3", "neck": "neck_1"}
    parts |= {f"{side}_hand": f"{side}_fingers" for side in ("left", "right")}
    ours = [body.index_of[OTHERS.get(parts[joint], parts[joint])] for joint in SMPL_JOINTS]
    places, turns = world_tracks(body, motion)
    world = turns[:, ours]
    local = world.copy()
    for joint, parent in enumerate(SMPL_PARENTS[1:], start=1):
        local[:, joint] = quaternions.multiply(quaternions.conjugate(world[:, parent]), world[:, joint])
    skeleton = SourceSkeleton("smpl", "session", SMPL_JOINTS, rest_positions=body.rest_joints[ours])
    seen = np.ones(len(SMPL_JOINTS), dtype=bool)
    return skeleton, [Sample(places[t, ours[0]], None, local[t], seen) for t in range(len(local))]


def followed(body: BodyModel, skeleton: SourceSkeleton, samples: list[Sample]) -> Motion:
    """What our body does when it follows these samples."""
    tracker = Tracker(body, skeleton)
    poses: list[Pose] = [tracker.pose(sample) for sample in samples]
    roots, rotations = np.array([pose.root for pose in poses]), np.array([pose.rotations for pose in poses])
    return Motion(roots, rotations, 1 / 60)
