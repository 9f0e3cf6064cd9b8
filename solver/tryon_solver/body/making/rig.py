"""The rig of the body: MakeHuman's default rig with its 163 bones merged into 38 joints.

Kept are the joints that shape what a garment touches: five of the spine, clavicle and shoulder, and two per limb
segment, so that a twist of the hand or the thigh is spread along it. Merged are face, single fingers and toes. The
second joint of a limb segment is moved onto the segment's straight axis: a twist about that axis then leaves the next
joint where it is.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from tryon_solver.body.making.makehuman import Bone, MakeHumanBody


@dataclass(frozen=True)
class RigJoint:
    """One of our joints: whose weights it takes over and where it sits."""

    name: str
    parent: str
    bones: str  # regular expression over MakeHuman bones whose weights it takes
    heads: str  # regular expression over MakeHuman bones; the joint sits at the mean of their heads


def _side(side: str) -> list[RigJoint]:
    s = side[0].upper()
    rows = (
        ("clavicle", "spine_5", rf"clavicle\.{s}", ""),
        ("shoulder", "clavicle", rf"shoulder01\.{s}", ""),
        ("upper_arm", "shoulder", rf"upperarm01\.{s}", ""),
        ("upper_arm_twist", "upper_arm", rf"upperarm02\.{s}", ""),
        ("forearm", "upper_arm_twist", rf"lowerarm01\.{s}", ""),
        ("forearm_twist", "forearm", rf"lowerarm02\.{s}", ""),
        ("hand", "forearm_twist", rf"(wrist|metacarpal\d|finger1-\d)\.{s}", rf"wrist\.{s}"),
        ("fingers", "hand", rf"finger[2-5]-\d\.{s}", rf"finger[2-5]-1\.{s}"),
        ("thigh", "pelvis", rf"upperleg01\.{s}", ""),
        ("thigh_twist", "thigh", rf"upperleg02\.{s}", ""),
        ("shin", "thigh_twist", rf"lowerleg01\.{s}", ""),
        ("shin_twist", "shin", rf"lowerleg02\.{s}", ""),
        ("foot", "shin_twist", rf"foot\.{s}", ""),
        ("toes", "foot", rf"toe\d-\d\.{s}", rf"toe\d-1\.{s}"),
    )
    central = {"spine_5", "pelvis"}
    return [
        RigJoint(f"{side}_{name}", parent if parent in central else f"{side}_{parent}", bones, heads or bones)
        for name, parent, bones, heads in rows
    ]


# The head takes what no other joint names: skull, jaw, eyes and the muscles of the face.
JOINTS = (
    RigJoint("pelvis", "", r"root|pelvis\.[LR]", "spine05"),
    RigJoint("spine_1", "pelvis", "spine05", "spine05"),
    RigJoint("spine_2", "spine_1", "spine04", "spine04"),
    RigJoint("spine_3", "spine_2", "spine03", "spine03"),
    RigJoint("spine_4", "spine_3", r"spine02|breast\.[LR]", "spine02"),
    RigJoint("spine_5", "spine_4", "spine01", "spine01"),
    RigJoint("neck_1", "spine_5", "neck01", "neck01"),
    RigJoint("neck_2", "neck_1", "neck02", "neck02"),
    RigJoint("neck_3", "neck_2", "neck03", "neck03"),
    RigJoint("head", "neck_3", "head", "head"),
    *_side("left"),
    *_side("right"),
)
SPLIT_SEGMENTS = (("upper_arm", "forearm"), ("forearm", "hand"), ("thigh", "shin"), ("shin", "foot"))


@dataclass(frozen=True)
class Rig:
    """Joints in the order parents first, with the dense weights of a surface."""

    names: tuple[str, ...]
    parents: np.ndarray  # (J,) int32
    joints: np.ndarray  # (J, 3) m
    weights: np.ndarray  # (V, J), rows sum to 1
    joint_of_bone: np.ndarray  # (len(body.bone_names),) int, which joint took each MakeHuman bone


def reduce_rig(body: MakeHumanBody) -> Rig:
    """Merge the MakeHuman rig into JOINTS."""
    names = tuple(joint.name for joint in JOINTS)
    index = {name: k for k, name in enumerate(names)}
    parents = np.array([index.get(joint.parent, -1) for joint in JOINTS], dtype=np.int32)
    positions = {joint.name: _mean_head(body.bones, joint.heads) for joint in JOINTS}
    for side in ("left", "right"):
        for near, far in SPLIT_SEGMENTS:
            start, end = positions[f"{side}_{near}"], positions[f"{side}_{far}"]
            twist, axis = f"{side}_{near}_twist", end - start
            positions[twist] = start + axis * ((positions[twist] - start) @ axis / (axis @ axis))

    joint_of_bone = np.array([_joint_of(bone, index) for bone in body.bone_names])
    weights = np.zeros((len(body.vertices), len(names)))
    np.add.at(weights.T, joint_of_bone, body.weights.T)
    return Rig(names, parents, np.stack([positions[name] for name in names]), weights, joint_of_bone)


def _mean_head(bones: dict[str, Bone], pattern: str) -> np.ndarray:
    return np.mean([bone.head for name, bone in bones.items() if re.fullmatch(pattern, name)], axis=0)


def _joint_of(bone: str, index: dict[str, int]) -> int:
    for joint in JOINTS:
        if re.fullmatch(joint.bones, bone):
            return index[joint.name]
    return index["head"]
