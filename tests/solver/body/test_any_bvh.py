"""Any BVH: units found, bones rolled any way, and every captured clip retargeted plausibly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS, shared_clips

from tryon_solver.body import BodyModel, BvhClip, BvhError, parse_bvh, quaternions, retarget, skin
from tryon_solver.body.bvh import find_units
from tryon_solver.body.feet import world_tracks
from tryon_solver.body.skeletons import find_parts
from tryon_solver.body.standing_rest import tilt, with_standing_rest

LIMBS = (("upper_arm", "forearm"), ("forearm", "hand"), ("thigh", "shin"), ("shin", "foot"))
CLIPS = sorted(DEMO_MOTIONS.glob("*.bvh")) + shared_clips()
CAPTURED = shared_clips()


def rolled(clip: BvhClip, seed: int) -> BvhClip:
    """The same motion on bones whose own axes are turned at random: its zero pose is a heap."""
    rng = np.random.default_rng(seed)
    rolls = quaternions.normalise(rng.normal(size=(len(clip.joint_names), 4)))
    positions, rotations = clip.world()
    world = quaternions.multiply(rotations, rolls)
    local, moved, offsets = world.copy(), positions.copy(), clip.offsets.copy()
    for joint, parent in enumerate(clip.parents):
        if parent >= 0:
            back = quaternions.conjugate(world[:, parent])
            local[:, joint] = quaternions.multiply(back, world[:, joint])
            moved[:, joint] = quaternions.rotate(back, positions[:, joint] - positions[:, parent])
            offsets[joint] = moved[0, joint]
    back = quaternions.conjugate(rolls)
    tips = {joint: quaternions.rotate(back[joint], tip) for joint, tip in clip.end_sites.items()}
    return replace(clip, offsets=offsets, end_sites=tips, positions=moved, rotations=local)


def largest_limb_angle(clip: BvhClip, motion, body: BodyModel) -> float:
    """Largest angle [degrees] between limbs of source and body over all frames, up to one yaw for the whole clip."""
    parts = find_parts(clip.joint_names, clip.parents).joints
    theirs, _ = clip.world()
    ours, _ = world_tracks(body, motion)
    a, b = [], []
    for side in ("left", "right"):
        for near, far in LIMBS:
            a.append(theirs[:, parts[f"{side}_{far}"]] - theirs[:, parts[f"{side}_{near}"]])
            b.append(ours[:, body.index_of[f"{side}_{far}"]] - ours[:, body.index_of[f"{side}_{near}"]])
    a, b = (np.array(v) / np.linalg.norm(v, axis=-1, keepdims=True) for v in (a, b))
    yaw = np.arctan2((a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]).sum(), (a[..., [0, 2]] * b[..., [0, 2]]).sum())
    turned = quaternions.rotate(quaternions.from_axis_angle(np.array([0.0, 1.0, 0.0]), yaw), a)
    return float(np.degrees(np.arccos(np.clip((turned * b).sum(-1), -1, 1))).max())


def lowest_soles(body: BodyModel, motion) -> np.ndarray:
    """Height [m] of the lowest point of the feet in every fourth frame."""
    feet = [k for k, name in enumerate(body.joint_names) if name.endswith(("_foot", "_toes"))]
    soles = np.isin(body.skin_joints[:, 0], feet)
    return np.array([skin(body, motion.pose(k))[soles, 1].min() for k in range(0, motion.frame_count, 4)])


def assert_plausible(clip: BvhClip, motion, body: BodyModel) -> None:
    assert np.isfinite(motion.roots).all()
    assert np.isfinite(motion.rotations).all()
    low = lowest_soles(body, motion)
    assert -0.01 < low.min() < 0.02, "the floor is where the lowest sole is"
    assert np.percentile(low, 25) < 0.05, "feet come down to the floor, over and over"
    ours, _ = world_tracks(body, motion)
    theirs, _ = clip.world()
    speeds = [float(np.linalg.norm(np.diff(x, axis=0), axis=2).max() / clip.dt) for x in (ours, theirs)]
    assert speeds[0] < 1.25 * speeds[1] + 0.3, "no joint is faster than the source's"
    turns = quaternions.multiply(quaternions.conjugate(motion.rotations[:-1]), motion.rotations[1:])
    assert np.degrees(quaternions.angle_of(turns)).max() < 40.0, "no joint flips over from frame to frame"


@pytest.mark.parametrize("path", CLIPS, ids=lambda path: path.stem)
def test_every_clip_is_retargeted_plausibly(body: BodyModel, path: Path) -> None:
    clip = parse_bvh(path.read_text(), None, path.stem)
    assert largest_limb_angle(clip, retarget(clip, body, 0.0, give=np.inf), body) < 3.0
    assert_plausible(clip, retarget(clip, body, 0.0), body)


@pytest.mark.long
@pytest.mark.parametrize("path", CLIPS, ids=lambda path: path.stem)
def test_bones_may_be_rolled_any_way(body: BodyModel, path: Path) -> None:
    """Limbs still point where the source's do, feet still stand: what counts is told by the poses, not by zero."""
    clip = rolled(parse_bvh(path.read_text(), None, path.stem), 5)
    assert largest_limb_angle(clip, retarget(clip, body, 0.0, give=np.inf), body) < 3.0
    assert_plausible(clip, retarget(clip, body, 0.0), body)


@pytest.mark.skipif(not CAPTURED, reason="no captured clips: set TRYON_SHARED_DATA to a folder that holds bvh/*.bvh")
def test_captured_clips_are_there() -> None:
    """Says, where they are missing, that the tests above ran on the demo's motions alone."""
    assert len(CAPTURED) >= 11


def test_a_rest_pose_that_stands_is_left_alone() -> None:
    clip = parse_bvh((DEMO_MOTIONS / "walk.bvh").read_text())
    same, note = with_standing_rest(clip, find_parts(clip.joint_names, clip.parents))
    assert same is clip
    assert note == ""


@pytest.mark.parametrize("path", CLIPS, ids=lambda path: path.stem)
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
def test_a_tilt_of_the_export_is_told_from_a_person_who_bends(path: Path, axis: tuple[float, ...]) -> None:
    """Nobody stands leaning as a whole; who squats, bends or touches the toes is not called tilted."""
    clip = parse_bvh(path.read_text())
    parts = find_parts(clip.joint_names, clip.parents)
    assert tilt(clip, parts) == 0.0
    if not path.stem.startswith(("walk", "turn", "twist", "jump")):
        return  # whose trunk leans by itself: a tilt that is added may straighten it
    turn = quaternions.from_axis_angle(np.array(axis), np.radians(30.0))
    positions, rotations = clip.positions.copy(), clip.rotations.copy()
    positions[:, 0] = quaternions.rotate(turn, positions[:, 0])
    rotations[:, 0] = quaternions.multiply(np.broadcast_to(turn, rotations[:, 0].shape), rotations[:, 0])
    assert tilt(replace(clip, positions=positions, rotations=rotations), parts) == pytest.approx(30.0, abs=5.0)


def test_a_heap_of_bones_is_replaced_by_a_frame_and_said() -> None:
    clip = rolled(parse_bvh((DEMO_MOTIONS / "squat.bvh").read_text()), 1)
    parts = find_parts(clip.joint_names, clip.parents)
    stood, note = with_standing_rest(clip, parts)
    assert "is taken for its rest pose" in note
    rest = stood.rest_positions()
    up = rest[parts.joints["head"]] - rest[parts.joints["left_foot"]]
    assert up[1] > 0.9 * np.linalg.norm(up)
    # the motion is the same: all distances between joints are
    a, b = clip.world()[0], stood.world()[0]
    apart = [np.linalg.norm(x[:, :, None] - x[:, None], axis=-1) for x in (a[::40], b[::40])]
    np.testing.assert_allclose(apart[0], apart[1], atol=1e-9)


@pytest.mark.parametrize(
    ("units", "name"),
    [(1.0, "metres"), (39.37, "inches"), (1 / 0.3048, "feet"), (1000.0, "millimetres"), (17.72, "ASF")],
)
def test_units_are_found_from_the_poses(units: float, name: str) -> None:
    text = (DEMO_MOTIONS / "walk.bvh").read_text()
    clip = parse_bvh(text)
    assert find_units(text)[:2] == (100.0, "centimetres")
    scaled = scaled_text(text, units / 100.0)
    found = find_units(scaled)
    assert found.per_metre == units
    assert name in found.name
    assert found.because.startswith("in which its bones measure 1.46 m from ankle to head")
    np.testing.assert_allclose(parse_bvh(scaled, None).positions, clip.positions, atol=2e-3)


def test_a_skeleton_of_no_size_is_refused() -> None:
    text = scaled_text((DEMO_MOTIONS / "walk.bvh").read_text(), 0.003)
    with pytest.raises(BvhError, match="in none of"):
        parse_bvh(text, None)


@pytest.mark.parametrize(
    ("tall", "taken", "otherwise"),
    [
        (0.62, "inches", "0.53 m in centimetres"),  # as likely a grown-up of 1.59 m
        (0.85, "centimetres", "1.86 m in inches"),
        (1.20, "centimetres", ""),
        (2.30, "centimetres", ""),
    ],
)
def test_a_child_is_no_giant_and_where_two_units_fit_the_other_is_told(tall: float, taken: str, otherwise: str) -> None:
    """Of somebody `tall` m from head to foot, in a file in centimetres."""
    found = find_units(scaled_text((DEMO_MOTIONS / "walk.bvh").read_text(), tall / 1.70))
    assert found.name == taken
    assert ("it could also be" in found.because) == bool(otherwise)
    assert otherwise in found.because
    assert not otherwise or found.because.endswith(": --motion-units tells")


@pytest.mark.parametrize(("units", "name"), [(1.0, "metres"), (1000.0, "millimetres")])
def test_a_child_in_metres_or_millimetres_is_read(units: float, name: str) -> None:
    text = scaled_text((DEMO_MOTIONS / "walk.bvh").read_text(), 0.5 * units / 100.0)
    assert find_units(text)[:2] == (units, name)
    assert np.ptp(parse_bvh(text, None).rest_positions(), axis=0).max() == pytest.approx(0.85, abs=0.06)


def test_the_unit_does_not_hang_on_where_the_scene_has_its_root() -> None:
    """The Bandai Namco data set: a joint at the origin carries hips that walk about, and start 4 m away."""
    text = (DEMO_MOTIONS / "walk.bvh").read_text()
    head, motion = text.removeprefix("HIERARCHY\n").split("MOTION\n")
    scene = "HIERARCHY\nROOT joint_Root\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
    lines = motion.splitlines()
    moved = [" ".join(["0 0 0 400", *line.split()[1:]]) for line in lines[2:]]
    text = "\n".join([scene + head.replace("ROOT", "JOINT", 1) + "}", "MOTION", *lines[:2], *moved])
    assert find_units(text)[:2] == (100.0, "centimetres")
    assert parse_bvh(text, None).positions[0, 1, 0] == pytest.approx(4.0)


def scaled_text(text: str, factor: float) -> str:
    """The file with all its lengths times `factor`."""
    lines, channels, column = [], [], 0
    for line in text.splitlines():
        words = line.split()
        if words[:1] == ["OFFSET"]:
            line = "OFFSET " + " ".join(repr(float(word) * factor) for word in words[1:])
        elif words[:1] == ["CHANNELS"]:
            channels += [column + k for k, word in enumerate(words[2:]) if word.endswith("position")]
            column += int(words[1])
        elif len(words) == column and column:
            values = [float(word) * (factor if k in channels else 1.0) for k, word in enumerate(words)]
            line = " ".join(repr(value) for value in values)
        lines.append(line)
    return "\n".join(lines)
