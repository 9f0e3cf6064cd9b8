"""Retargeting: limbs point where the source's point, whatever the rest pose, and errors name the joint."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS, shared_clips

from tryon_solver.body import BodyModel, BvhClip, RetargetError, parse_bvh, quaternions, retarget
from tryon_solver.body.feet import world_tracks
from tryon_solver.body.skeletons import find_parts

LIMBS = (("upper_arm", "forearm"), ("forearm", "hand"), ("thigh", "shin"), ("shin", "foot"))
DEMO_CLIPS = sorted(DEMO_MOTIONS.glob("*.bvh"))


def read(path: Path) -> BvhClip:
    return parse_bvh(path.read_text(), name=path.stem)


def largest_limb_angle(clip: BvhClip, body: BodyModel, limbs: tuple = LIMBS, clearance: float = 0.0) -> float:
    """Largest angle [degrees] between a limb of the source and the same limb of the body over all frames."""
    parts = find_parts(clip.joint_names, clip.parents).joints
    theirs, _ = clip.world()
    ours, _ = world_tracks(body, retarget(clip, body, clearance, give=np.inf))
    largest = 0.0
    for side in ("left", "right"):
        for near, far in limbs:
            a = theirs[:, parts[f"{side}_{far}"]] - theirs[:, parts[f"{side}_{near}"]]
            b = ours[:, body.index_of[f"{side}_{far}"]] - ours[:, body.index_of[f"{side}_{near}"]]
            sine, cosine = np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1)
            largest = max(largest, float(np.degrees(np.arctan2(sine, cosine)).max()))
    return largest


@pytest.mark.parametrize("path", DEMO_CLIPS, ids=lambda path: path.stem)
def test_limbs_of_our_motions_point_where_the_source_points(body: BodyModel, path: Path) -> None:
    assert largest_limb_angle(read(path), body) < 3.0


@pytest.mark.parametrize("path", DEMO_CLIPS, ids=lambda path: path.stem)
def test_arm_clearance_leaves_the_legs_alone(body: BodyModel, path: Path) -> None:
    assert largest_limb_angle(read(path), body, LIMBS[2:], clearance=30.0) < 3.0


def test_limbs_of_captured_motions_point_where_the_source_points(body: BodyModel) -> None:
    clips = shared_clips()
    if not clips:
        pytest.skip("no captured clips: set TRYON_SHARED_DATA to a folder that holds bvh/*.bvh")
    for path in clips:
        assert largest_limb_angle(read(path), body) < 3.0, path.name


def test_captured_skeletons_of_different_rest_poses_stand_on_flat_feet(body: BodyModel) -> None:
    clips = [path for path in shared_clips() if path.stem.startswith(("walk", "squat", "jump_balance", "cartwheel"))]
    if not clips:
        pytest.skip("no captured clips: set TRYON_SHARED_DATA to a folder that holds bvh/*.bvh")
    for path in clips:
        motion = retarget(read(path), body)
        positions, turns = world_tracks(body, motion)
        for side in ("left", "right"):
            foot = body.index_of[f"{side}_foot"]
            speed = np.linalg.norm(np.diff(positions[:, foot], axis=0), axis=1) / motion.dt
            standing = np.flatnonzero((speed < 0.08) & (positions[1:, foot, 1] < positions[:, foot, 1].min() + 0.03))
            if len(standing) > 5:
                sole = quaternions.rotate(turns[standing, foot], np.tile([0.0, 1.0, 0.0], (len(standing), 1)))
                assert np.degrees(np.arccos(np.median(sole[:, 1]))) < 12.0, f"{path.name}, {side}"


@pytest.mark.parametrize("path", DEMO_CLIPS, ids=lambda path: path.stem)
def test_motion_stands_on_the_floor_and_starts_over_the_origin(body: BodyModel, path: Path) -> None:
    motion = retarget(read(path), body)
    feet = [k for k, name in enumerate(body.joint_names) if name.endswith(("_foot", "_toes"))]
    soles = np.isin(body.skin_joints[:, 0], feet)
    lowest = min(float(_skin(body, motion, k)[soles, 1].min()) for k in range(0, motion.frame_count, 10))
    assert -0.004 < lowest < 0.012
    assert np.abs(motion.roots[0, [0, 2]]).max() < 0.05


def _skin(body: BodyModel, motion, frame: int) -> np.ndarray:
    from tryon_solver.body import skin

    return skin(body, motion.pose(frame))


def test_body_carrying_its_own_skeleton_comes_back_unchanged(body: BodyModel) -> None:
    """The body's own rig as the source, A pose and all: every joint must turn as it was told to."""
    rng = np.random.default_rng(7)
    frames = 3
    rotations = np.tile(quaternions.IDENTITY, (frames, body.joint_count, 1))
    for name in ("pelvis", "left_upper_arm", "right_thigh", "left_shin"):
        axis = rng.normal(size=3)
        turn = quaternions.from_axis_angle(axis / np.linalg.norm(axis), np.linspace(0.0, 0.6, frames))
        rotations[:, body.index_of[name]] = turn
    offsets = body.rest_joints.copy()
    offsets[1:] -= body.rest_joints[body.parents[1:]]
    positions = np.tile(offsets, (frames, 1, 1))
    clip = BvhClip(body.joint_names, body.parents, offsets, {}, positions, rotations, 1 / 60)
    _, expected = world_tracks(body, retarget(clip, body, arm_clearance_degrees=0.0))
    _, turns = clip.world()
    for name in ("pelvis", "spine_5", "head", "left_upper_arm_twist", "left_hand", "right_thigh_twist", "left_foot"):
        k = body.index_of[name]
        apart = quaternions.angle_of(quaternions.multiply(quaternions.conjugate(turns[:, k]), expected[:, k]))
        assert np.degrees(apart.max()) < 1.0, name


def leaning_at_rest(clip: BvhClip, degrees: float) -> BvhClip:
    """The same motion on a skeleton whose trunk leans back in the rest pose, and is turned forwards in every frame."""
    parts = find_parts(clip.joint_names, clip.parents)
    trunk = np.zeros(len(clip.joint_names), bool)
    trunk[[parts.joints["pelvis"], *parts.spine, *parts.clavicles.values()]] = True
    lean = quaternions.from_axis_angle(np.array([1.0, 0.0, 0.0]), -np.radians(degrees))
    _, world = clip.world()
    world[:, trunk] = quaternions.multiply(world[:, trunk], quaternions.conjugate(lean))
    local, offsets, positions = world.copy(), clip.offsets.copy(), clip.positions.copy()
    for joint, parent in enumerate(clip.parents):
        if parent >= 0:
            local[:, joint] = quaternions.multiply(quaternions.conjugate(world[:, parent]), world[:, joint])
            if trunk[parent]:
                offsets[joint] = quaternions.rotate(lean, offsets[joint])
                positions[:, joint] = quaternions.rotate(lean, positions[:, joint])
    return BvhClip(clip.joint_names, clip.parents, offsets, clip.end_sites, positions, local, clip.dt, clip.name)


def test_a_trunk_points_where_the_sources_points_however_it_leans_at_rest(body: BodyModel) -> None:
    clip = read(DEMO_MOTIONS / "squat.bvh")
    other = leaning_at_rest(clip, 12.0)
    np.testing.assert_allclose(other.world()[0], clip.world()[0], atol=1e-9)
    (places, turns), (found, turned) = (world_tracks(body, retarget(c, body, 0.0)) for c in (clip, other))
    kept = [k for k, name in enumerate(body.joint_names) if not name.startswith(("neck", "head"))]
    np.testing.assert_allclose(found[:, kept], places[:, kept], atol=5e-3)
    chest = body.index_of["spine_5"]
    apart = quaternions.angle_of(quaternions.multiply(quaternions.conjugate(turns[:, chest]), turned[:, chest]))
    assert np.degrees(apart.max()) < 1.0


@pytest.mark.long
def test_captured_people_stand_as_upright_as_they_stood(body: BodyModel) -> None:
    clips = shared_clips()
    if not clips:
        pytest.skip("no captured clips: set TRYON_SHARED_DATA to a folder that holds bvh/*.bvh")
    for path in clips:
        clip = read(path)
        parts = find_parts(clip.joint_names, clip.parents).joints
        theirs, _ = clip.world()
        ours, _ = world_tracks(body, retarget(clip, body))
        lines = []
        for places, index in ((theirs, parts), (ours, body.index_of)):
            ends = [[places[:, index[f"{s}_{j}"]] for s in ("left", "right")] for j in ("thigh", "upper_arm")]
            lines.append(np.mean(ends[1], axis=0) - np.mean(ends[0], axis=0))
        lines = [line / np.linalg.norm(line, axis=1, keepdims=True) for line in lines]
        tallest = lines[0][:, 1].argmax()
        away = np.degrees(np.arccos(lines[0][tallest] @ lines[1][tallest]))
        assert away < 4.0, f"{path.name}: {away:.1f} degrees"


def in_other_axes(clip: BvhClip, axis: tuple[float, float, float], degrees: float) -> BvhClip:
    """The clip turned: rest pose, bones and motion turned as a whole."""
    turn = quaternions.from_axis_angle(np.array(axis), np.radians(degrees))
    return BvhClip(
        clip.joint_names,
        clip.parents,
        quaternions.rotate(turn, clip.offsets),
        {joint: quaternions.rotate(turn, tip) for joint, tip in clip.end_sites.items()},
        quaternions.rotate(turn, clip.positions),
        quaternions.multiply(quaternions.multiply(turn, clip.rotations), quaternions.conjugate(turn)),
        clip.dt,
    )


def assert_same_motion(body: BodyModel, clip: BvhClip, other: BvhClip) -> None:
    one, same = retarget(clip, body), retarget(other, body)
    np.testing.assert_allclose(one.roots, same.roots, atol=1e-9)
    np.testing.assert_allclose(quaternions.to_matrix(one.rotations), quaternions.to_matrix(same.rotations), atol=1e-9)


def test_source_with_z_up_gives_the_same_motion(body: BodyModel) -> None:
    clip = read(DEMO_MOTIONS / "squat.bvh")
    assert_same_motion(body, clip, in_other_axes(clip, (1.0, 0.0, 0.0), 90.0))


@pytest.mark.parametrize(
    "degrees", [35.0, *(pytest.param(turned, marks=pytest.mark.long) for turned in (2.0, 45.0, -80.0, 170.0))]
)
def test_source_that_faces_any_way_at_rest_gives_the_same_motion(body: BodyModel, degrees: float) -> None:
    """Nobody walks crabwise: path and pelvis turn together, whatever the angle to the coordinate axes."""
    clip = read(DEMO_MOTIONS / "walk.bvh")
    assert_same_motion(body, clip, in_other_axes(clip, (0.0, 1.0, 0.0), degrees))


def test_arms_are_turned_out_to_the_clearance(body: BodyModel) -> None:
    clip = read(DEMO_MOTIONS / "turn.bvh")
    for clearance in (0.0, 40.0):
        positions, turns = world_tracks(body, retarget(clip, body, arm_clearance_degrees=clearance))
        shoulder, elbow = (positions[:, body.index_of[f"left_{name}"]] for name in ("upper_arm", "forearm"))
        chest = turns[:, body.index_of["spine_5"]]
        d = quaternions.rotate(quaternions.conjugate(chest), elbow - shoulder)
        angle = np.degrees(np.arctan2(d[:, 0], -d[:, 1]))
        assert angle.min() > clearance - 1.0 if clearance else angle.max() < 35.0


def test_twist_of_the_hand_is_spread_along_the_forearm(body: BodyModel) -> None:
    text = (DEMO_MOTIONS / "squat.bvh").read_text()
    clip = read(DEMO_MOTIONS / "squat.bvh")
    hand = clip.joint_names.index("LeftHand")
    twisted = clip.rotations.copy()
    axis = np.array([1.0, 0.0, 0.0])
    twisted[:, hand] = quaternions.multiply(quaternions.from_axis_angle(axis, 1.2), twisted[:, hand])
    other = BvhClip(
        clip.joint_names, clip.parents, clip.offsets, clip.end_sites, clip.positions, twisted, clip.dt, clip.name
    )
    assert text
    plain, turned = retarget(clip, body), retarget(other, body)
    _, before = world_tracks(body, plain)
    _, after = world_tracks(body, turned)

    def change(name: str) -> float:
        k = body.index_of[name]
        relative = quaternions.multiply(after[:, k], quaternions.conjugate(before[:, k]))
        return float(np.degrees(quaternions.angle_of(relative)).mean())

    whole = np.degrees(1.2)
    assert change("left_upper_arm_twist") < 1e-6
    assert change("left_forearm") == pytest.approx(whole / 3, abs=3.0)
    assert change("left_forearm_twist") == pytest.approx(2 * whole / 3, abs=3.0)
    assert change("left_hand") == pytest.approx(whole, abs=1e-6)


def names_of_3ds_max(prefix: str) -> dict[str, str]:
    """Patterns of our names -> those of a biped."""
    middle = {
        "Hips": "Pelvis",
        "Spine": "Spine",
        "Spine1": "Spine1",
        "Spine2": "Spine2",
        "Neck": "Neck",
        "Head": "Head",
    }
    limbs = {"Shoulder": "Clavicle", "Arm": "UpperArm", "ForeArm": "Forearm", "Hand": "Hand", "HandMiddle1": "Finger2"}
    limbs |= {"UpLeg": "Thigh", "Leg": "Calf", "Foot": "Foot", "ToeBase": "Toe0"}
    blank = prefix[-1]
    sided = {
        f"{side}{ours}": f"{side[0]}{blank}{theirs}" for side in ("Left", "Right") for ours, theirs in limbs.items()
    }
    return {rf"(?<=(?:ROOT|OINT) ){ours}$": prefix + theirs for ours, theirs in (middle | sided).items()}


def names_of_rigify(prefix: str) -> dict[str, str]:
    """Patterns of our names -> those of Blender's Rigify, whose pelvis is called spine and whose head spine.006."""
    middle = {"Hips": "spine", "Spine": "spine.001", "Spine1": "spine.002", "Spine2": "spine.003"}
    middle |= {"Neck": "spine.004", "Head": "spine.006"}
    limbs = {
        "Shoulder": "shoulder",
        "Arm": "upper_arm",
        "ForeArm": "forearm",
        "Hand": "hand",
        "HandMiddle1": "f_middle",
    }
    limbs |= {"UpLeg": "thigh", "Leg": "shin", "Foot": "foot", "ToeBase": "toe"}
    sided = {f"{side}{ours}": f"{theirs}.{side[0]}" for side in ("Left", "Right") for ours, theirs in limbs.items()}
    return {rf"(?<=(?:ROOT|OINT) ){ours}$": prefix + theirs for ours, theirs in (middle | sided).items()}


@pytest.mark.parametrize(
    ("convention", "renamed"),
    [
        ("Mixamo", {r"\b(Hips|Spine\d?|Neck|Head|Left\w+|Right\w+)\b": r"mixamorig:\1"}),
        (
            "SMPL",
            {
                r"\bHips\b": "pelvis",
                r"\b(Left|Right)Shoulder\b": r"\1_collar",
                r"\b(Left|Right)Arm\b": r"\1_shoulder",
                r"\b(Left|Right)ForeArm\b": r"\1_elbow",
                r"\b(Left|Right)Hand\b": r"\1_wrist",
                r"\b(Left|Right)UpLeg\b": r"\1_hip",
                r"\b(Left|Right)Leg\b": r"\1_knee",
                r"\b(Left|Right)Foot\b": r"\1_ankle",
                r"\b(Left|Right)ToeBase\b": r"\1_foot",
            },
        ),
        ("3ds Max biped", names_of_3ds_max("Bip01 ")),
        ("3ds Max biped, underscores", names_of_3ds_max("Bip001_")),
        ("Rigify", names_of_rigify("")),
        ("Rigify's deforming bones", names_of_rigify("DEF-")),
        (
            "Unity",
            {
                r"\b(Left|Right)(Arm|Leg)\b": r"\1Lower\2",
                r"\b(Left|Right)LowerArm\b": r"\1UpperArm",
                r"\b(Left|Right)ForeArm\b": r"\1LowerArm",
                r"\b(Left|Right)UpLeg\b": r"\1UpperLeg",
                r"\b(Left|Right)ToeBase\b": r"\1Toes",
            },
        ),
        ("a root of another name", {r"\bHips\b": "Character1_Reference"}),
    ],
)
def test_other_naming_conventions_give_the_same_motion(body: BodyModel, convention: str, renamed: dict) -> None:
    text = (DEMO_MOTIONS / "squat.bvh").read_text()
    other = text
    for pattern, replacement in renamed.items():
        other = re.sub(pattern, replacement, other, flags=re.MULTILINE)
    assert other != text, convention
    np.testing.assert_allclose(
        retarget(parse_bvh(other), body).rotations, retarget(parse_bvh(text), body).rotations, atol=1e-12
    )


def test_a_root_without_the_trunk_is_not_taken_for_the_pelvis() -> None:
    clip = read(DEMO_MOTIONS / "squat.bvh")
    names = tuple("Middle" if name == "Hips" else name for name in clip.joint_names)
    assert find_parts(names, clip.parents).joints["pelvis"] == 0
    apart = clip.parents.copy()
    apart[clip.joint_names.index("LeftUpLeg")] = -1
    with pytest.raises(RetargetError, match="lacks a joint for: pelvis"):
        find_parts(names, apart)


def test_missing_joint_is_named_with_what_was_expected(body: BodyModel) -> None:
    clip = parse_bvh((DEMO_MOTIONS / "squat.bvh").read_text().replace("LeftForeArm", "Gizmo"))
    with pytest.raises(RetargetError, match=r"left_forearm \(expected 'LeftForeArm'\).*It has: Hips, .*Gizmo"):
        retarget(clip, body)


def test_odd_name_can_be_told(body: BodyModel) -> None:
    text = (DEMO_MOTIONS / "squat.bvh").read_text()
    clip = parse_bvh(text.replace("LeftForeArm", "Gizmo"))
    told = retarget(clip, body, names={"left_forearm": "Gizmo"})
    np.testing.assert_array_equal(told.rotations, retarget(parse_bvh(text), body).rotations)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ({"tail": "Hips"}, "no part is called 'tail'"),
        ({"head": "Skull"}, "head is told to be 'Skull', which is no joint"),
        ({"left_hand": "LeftHand", "right_hand": "LeftHand"}, "told to be left_hand and right_hand, which are not one"),
    ],
)
def test_wrong_names_are_refused(body: BodyModel, names: dict[str, str], message: str) -> None:
    with pytest.raises(RetargetError, match=message):
        retarget(read(DEMO_MOTIONS / "squat.bvh"), body, names=names)


def test_limb_without_length_is_refused(body: BodyModel) -> None:
    text = (DEMO_MOTIONS / "squat.bvh").read_text()
    assert text.count("OFFSET 28.0000 0.0000 0.0000") == 1
    with pytest.raises(RetargetError, match=r"'LeftArm' and 'LeftForeArm' are at one place"):
        retarget(parse_bvh(text.replace("OFFSET 28.0000 0.0000 0.0000", "OFFSET 0 0 0")), body)


def test_a_body_that_is_elsewhere_in_the_next_frame_is_refused_by_the_frame(body: BodyModel) -> None:
    clip = read(DEMO_MOTIONS / "squat.bvh")
    away = clip.positions.copy()
    away[40:, 0, 0] += 2.0
    with pytest.raises(RetargetError, match=r"from frame 40 to frame 41 the pelvis jumps 2 m in 0\.0167 s"):
        retarget(replace(clip, positions=away), body)
    leap = clip.positions.copy()
    leap[40:, 0, 0] += 0.25
    assert retarget(replace(clip, positions=leap), body).frame_count == clip.frame_count
    slow = replace(clip, positions=away[[0, 39, 40]], rotations=clip.rotations[[0, 39, 40]], dt=0.3)
    assert retarget(slow, body).frame_count == 3


def test_other_rig_is_refused_by_its_missing_joint(finger: BodyModel) -> None:
    with pytest.raises(RetargetError, match="the body lacks the joint 'pelvis'"):
        retarget(read(DEMO_MOTIONS / "squat.bvh"), finger)
