"""The conventions of trackers: which of their joints is which part of ours, and how their numbers are read.

Sources of the tables: WebXR Body Tracking Level 1 (joint names) and WebXR Hand Input Level 1 (axes of a wrist: -Z along
the fingers, +Y out of the back of the hand); MediaPipe Pose's 33 landmarks; the 24 joints of XR_BD_body_tracking, which
are SMPL's. A BVH skeleton's joints are found by skeletons.py. `{side}` is left and right.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.model import BodyModel
from tryon_solver.body.skeletons import RetargetError, find_parts
from tryon_solver.body.tracking.frames import frame, matrix_to_quaternion
from tryon_solver.body.tracking.observation import SIDES, Observation, Sample, SourceSkeleton, TrackingError
from tryon_solver.body.tracking.stature import Stature, average_place
from tryon_solver.body.trunk_line import trunk_correction

Reader = Callable[[Sample], Observation]

HALF_TURN = np.array([0.0, 1.0, 0.0, 0.0])  # a viewer looks along -Z, our body at rest along +Z
IMAGE_FRAME = "mediapipe-world"  # x to the image's right, y down, z away from the camera

WEBXR_SIDED = {
    "{side}_clavicle": "{side}-shoulder",
    "{side}_upper_arm": "{side}-arm-upper",
    "{side}_forearm": "{side}-arm-lower",
    "{side}_hand": "{side}-hand-wrist",
    "{side}_index": "{side}-hand-index-phalanx-proximal",
    "{side}_little": "{side}-hand-little-phalanx-proximal",
    "{side}_thigh": "{side}-upper-leg",
    "{side}_shin": "{side}-lower-leg",
    "{side}_foot": "{side}-foot-ankle",
    "{side}_toes": "{side}-foot-ball",
}
WEBXR_MIDDLE = {"pelvis": "hips", "waist": "spine-middle", "chest": "chest", "head": "head"}
VIEWER = "viewer"
TURNS_ONLY = ("chest", "left_clavicle", "right_clavicle")

MEDIAPIPE_SIDED = {
    "{side}_upper_arm": "{side}_shoulder",
    "{side}_forearm": "{side}_elbow",
    "{side}_hand": "{side}_wrist",
    "{side}_index": "{side}_index",
    "{side}_little": "{side}_pinky",
    "{side}_thigh": "{side}_hip",
    "{side}_shin": "{side}_knee",
    "{side}_foot": "{side}_ankle",
    "{side}_toes": "{side}_foot_index",
}
STRAIGHT = 0.7  # cosine of the angle by which a rest pose may be off the axes
NOSE_FROM_EARS = np.array([0.0, -0.02, 0.1])  # m, of a head that looks ahead, from the middle between the ears

SMPL_SIDED = {
    "{side}_clavicle": "{side}_collar",
    "{side}_upper_arm": "{side}_shoulder",
    "{side}_forearm": "{side}_elbow",
    "{side}_hand": "{side}_wrist",
    "{side}_thigh": "{side}_hip",
    "{side}_shin": "{side}_knee",
    "{side}_foot": "{side}_ankle",
    "{side}_toes": "{side}_foot",
}
SMPL_MIDDLE = {"pelvis": "pelvis", "chest": "spine3", "head": "head"}
# The parent of each of SMPL's 24 joints, in SMPL's order.
SMPL_JOINTS = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle",
    "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head", "left_shoulder",
    "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hand", "right_hand",
)  # fmt: skip
SMPL_PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21)


def read_with(skeleton: SourceSkeleton, model: BodyModel) -> Reader:
    """What brings this tracker's poses to the parts of `model`. Raises TrackingError naming what it lacks."""
    reader = READERS.get(skeleton.convention)
    if reader is None:
        raise TrackingError(f"the convention {skeleton.convention!r} is not known; use {', '.join(READERS)}")
    return reader(skeleton, model)


def sided(table: Mapping[str, str]) -> dict[str, str]:
    """A table for both sides."""
    return {part.format(side=side): joint.format(side=side) for side in SIDES for part, joint in table.items()}


def _present(table: Mapping[str, str], names: Sequence[str]) -> dict[str, int]:
    index = {name: k for k, name in enumerate(names)}
    return {part: index[joint] for part, joint in table.items() if joint in index}


def _webxr(skeleton: SourceSkeleton, _model: BodyModel) -> Reader:
    """World positions and rotations. Where the limbs are comes from the positions; rotations count as changes from the
    rest pose the tracker told, and without one only where their axes are laid down: the viewer's and the wrists'."""
    joints = _present(sided(WEBXR_SIDED) | WEBXR_MIDDLE, skeleton.joint_names)
    viewer = _present({VIEWER: VIEWER}, skeleton.joint_names).get(VIEWER)
    axes_at_rest = skeleton.rest_rotations
    rest = _points(joints, skeleton.rest_positions) if skeleton.rest_positions is not None else None
    if rest is not None:
        refuse_crooked_rest(rest)
    knuckles = {f"{side}_{finger}" for side in SIDES for finger in ("index", "little")}
    turning = {part: joint for part, joint in joints.items() if part not in knuckles and part != "waist"}

    def read(sample: Sample) -> Observation:
        assert sample.positions is not None
        assert sample.rotations is not None
        seen = {part: joint for part, joint in joints.items() if sample.tracked[joint]}
        for part in TURNS_ONLY:
            seen.pop(part, None)
        observation = Observation(points=_points(seen, sample.positions), rest=rest)
        if axes_at_rest is not None:
            parts = [part for part, joint in turning.items() if sample.tracked[joint]]
            places = [turning[part] for part in parts]
            turns = quaternions.multiply(sample.rotations[places], quaternions.conjugate(axes_at_rest[places]))
            observation.turns = dict(zip(parts, turns))
        else:
            _read_wrists(observation, joints, sample)
        if viewer is not None and sample.tracked[viewer]:
            turn = quaternions.multiply(sample.rotations[viewer], quaternions.conjugate(HALF_TURN))
            observation.turns.setdefault("head", turn)
        return observation

    return read


def _read_wrists(observation: Observation, joints: Mapping[str, int], sample: Sample) -> None:
    """Palms by the wrists' axes, where no knuckles tell better."""
    assert sample.rotations is not None
    for side in SIDES:
        wrist = joints.get(f"{side}_hand")
        if wrist is None or not sample.tracked[wrist] or f"{side}_index" in observation.points:
            continue
        axes = quaternions.to_matrix(sample.rotations[wrist])
        observation.palms[side] = (-axes[:, 2], axes[:, 1])


def _head_hands(skeleton: SourceSkeleton, _model: BodyModel) -> Reader:
    """The viewer and what there is of two wrists; the rest is left to inverse kinematics (standing.py)."""
    joints = _present({f"{side}_hand": f"{side}-hand-wrist" for side in SIDES}, skeleton.joint_names)
    viewer = _present({VIEWER: VIEWER}, skeleton.joint_names)[VIEWER]

    def read(sample: Sample) -> Observation:
        assert sample.positions is not None
        assert sample.rotations is not None
        seen = {part: joint for part, joint in joints.items() if sample.tracked[joint]}
        observation = Observation(points=_points({**seen, "eyes": viewer}, sample.positions))
        turn = quaternions.multiply(sample.rotations[viewer], quaternions.conjugate(HALF_TURN))
        observation.turns["head"] = turn
        _read_wrists(observation, seen, sample)
        return observation

    return read


def _mediapipe(skeleton: SourceSkeleton, _model: BodyModel) -> Reader:
    """World positions alone."""
    joints = _present(sided(MEDIAPIPE_SIDED), skeleton.joint_names)
    face = _present({"nose": "nose", "left": "left_ear", "right": "right_ear"}, skeleton.joint_names)
    image = skeleton.frame == IMAGE_FRAME
    face_at_rest = frame(np.array([1.0, 0.0, 0.0]), NOSE_FROM_EARS)

    def read(sample: Sample) -> Observation:
        assert sample.positions is not None
        positions = sample.positions * [1.0, -1.0, -1.0] if image else sample.positions
        seen = {part: joint for part, joint in joints.items() if sample.tracked[joint]}
        observation = Observation(points=_points(seen, positions), afloat=image)
        if len(face) == 3 and sample.tracked[list(face.values())].all():
            nose, left, right = (positions[face[name]] for name in ("nose", "left", "right"))
            now = frame(left - right, nose - 0.5 * (left + right))
            if now is not None and face_at_rest is not None:
                observation.turns["head"] = matrix_to_quaternion(now @ face_at_rest.T)
        return observation

    return read


def _smpl(skeleton: SourceSkeleton, model: BodyModel) -> Reader:
    parents = dict(zip(SMPL_JOINTS, SMPL_PARENTS))
    order = {name: k for k, name in enumerate(skeleton.joint_names)}
    places = tuple(-1 if parents[name] < 0 else order[SMPL_JOINTS[parents[name]]] for name in skeleton.joint_names)
    rest = skeleton.rest_positions
    joints = _present(sided(SMPL_SIDED) | SMPL_MIDDLE, skeleton.joint_names)
    if rest is not None:
        refuse_crooked_rest(_points(joints, rest))
        return _local(joints, places, rest, model)
    rest = np.array([average_place(name) for name in skeleton.joint_names])
    return _local(joints, places, rest, model, Stature())


def _bvh(skeleton: SourceSkeleton, model: BodyModel) -> Reader:
    if skeleton.parents is None or skeleton.rest_positions is None:
        raise TrackingError("a bvh skeleton needs parents and rest_positions; send both in `skeleton`")
    _levels(skeleton.parents)  # a loop would not end what follows
    try:
        parts = find_parts(skeleton.joint_names, np.array(skeleton.parents))
    except RetargetError as error:
        raise TrackingError(f"{error}. Name its joints as one of the usual rigs does") from error
    joints = dict(parts.joints)
    joints["chest"] = parts.spine[-1] if parts.spine else joints["pelvis"]
    joints |= {f"{side}_clavicle": joint for side, joint in parts.clavicles.items()}
    refuse_crooked_rest(_points(joints, skeleton.rest_positions))
    return _local(joints, skeleton.parents, skeleton.rest_positions, model)


def _local(
    joints: Mapping[str, int],
    parents: tuple[int, ...],
    rest: np.ndarray,
    model: BodyModel,
    stature: Stature | None = None,
) -> Reader:
    """Rotations relative to the parent and to a rest pose without turns; forward kinematics makes the points. With
    `stature` the rest pose is an average person's: how tall this one is is found on the way, and only heights are
    scaled."""
    levels = _levels(parents)
    offsets = np.array([rest[k] - rest[parent] if parent >= 0 else np.zeros(3) for k, parent in enumerate(parents)])
    rest_points = _points(joints, rest)
    ours = {name: model.rest_joints[k] for name, k in model.index_of.items()}
    stride = leg_length(ours) / leg_length(rest_points)
    trunk = [part for part in ("pelvis", *TURNS_ONLY) if part in joints]
    to_trunk = trunk_correction(ours, rest_points)
    above = np.array(parents)
    soles = [joints[f"{side}_{part}"] for side in SIDES for part in ("foot", "toes") if f"{side}_{part}" in joints]
    standing = rest[parents.index(-1), 1]

    def read(sample: Sample) -> Observation:
        assert sample.rotations is not None
        assert sample.root is not None
        turns = sample.rotations.copy()
        places = np.broadcast_to(sample.root, offsets.shape).copy()
        for level in levels:
            places[level] = places[above[level]] + quaternions.rotate(turns[above[level]], offsets[level])
            turns[level] = quaternions.multiply(turns[above[level]], turns[level])
        if stature is not None:
            height = float(sample.root[1])
            drop = height - float((places[soles, 1] - rest[soles, 1]).min())
            size = stature.size(height, drop, standing)
            places += sample.root * ([1.0 / stride, 1.0 / size, 1.0 / stride] - np.ones(3))
        told = {part: turns[joint] for part, joint in joints.items()}
        told |= {part: quaternions.multiply(told[part], to_trunk) for part in trunk}
        return Observation(
            points=_points({part: joint for part, joint in joints.items() if part != "chest"}, places),
            turns=told,
            rest=rest_points,
            stride=stride,
        )

    return read


def refuse_crooked_rest(points: Mapping[str, np.ndarray]) -> None:
    """Raises TrackingError when a rest pose that was told, its parts' places (3,) m, is not upright with Y up and
    facing +Z, as every length and turn is read relative to it. What lacks hips or shoulders is not looked at."""
    hips, shoulders = ([f"{side}_{part}" for side in SIDES] for part in ("thigh", "upper_arm"))
    if not all(part in points for part in (*hips, *shoulders)):
        return
    up = points[shoulders[0]] + points[shoulders[1]] - points[hips[0]] - points[hips[1]]
    left = points[hips[0]] - points[hips[1]] + points[shoulders[0]] - points[shoulders[1]]
    for what, direction, axis in (("trunk points up along", up, 1), ("left side is on the side of", left, 0)):
        length = float(np.linalg.norm(direction))
        if direction[axis] <= STRAIGHT * length:
            at = int(np.abs(direction).argmax())
            along = "nothing" if length == 0.0 else ("-" if direction[at] < 0.0 else "+") + "XYZ"[at]
            raise TrackingError(
                f"the {what} {along}, not +{'XYZ'[axis]}; send the rest pose upright, Y up, facing +Z, and the poses "
                "in the same axes",
                "rest_positions",
            )


def _levels(parents: tuple[int, ...]) -> list[np.ndarray]:
    """Joints by depth below the root, whatever order they are listed in. Raises TrackingError for a loop."""
    depth = []
    for joint in range(len(parents)):
        steps, at = 0, joint
        while parents[at] >= 0:
            at, steps = parents[at], steps + 1
            if steps > len(parents):
                raise TrackingError(f"joint {joint} is its own ancestor; list a tree", "parents")
        depth.append(steps)
    return [np.flatnonzero(np.array(depth) == d) for d in range(1, max(depth) + 1)]


def leg_length(points: Mapping[str, np.ndarray]) -> float:
    """Mean length [m] of hip to knee to ankle. Raises TrackingError for a leg without any."""
    lengths = [
        np.linalg.norm(points[f"{side}_{b}"] - points[f"{side}_{a}"])
        for side in SIDES
        for a, b in (("thigh", "shin"), ("shin", "foot"))
    ]
    if min(lengths) < 0.01:
        raise TrackingError("a thigh or shin is shorter than 1 cm; send metres", "rest_positions")
    return 0.5 * float(np.sum(lengths))


def _points(joints: Mapping[str, int], positions: np.ndarray) -> dict[str, np.ndarray]:
    return {part: positions[joint] for part, joint in joints.items()}


READERS: dict[str, Callable[[SourceSkeleton, BodyModel], Reader]] = {
    "webxr": _webxr,
    "head-hands": _head_hands,
    "mediapipe": _mediapipe,
    "smpl": _smpl,
    "bvh": _bvh,
}
