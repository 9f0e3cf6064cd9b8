"""Whose joint is whose: the parts of a human found in a source skeleton, by names and by what hangs from what.

Only the joints that no structure tells are looked up by name (rig_names.py): pelvis, head, and per side upper arm,
forearm, hand, thigh, shin, foot, toes. Spine, neck and clavicles are what lies between them. Of several joints that are
called a pelvis it is the one from which legs, arms and head descend; one of another name is the joint at which they
part. A limb's parts must hang from one another.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tryon_solver.body.rig_names import ARM, LEG, LIMB_PARTS, SIDES, Named, find_named

OPTIONAL = {"left_toes", "right_toes"}
PARTS = ("pelvis", "head", *(f"{side}_{part}" for side in SIDES for part in LIMB_PARTS))


class RetargetError(ValueError):
    """A motion's skeleton cannot be mapped onto the body; the message names the joint and the remedy."""


class UnnamedError(RetargetError):
    """Parts of a human were not found by the names of a skeleton's joints; saying which joints they are is the remedy.

    `parts`: those parts.
    """

    def __init__(self, message: str, parts: tuple[str, ...]) -> None:
        super().__init__(message)
        self.parts = parts


@dataclass(frozen=True)
class SkeletonParts:
    """Joint indices of a source skeleton."""

    joints: dict[str, int]  # "pelvis", "head", "left_upper_arm", ... -> joint
    spine: tuple[int, ...]  # above the pelvis up to the joint that carries both arms, lowest first; may be empty
    neck: tuple[int, ...]  # between that joint and the head, lowest first; may be empty
    clavicles: dict[str, int]  # side -> joint that carries the upper arm, where there is one


def find_parts(
    joint_names: Sequence[str], parents: np.ndarray, names: Mapping[str, str] | None = None
) -> SkeletonParts:
    """Find the parts of a human among `joint_names` (J,) with `parents` (J,).

    `names` maps parts ("pelvis", "left_forearm", ...) to source joints and goes before the conventions.
    Raises RetargetError naming every missing joint.
    """
    joints = _named_joints(joint_names, parents, dict(names or {}))
    _refuse_loose_limbs(joints, joint_names, parents)
    to_left, to_right, to_head = (
        _ancestors(joints[part], parents) for part in ("left_upper_arm", "right_upper_arm", "head")
    )
    common = [joint for joint in to_left[1:] if joint in to_right]
    if not common or joints["pelvis"] not in common or joints["pelvis"] not in to_head:
        raise UnnamedError(
            f"the arms and the head do not descend from the pelvis {joint_names[joints['pelvis']]!r}; "
            "hang them from it in the exporter, or give its name to the joint that they hang from",
            ("pelvis",),
        )
    chest = common[0]
    spine = common[: common.index(joints["pelvis"])]
    clavicles = {
        side: path[1] for side, path in zip(SIDES, (to_left, to_right)) if path[1] not in (chest, joints["pelvis"])
    }
    meeting = next(joint for joint in to_head if joint in to_left)
    neck = to_head[1 : to_head.index(meeting)]
    return SkeletonParts(joints, tuple(reversed(spine)), tuple(reversed(neck)), clavicles)


def _named_joints(joint_names: Sequence[str], parents: np.ndarray, names: dict[str, str]) -> dict[str, int]:
    told = _told_joints(joint_names, names)
    named = find_named(joint_names)
    found = {part: joint for part, joint in named.joints.items() if joint not in told.values()} | told
    missing = tuple(part for part in PARTS[1:] if part not in found and part not in OPTIONAL)
    if missing:
        wanted = "; ".join(f"{part} ({_wanted(part, named, joint_names)})" for part in missing)
        raise UnnamedError(f"the skeleton lacks a joint for: {wanted}. It has: {', '.join(joint_names)}", missing)
    if "pelvis" not in told:
        found["pelvis"] = _pelvis(named.pelvis, found, joint_names, parents)
    return found


def _told_joints(joint_names: Sequence[str], names: dict[str, str]) -> dict[str, int]:
    index = {name: k for k, name in enumerate(joint_names)}
    for part, joint in names.items():
        if part not in PARTS:
            raise UnnamedError(f"no part is called {part!r}; parts are {', '.join(PARTS)}", ())
        if joint not in index:
            told = f"{part} is told to be {joint!r}, which is no joint"
            raise UnnamedError(f"{told}. It has: {', '.join(joint_names)}", (part,))
    for joint, count in Counter(names.values()).items():
        if count > 1:
            parts = tuple(part for part, other in names.items() if other == joint)
            raise UnnamedError(f"{joint!r} is told to be {' and '.join(parts)}, which are not one", parts)
    return {part: index[joint] for part, joint in names.items()}


def _wanted(part: str, named: Named, joint_names: Sequence[str]) -> str:
    if part in named.twice:
        return f"one of {', '.join(repr(joint_names[joint]) for joint in named.twice[part])}: it can't be told which"
    return f"expected {named.expected[part]!r}"


def _pelvis(
    called: Sequence[int], joints: Mapping[str, int], joint_names: Sequence[str], parents: np.ndarray
) -> int:
    """The joint from which legs, arms and head descend: one of those `called` a pelvis, else where they part."""
    carrying = _carrying(joints, parents)
    pelvis = next((joint for joint in carrying if joint in called), None)
    if pelvis is not None:
        return pelvis
    if called:
        return called[0]  # which is refused, with what does not hang from it
    if carrying:
        return carrying[0]
    raise UnnamedError(
        f"the skeleton lacks a joint for: pelvis (expected 'Hips', or one that legs, arms and head hang from). It has: "
        f"{', '.join(joint_names)}",
        ("pelvis",),
    )


def _refuse_loose_limbs(joints: Mapping[str, int], joint_names: Sequence[str], parents: np.ndarray) -> None:
    """Names alone may lead astray: what is no limb by its structure is not taken for one."""
    for side in SIDES:
        for limb in (ARM, LEG):
            chain = [f"{side}_{part}" for part in limb if f"{side}_{part}" in joints]
            for pair in itertools.pairwise(chain):
                above, below = (joints[part] for part in pair)
                if above not in _ancestors(below, parents)[1:]:
                    raise UnnamedError(
                        f"{joint_names[below]!r} does not hang from {joint_names[above]!r}, so they are no limb of one "
                        f"person. It has: {', '.join(joint_names)}",
                        pair,
                    )


def _carrying(joints: Mapping[str, int], parents: np.ndarray) -> list[int]:
    """The joints from which both legs, both arms and the head descend, the nearest to them first."""
    ends = [joints[f"{side}_{part}"] for side in SIDES for part in ("thigh", "upper_arm")]
    above = [set(_ancestors(end, parents)[1:]) for end in ends]
    path = _ancestors(joints["head"], parents)[1:]
    return [joint for joint in path if all(joint in others for others in above)]


def _ancestors(joint: int, parents: np.ndarray) -> list[int]:
    """The joint and its ancestors, nearest first."""
    path = [joint]
    while parents[path[-1]] >= 0:
        path.append(int(parents[path[-1]]))
    return path
