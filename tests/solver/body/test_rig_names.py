"""Rigs by their names: what is known under which, what all joints share, and what is refused."""

from __future__ import annotations

import re

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS

from tryon_solver.body import BodyModel, BvhClip, RetargetError, parse_bvh, retarget
from tryon_solver.body.skeletons import UnnamedError, find_parts

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
    "Bandai Namco": names(
        "{limb}_{S}",
        "Shoulder UpperArm LowerArm Hand UpperLeg LowerLeg Foot Toes",
        "Hips Spine Chest Chest2 Neck Head",
    ),
    "Kinect 2": names("{limb}{side}", SMPL, "SpineBase SpineMid SpineShoulder Chest Neck Head"),
    "Azure Kinect": names(
        "K4ABT_JOINT_{limb}_{side}", SMPL, " ".join(f"K4ABT_JOINT_{name}" for name in MIDDLE)
    ),
    "Kinect 1": names("{limb}_{side}", SMPL, "Hip_Center Spine Chest Shoulder_Center Neck Head"),
    "Xsens, FBX": names(
        "{side}{limb}",
        "Shoulder UpperArm ForeArm Hand UpperLeg LowerLeg Foot Toe",
        "Pelvis L5 L3 T8 Neck Head",
    ),
    "Xsens, BVH": names("{side}{limb}", "Collar Shoulder Elbow Wrist Hip Knee Ankle Toe", " ".join(MIDDLE)),
    "Rokoko": names(
        "{side}{limb}", "Shoulder Arm ForeArm Hand Thigh Shin Foot Toe", "Hips Spine1 Spine2 Spine3 Neck Head"
    ),
    "DeepMotion": names(
        "{s}_{limb}_JNT",
        "shoulder arm forearm hand upleg leg foot toebase",
        "hips_JNT spine_JNT spine1_JNT spine2_JNT neck_JNT head_JNT",
    ),
    "Character Creator": names(
        "CC_Base_{S}_{limb}",
        "Clavicle Upperarm Forearm Hand Thigh Calf Foot ToeBase",
        "CC_Base_Hip CC_Base_Waist CC_Base_Spine01 CC_Base_Spine02 CC_Base_NeckTwist01 CC_Base_Head",
    ),
    "Source": names(
        "ValveBiped.Bip01_{S}_{limb}",
        "Clavicle UpperArm Forearm Hand Thigh Calf Foot Toe0",
        "ValveBiped.Bip01_Pelvis Spine Spine1 Spine2 ValveBiped.Bip01_Neck1 ValveBiped.Bip01_Head",
    ),
    "Advanced Skeleton": names(
        "{limb}_{S}",
        "Scapula Shoulder Elbow Wrist Hip Knee Ankle Toes",
        "Root_M Spine1_M Spine2_M Chest_M Neck_M Head_M",
    ),
    "Auto-Rig Pro": names(
        "{limb}.{s}",
        "shoulder arm_stretch forearm_stretch hand thigh_stretch leg_stretch foot toes_01",
        "root.x spine_01.x spine_02.x spine_03.x neck.x head.x",
    ),
    "MikuMikuDance, translated": names(
        "{side} {limb}", "shoulder arm elbow wrist leg knee ankle toe", "Hips Spine Chest Upper_Chest Neck Head"
    ),
    "Theia": names("{s}_{limb}", "clavicle uarm larm hand thigh shank foot toes", "pelvis a b torso neck head"),
    "SMPL's letters": names("{S}_{limb}", SMPL, "Pelvis Spine1 Spine2 Spine3 Neck Head"),
    "SMPL in Unity": names(
        "m_avg_{S}_{limb}",
        SMPL,
        "m_avg_Pelvis m_avg_Spine1 m_avg_Spine2 m_avg_Spine3 m_avg_Neck m_avg_Head",
    ),
}


# A joint's name, and the chain that hangs from it: the last of a line's names hang from each other.
TREES = {
    "MakeHuman's default": """
        root spine05 spine04 spine03 spine02 spine01 neck01 neck02 neck03 head jaw
        {spine01} clavicle.{S} shoulder01.{S} upperarm01.{S} upperarm02.{S} lowerarm01.{S} lowerarm02.{S} wrist.{S}
        {wrist.{S}} metacarpal1.{S} finger2-1.{S}
        {root} pelvis.{S} upperleg01.{S} upperleg02.{S} lowerleg01.{S} lowerleg02.{S} foot.{S} toe1-1.{S}""",
    "Bandai Namco": """
        joint_Root Hips Spine Chest Neck Head
        {Chest} Shoulder_{S} UpperArm_{S} LowerArm_{S} Hand_{S}
        {Hips} UpperLeg_{S} LowerLeg_{S} Foot_{S} Toes_{S}""",
    "Azure Kinect": """
        PELVIS SPINE_NAVEL SPINE_CHEST NECK HEAD NOSE
        {SPINE_CHEST} CLAVICLE_{SIDE} SHOULDER_{SIDE} ELBOW_{SIDE} WRIST_{SIDE} HAND_{SIDE} HANDTIP_{SIDE}
        {PELVIS} HIP_{SIDE} KNEE_{SIDE} ANKLE_{SIDE} FOOT_{SIDE}""",
    "Character Creator": """
        RL_BoneRoot CC_Base_Hip CC_Base_Waist CC_Base_Spine01 CC_Base_Spine02 CC_Base_NeckTwist01 CC_Base_Head
        {CC_Base_Spine02} CC_Base_{S}_Clavicle CC_Base_{S}_Upperarm CC_Base_{S}_Forearm CC_Base_{S}_Hand
        {CC_Base_Hip} CC_Base_Pelvis
        {CC_Base_Pelvis} CC_Base_{S}_Thigh CC_Base_{S}_Calf CC_Base_{S}_Foot CC_Base_{S}_ToeBase""",
    "Rigify, all layers": """
        root hips ORG-spine DEF-spine DEF-spine.001 DEF-spine.003 DEF-spine.004 DEF-spine.006
        {hips} head
        {DEF-spine.003} DEF-shoulder.{S} DEF-upper_arm.{S} DEF-upper_arm.{S}.001 DEF-forearm.{S} DEF-hand.{S}
        {root} hand_ik.{S} thigh_ik.{S} foot_ik.{S} ORG-hand.{S} ORG-foot.{S}
        {DEF-spine} DEF-pelvis.{S}
        {DEF-spine} DEF-thigh.{S} DEF-thigh.{S}.001 DEF-shin.{S} DEF-foot.{S} DEF-toe.{S}""",
    "OpenNI": """
        Torso Neck Head
        {Torso} {S}_Shoulder {S}_Elbow {S}_Hand {S}_Fingertip
        {Torso} {S}_Hip {S}_Knee {S}_Foot""",
    "ASF": """
        root lowerback upperback thorax lowerneck upperneck head
        {thorax} {s}clavicle {s}humerus {s}radius {s}wrist {s}hand {s}fingers
        {root} {s}hipjoint {s}femur {s}tibia {s}foot {s}toes""",
}
ASKED = ("pelvis", "head", "left_upper_arm", "right_forearm", "left_hand", "left_thigh", "right_shin", "right_foot")
ASKED += ("left_toes",)
FOUND = {
    "MakeHuman's default": "root head upperarm01.L lowerarm01.R wrist.L upperleg01.L lowerleg01.R foot.R -",
    "Bandai Namco": "Hips Head UpperArm_L LowerArm_R Hand_L UpperLeg_L LowerLeg_R Foot_R Toes_L",
    "Azure Kinect": "PELVIS HEAD SHOULDER_LEFT ELBOW_RIGHT WRIST_LEFT HIP_LEFT KNEE_RIGHT ANKLE_RIGHT FOOT_LEFT",
    "Character Creator": "CC_Base_Hip CC_Base_Head CC_Base_L_Upperarm CC_Base_R_Forearm CC_Base_L_Hand CC_Base_L_Thigh "
    "CC_Base_R_Calf CC_Base_R_Foot CC_Base_L_ToeBase",
    "Rigify, all layers": "DEF-spine DEF-spine.006 DEF-upper_arm.L DEF-forearm.R DEF-hand.L DEF-thigh.L DEF-shin.R "
    "DEF-foot.R DEF-toe.L",
    "OpenNI": "Torso Head L_Shoulder R_Elbow L_Hand L_Hip R_Knee R_Foot -",
    "ASF": "root head lhumerus rradius lhand lfemur rtibia rfoot ltoes",
}


def tree(lines: str) -> tuple[list[str], np.ndarray]:
    """Names and parents of chains; one that names a side is there twice, {joint} is what it hangs from."""
    joints: dict[str, int] = {}
    parents: list[int] = []
    for line in lines.strip().splitlines():
        for side in ("LEFT", "RIGHT") if "{S" in line or "{s}" in line else ("",):
            said = line.replace("{SIDE}", side).replace("{S}", side[:1]).replace("{s}", side[:1].lower())
            above = -1
            for name in said.split():
                if name.startswith("{"):
                    above = joints[name[1:-1]]
                    continue
                assert name not in joints
                joints[name] = len(parents)
                parents.append(above)
                above = joints[name]
    return list(joints), np.array(parents)


@pytest.mark.parametrize("rig", TREES)
def test_the_parts_of_a_rig_that_has_more_joints(rig: str) -> None:
    joint_names, parents = tree(TREES[rig])
    parts = find_parts(joint_names, parents)
    found = [joint_names[parts.joints[part]] if part in parts.joints else "-" for part in ASKED]
    assert found == FOUND[rig].split()


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
        {"LeftHandMiddle1": "Left_ForeArm"},
        # a clavicle is no upper arm where the other side says which joint is one
        {"LeftArm": "Gizmo"},
        {name: f"joint{k}" for k, name in enumerate(prefixed(""))},
    ],
    ids=["partial", "with prefix", "too few share it", "ambiguous", "twice", "a clavicle", "no names"],
)
def test_partial_and_ambiguous_names_are_refused_with_the_joints(table: dict[str, str]) -> None:
    clip = parse_bvh(renamed(table))
    with pytest.raises(RetargetError, match=r"the skeleton lacks a joint for: .*left_.*It has: ") as refusal:
        find_parts(clip.joint_names, clip.parents)
    assert ", ".join(clip.joint_names) in str(refusal.value)


def test_what_two_joints_are_called_is_asked_for_and_can_be_told() -> None:
    clip = parse_bvh(renamed({"LeftHandMiddle1": "Left_ForeArm"}))
    both = r"left_forearm \(one of 'LeftForeArm', 'Left_ForeArm': it can't be told which\)"
    with pytest.raises(UnnamedError, match=both) as refusal:
        find_parts(clip.joint_names, clip.parents)
    assert refusal.value.parts == ("left_forearm",)
    told = find_parts(clip.joint_names, clip.parents, {"left_forearm": "LeftForeArm"})
    plain = parse_bvh(TEXT)
    assert told == find_parts(plain.joint_names, plain.parents)


def test_both_upper_arms_of_another_name_are_not_taken_for_clavicles() -> None:
    """Each rig names arms after bones or after joints: a shoulder with a forearm is no upper arm."""
    clip = parse_bvh(renamed({"LeftArm": "Gizmo", "RightArm": "Gadget"}))
    with pytest.raises(UnnamedError) as refusal:
        find_parts(clip.joint_names, clip.parents)
    assert refusal.value.parts == ("left_upper_arm", "right_upper_arm")
    plain = parse_bvh(TEXT)
    told = {"left_upper_arm": "Gizmo", "right_upper_arm": "Gadget"}
    assert find_parts(clip.joint_names, clip.parents, told) == find_parts(plain.joint_names, plain.parents)


def test_a_rig_without_any_names_is_told_joint_by_joint() -> None:
    clip, plain = parse_bvh(TEXT), parse_bvh(TEXT)
    numbered = tuple(f"joint{k}" for k in range(len(clip.joint_names)))
    expected = find_parts(plain.joint_names, plain.parents)
    told = {part: numbered[joint] for part, joint in expected.joints.items() if part != "pelvis"}
    assert find_parts(numbered, clip.parents, told) == expected, "the pelvis is where legs and arms part"


def test_names_that_are_no_limb_by_the_hierarchy_are_refused() -> None:
    swapped = {"LeftForeArm": "RightForeArm", "RightForeArm": "LeftForeArm"}
    clip = parse_bvh(renamed(swapped))
    with pytest.raises(RetargetError, match=r"'LeftForeArm' does not hang from 'LeftArm'.*It has: Hips, "):
        find_parts(clip.joint_names, clip.parents)
