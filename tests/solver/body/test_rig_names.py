"""Rigs by their names: what is known under which, what all joints share, and what is refused."""

from __future__ import annotations

import re

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS

from tryon_solver.body import BodyModel, BvhClip, RetargetError, parse_bvh, retarget
from tryon_solver.body.skeletons import find_parts

OURS = ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")
MIDDLE = ("Hips", "Spine", "Spine1", "Spine2", "Neck", "Head")
TEXT = (DEMO_MOTIONS / "squat.bvh").read_text()


def renamed(names: dict[str, str], text: str = TEXT) -> str:
    """A BVH file's text with these joints called otherwise."""
    return re.sub(r"(?<=ROOT |OINT )(\S+)$", lambda name: names.get(name[0], name[0]), text, flags=re.MULTILINE)


def names(sided: str, limbs: str, middle: str = " ".join(MIDDLE)) -> dict[str, str]:
    """Our names -> a rig's. `sided`: how a limb's name is made, of {side}, {S}, {s} and {limb}."""
    table = dict(zip(MIDDLE, middle.split(), strict=True))
    for side in ("Left", "Right"):
        for ours, limb in zip(OURS, limbs.split(), strict=True):
            table[side + ours] = sided.format(side=side, S=side[0], s=side[0].lower(), limb=limb)
        table[f"{side}HandMiddle1"] = sided.format(side=side, S=side[0], s=side[0].lower(), limb="Mid1")
    return table


def prefixed(prefix: str) -> dict[str, str]:
    return {name: prefix + name for name in re.findall(r"(?:ROOT|JOINT) (\S+)", TEXT)}


SMPL = "Collar Shoulder Elbow Wrist Hip Knee Ankle Foot"
RIGS = {
    "MotionBuilder's character": prefixed("Character1_"),
    "Mixamo, underscore": prefixed("mixamorig_"),
    "Mixamo, no separator": prefixed("mixamorig"),
    "an actor": prefixed("Actor1."),
    "two levels": prefixed("Scene_Actor.1_"),
    "nearly all": prefixed("Actor1_") | {"Hips": "Reference"},
    "VRM": names(
        "J_Bip_{S}_{limb}",
        "Shoulder UpperArm LowerArm Hand UpperLeg LowerLeg Foot ToeBase",
        "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest J_Bip_C_Neck J_Bip_C_Head",
    ),
    "DAZ Genesis 8": names(
        "{s}{limb}",
        "Collar ShldrBend ForearmBend Hand ThighBend Shin Foot Toe",
        "hip abdomenLower abdomenUpper chestLower neckLower head",
    ),
    "DAZ Genesis 9": names(
        "{s}_{limb}", "shoulder upperarm forearm hand thigh shin foot toes", "hip spine1 spine2 spine3 neck1 head"
    ),
    "OptiTrack": names("{S}{limb}", "Shoulder UArm FArm Hand Thigh Shin Foot Toe", "Hip Ab Ab2 Chest Neck Head"),
    "Mixamo in Blender": names("{limb}.{S}", " ".join(OURS)),
    "SMPL's letters": names("{S}_{limb}", SMPL, "Pelvis Spine1 Spine2 Spine3 Neck Head"),
    "SMPL in Unity": names(
        "m_avg_{S}_{limb}",
        SMPL,
        "m_avg_Pelvis m_avg_Spine1 m_avg_Spine2 m_avg_Spine3 m_avg_Neck m_avg_Head",
    ),
}


@pytest.mark.parametrize("rig", RIGS)
def test_the_rigs_names_give_the_same_parts(rig: str) -> None:
    clip, other = parse_bvh(TEXT), parse_bvh(renamed(RIGS[rig]))
    assert other.joint_names != clip.joint_names
    assert find_parts(other.joint_names, other.parents) == find_parts(clip.joint_names, clip.parents)


def biovision() -> BvhClip:
    """Biovision's own rig, which ends at the feet."""
    without_toes = re.sub(r"JOINT \w+ToeBase\s*\{[^{}]*(End Site\s*\{[^{}]*\})\s*\}", r"\1", TEXT)
    head, motion = without_toes.split("MOTION")
    lines = motion.strip().splitlines()
    kept, column = [], 0
    for block in re.findall(r"(?:ROOT|JOINT) (\S+)[^}]*?CHANNELS (\d)", TEXT):
        kept += [] if block[0].endswith("ToeBase") else range(column, column + int(block[1]))
        column += int(block[1])
    rows = [" ".join(np.array(line.split())[kept]) for line in lines[2:]]
    limbs = "Collar UpArm LowArm Hand UpLeg LowLeg Foot Toe"
    return parse_bvh(renamed(names("{side}{limb}", limbs), "\n".join([head + "MOTION", *lines[:2], *rows])))


def test_biovisions_own_rig_has_no_toes_and_is_played(body: BodyModel) -> None:
    clip = biovision()
    assert "LeftLowLeg" in clip.joint_names
    assert not any("Toe" in name for name in clip.joint_names)
    parts = find_parts(clip.joint_names, clip.parents)
    assert clip.joint_names[parts.joints["left_foot"]] == "LeftFoot"
    assert not {"left_toes", "right_toes"} & set(parts.joints)
    ours, theirs = retarget(parse_bvh(TEXT), body), retarget(clip, body)
    limbs = [k for k, name in enumerate(body.joint_names) if not name.endswith(("foot", "toes", "shin", "shin_twist"))]
    apart = np.abs(ours.rotations[:, limbs]) - np.abs(theirs.rotations[:, limbs])
    assert np.abs(apart).max() < 1e-9, "all but feet and the shins' twist is as with toes"


@pytest.mark.parametrize(
    "table",
    [
        {"LeftForeArm": "Gizmo"},
        prefixed("Actor1_") | {"LeftForeArm": "Actor1_Gizmo"},
        # over a fifth of the joints are not the actor's
        prefixed("Actor1_")
        | {name: f"Prop_{name}" for name in ("Head", "LeftArm", "LeftHand", "Neck", "LeftLeg", "Hips")},
        # two joints of one name
        prefixed("Actor1_") | {"LeftHandMiddle1": "LeftForeArm"},
        {name: f"joint{k}" for k, name in enumerate(prefixed(""))},
    ],
    ids=["partial", "partial with prefix", "too few share it", "ambiguous", "no names"],
)
def test_partial_and_ambiguous_names_are_refused_with_the_joints(table: dict[str, str]) -> None:
    clip = parse_bvh(renamed(table))
    with pytest.raises(RetargetError, match=r"the skeleton lacks a joint for: .*left_.*It has: ") as refusal:
        find_parts(clip.joint_names, clip.parents)
    assert ", ".join(clip.joint_names) in str(refusal.value)


def test_names_that_are_no_limb_by_the_hierarchy_are_refused() -> None:
    swapped = {"LeftForeArm": "RightForeArm", "RightForeArm": "LeftForeArm"}
    clip = parse_bvh(renamed(swapped))
    with pytest.raises(RetargetError, match=r"'LeftForeArm' does not hang from 'LeftArm'.*It has: Hips, "):
        find_parts(clip.joint_names, clip.parents)
