"""Whose joint is whose: the parts of a human found in a source skeleton, by the names of common conventions.

Only the joints that no structure tells are looked up by name: pelvis, head, and per side upper arm, forearm, hand,
thigh, shin, foot, toes. Spine, neck and clavicles are what lies between them. Names are compared without name space
(`mixamorig:Hips`), the rig's prefix (`Bip01 L Thigh`, `DEF-thigh.L`), capitals, underscores, dots, dashes and blanks;
where that does not find everybody, without what all names begin with, or nearly all (`Character1_Hips`). A pelvis of
another name is the joint at which legs, arms and head part. A limb's parts must hang from one another.
"""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

SIDES = ("left", "right")
LIMB_PARTS = ("upper_arm", "forearm", "hand", "thigh", "shin", "foot", "toes")
OPTIONAL = {"left_toes", "right_toes"}
NEARLY_ALL = 0.8  # of the joints begin with what is taken for a prefix; the others are an armature's or a prop's
RIG_PREFIX = re.compile(r"^(bip\d+[ _.-]|(def|org)-)")

# Convention -> part -> accepted names. {side} is left/right, {s} is l/r; compared after `_plain`.
CONVENTIONS: dict[str, dict[str, tuple[str, ...]]] = {
    "MotionBuilder, CMU, Mixamo": {
        "pelvis": ("Hips",),
        "head": ("Head",),
        "upper_arm": ("{side}Arm",),
        "forearm": ("{side}ForeArm",),
        "hand": ("{side}Hand",),
        "thigh": ("{side}UpLeg",),
        "shin": ("{side}Leg",),
        "foot": ("{side}Foot",),
        "toes": ("{side}ToeBase", "{side}Toe"),
    },
    "SMPL, Biovision": {
        "pelvis": ("pelvis", "Hips"),
        "head": ("head",),
        "upper_arm": ("{side}_shoulder", "{side}UpArm", "{s}_shoulder"),
        "forearm": ("{side}_elbow", "{side}LowArm", "{s}_elbow"),
        "hand": ("{side}_wrist", "{side}Hand", "{s}_wrist"),
        "thigh": ("{side}_hip", "{side}UpLeg", "{s}_hip"),
        "shin": ("{side}_knee", "{side}LowLeg", "{s}_knee"),
        "foot": ("{side}_ankle", "{side}Foot", "{s}_ankle"),
        "toes": ("{side}_toe", "{side}_foot", "{s}_toe", "{s}_foot"),
    },
    "Unreal": {
        "pelvis": ("pelvis",),
        "head": ("head",),
        "upper_arm": ("upperarm_{s}",),
        "forearm": ("lowerarm_{s}",),
        "hand": ("hand_{s}",),
        "thigh": ("thigh_{s}",),
        "shin": ("calf_{s}",),
        "foot": ("foot_{s}",),
        "toes": ("ball_{s}",),
    },
    "ASF, Poser": {
        "pelvis": ("root", "hip", "Hips"),
        "head": ("head",),
        "upper_arm": ("{s}humerus", "{s}Shldr"),
        "forearm": ("{s}radius", "{s}ForeArm"),
        "hand": ("{s}hand", "{s}wrist"),
        "thigh": ("{s}femur", "{s}Thigh"),
        "shin": ("{s}tibia", "{s}Shin"),
        "foot": ("{s}foot",),
        "toes": ("{s}toes", "{s}Toe"),
    },
    "3ds Max biped": {
        "pelvis": ("Pelvis",),
        "head": ("Head",),
        "upper_arm": ("{s} UpperArm",),
        "forearm": ("{s} Forearm",),
        "hand": ("{s} Hand",),
        "thigh": ("{s} Thigh",),
        "shin": ("{s} Calf",),
        "foot": ("{s} Foot",),
        "toes": ("{s} Toe0",),
    },
    "Blender's Rigify": {
        "pelvis": ("hips", "pelvis", "spine"),
        "head": ("head", "spine.006"),
        "upper_arm": ("upper_arm.{s}",),
        "forearm": ("forearm.{s}",),
        "hand": ("hand.{s}",),
        "thigh": ("thigh.{s}",),
        "shin": ("shin.{s}",),
        "foot": ("foot.{s}",),
        "toes": ("toe.{s}",),
    },
    "Unity": {
        "pelvis": ("Hips",),
        "head": ("Head",),
        "upper_arm": ("{side}UpperArm",),
        "forearm": ("{side}LowerArm",),
        "hand": ("{side}Hand",),
        "thigh": ("{side}UpperLeg",),
        "shin": ("{side}LowerLeg",),
        "foot": ("{side}Foot",),
        "toes": ("{side}Toes", "{side}ToeBase"),
    },
    "VRM": {
        "pelvis": ("J_Bip_C_Hips",),
        "head": ("J_Bip_C_Head",),
        "upper_arm": ("J_Bip_{s}_UpperArm",),
        "forearm": ("J_Bip_{s}_LowerArm",),
        "hand": ("J_Bip_{s}_Hand",),
        "thigh": ("J_Bip_{s}_UpperLeg",),
        "shin": ("J_Bip_{s}_LowerLeg",),
        "foot": ("J_Bip_{s}_Foot",),
        "toes": ("J_Bip_{s}_ToeBase",),
    },
    "DAZ Genesis": {
        "pelvis": ("hip",),
        "head": ("head",),
        "upper_arm": ("{s}ShldrBend", "{s}_upperarm"),
        "forearm": ("{s}ForearmBend", "{s}_forearm"),
        "hand": ("{s}Hand",),
        "thigh": ("{s}ThighBend", "{s}_thigh"),
        "shin": ("{s}Shin",),
        "foot": ("{s}Foot",),
        "toes": ("{s}Toe", "{s}_toes"),
    },
    "OptiTrack": {
        "pelvis": ("Hip", "Hips"),
        "head": ("Head",),
        "upper_arm": ("{s}UArm",),
        "forearm": ("{s}FArm",),
        "hand": ("{s}Hand",),
        "thigh": ("{s}Thigh",),
        "shin": ("{s}Shin",),
        "foot": ("{s}Foot",),
        "toes": ("{s}Toe",),
    },
    "Mixamo in Blender": {
        "pelvis": ("Hips",),
        "head": ("Head",),
        "upper_arm": ("Arm.{s}",),
        "forearm": ("ForeArm.{s}",),
        "hand": ("Hand.{s}",),
        "thigh": ("UpLeg.{s}",),
        "shin": ("Leg.{s}",),
        "foot": ("Foot.{s}",),
        "toes": ("ToeBase.{s}",),
    },
    "tryon": {
        "pelvis": ("pelvis",),
        "head": ("head",),
        **{part: (f"{{side}}_{part}",) for part in LIMB_PARTS},
    },
}


class RetargetError(ValueError):
    """A motion's skeleton cannot be mapped onto the body; the message names the joint and the remedy."""


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
        raise RetargetError(
            f"the arms and the head do not descend from the pelvis {joint_names[joints['pelvis']]!r}; "
            "hang them from it in the exporter, or give its name to the joint that they hang from"
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
    index = {name: k for k, name in enumerate(joint_names)}
    parts = ["pelvis", "head", *(f"{side}_{part}" for side in SIDES for part in LIMB_PARTS)]
    for part, joint in names.items():
        if part not in parts or joint not in index:
            what = f"no part is called {part!r}" if part not in parts else f"the skeleton has no joint {joint!r}"
            raise RetargetError(f"names: {what}; parts are {', '.join(parts)}")
    best, best_accepted = _best_match(joint_names)
    best |= {part: index[joint] for part, joint in names.items()}
    missing = [part for part in parts if part not in best and part not in OPTIONAL]
    if missing == ["pelvis"]:
        parting = _parting(best, parents)
        if parting is not None:
            return {"pelvis": parting} | best
    if missing:
        wanted = "; ".join(f"{part} (expected {' or '.join(map(repr, best_accepted[part]))})" for part in missing)
        raise RetargetError(
            f"the skeleton lacks a joint for: {wanted}. It has: {', '.join(joint_names)}. Rename the joint "
            "in the exporter or in the file"
        )
    return best


def _best_match(joint_names: Sequence[str]) -> tuple[dict[str, int], dict[str, tuple[str, ...]]]:
    """Part -> joint by the convention that finds most parts, the first of equals; and part -> its accepted names.

    Without a shared prefix names are looked up only where they find more than the whole names do, and such that two
    joints have then (`Actor1_Hips` beside a prop's `Hips`) are nobody's.
    """
    whole: dict[str, int] = {}
    for joint, name in enumerate(joint_names):
        whole.setdefault(_plain(name), joint)
    best: dict[str, int] = {}
    best_accepted: dict[str, tuple[str, ...]] = {}
    for plain in (whole, *(_without(prefix, joint_names) for prefix in _shared_prefixes(joint_names))):
        for convention in CONVENTIONS.values():
            accepted = _accepted(convention)
            found: dict[str, int] = {}
            for part, options in accepted.items():
                joints = [plain[_plain(name)] for name in options if _plain(name) in plain]
                if part in OPTIONAL:  # the foot of one option is the toes of another
                    joints = [joint for joint in joints if joint not in found.values()]
                if joints:
                    found[part] = joints[0]
            if len(found) > len(best) or not best_accepted:
                best, best_accepted = found, accepted
    return best, best_accepted


def _shared_prefixes(joint_names: Sequence[str]) -> list[str]:
    """What all names begin with, or nearly all up to a separator; the shortest first."""
    shared = Counter(name[: k + 1] for name in joint_names for k, letter in enumerate(name[:-1]) if letter in "_.:- ")
    prefixes = {prefix for prefix, count in shared.items() if count >= NEARLY_ALL * len(joint_names)}
    alike = itertools.takewhile(lambda letters: len(set(letters)) == 1, zip(*joint_names))
    prefixes.add("".join(letters[0] for letters in alike))
    return sorted(prefixes - {""}, key=len)


def _without(prefix: str, joint_names: Sequence[str]) -> dict[str, int]:
    """Plain name without `prefix` -> joint, of those names that only one joint has then."""
    plain = [_plain(name.removeprefix(prefix)) for name in joint_names]
    counts = Counter(plain)
    return {name: joint for joint, name in enumerate(plain) if counts[name] == 1}


def _refuse_loose_limbs(joints: Mapping[str, int], joint_names: Sequence[str], parents: np.ndarray) -> None:
    """Names alone may lead astray: what is no limb by its structure is not taken for one."""
    for side in SIDES:
        for limb in (LIMB_PARTS[:3], LIMB_PARTS[3:]):
            chain = [joints[f"{side}_{part}"] for part in limb if f"{side}_{part}" in joints]
            for above, below in itertools.pairwise(chain):
                if above not in _ancestors(below, parents)[1:]:
                    raise RetargetError(
                        f"{joint_names[below]!r} does not hang from {joint_names[above]!r}, so they are no limb of one "
                        f"person. It has: {', '.join(joint_names)}. Rename the joints in the exporter or in the file"
                    )


def _parting(joints: Mapping[str, int], parents: np.ndarray) -> int | None:
    """The joint nearest to the limbs from which both legs, both arms and the head descend; None where there is none."""
    ends = [joints[f"{side}_{part}"] for side in SIDES for part in ("thigh", "upper_arm")]
    above = [set(_ancestors(end, parents)[1:]) for end in ends]
    path = _ancestors(joints["head"], parents)[1:]
    return next((joint for joint in path if all(joint in others for others in above)), None)


def _accepted(convention: Mapping[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """Part with side -> accepted names."""
    accepted = {part: convention[part] for part in ("pelvis", "head")}
    for side in SIDES:
        for part in LIMB_PARTS:
            accepted[f"{side}_{part}"] = tuple(
                name.format(side=side.capitalize() if "_" not in name else side, s=side[0]) for name in convention[part]
            )
    return accepted


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", RIG_PREFIX.sub("", name.rsplit(":", 1)[-1].lower()))


def _ancestors(joint: int, parents: np.ndarray) -> list[int]:
    """The joint and its ancestors, nearest first."""
    path = [joint]
    while parents[path[-1]] >= 0:
        path.append(int(parents[path[-1]]))
    return path
