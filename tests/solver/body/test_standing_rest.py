"""Which way is up where a file's rest pose and its poses say different things."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS

from tryon_solver.body import BodyModel, BvhClip, parse_bvh, quaternions, retarget
from tryon_solver.body.feet import floor
from tryon_solver.body.pose import skin
from tryon_solver.body.skeletons import SkeletonParts, find_parts
from tryon_solver.body.standing_rest import lying_or_standing, tilt, upward_axis, with_standing_rest

X, Y, Z = np.eye(3)
TURNS = {"Z": (X, 90.0), "-Z": (X, -90.0), "X": (Z, -90.0), "-X": (Z, 90.0), "-Y": (Z, 180.0)}


def turned_by_its_root(
    clip: BvhClip, axis: np.ndarray, degrees: float, moved: tuple[float, ...] = (0, 0, 0)
) -> BvhClip:
    """The clip turned as a whole through the channels of its root, and moved [m]: its rest pose stays as it is."""
    turn = quaternions.from_axis_angle(axis, np.radians(degrees))
    positions, rotations = clip.positions.copy(), clip.rotations.copy()
    positions[:, 0] = quaternions.rotate(turn, positions[:, 0]) + moved
    rotations[:, 0] = quaternions.multiply(turn, rotations[:, 0])
    return replace(clip, positions=positions, rotations=rotations)


def demo(name: str) -> BvhClip:
    return parse_bvh((DEMO_MOTIONS / f"{name}.bvh").read_text())


@pytest.mark.parametrize("up", TURNS)
@pytest.mark.parametrize("moved", [(0.0, 0.0, 0.0), pytest.param((7.0, 7.0, 7.0), marks=pytest.mark.long)])
def test_poses_of_another_up_axis_than_the_rest_pose_are_played_standing(
    body: BodyModel, up: str, moved: tuple[float, ...]
) -> None:
    """What converters of SMPL write: a skeleton that stands along Y, turned to Z up by its root in every frame."""
    clip = demo("walk")
    other = turned_by_its_root(clip, *TURNS[up], moved)
    parts = find_parts(clip.joint_names, clip.parents)
    assert upward_axis(other, parts) == (up, "from feet to shoulders in its poses")
    _, told = with_standing_rest(other, parts)
    assert told == f"its rest pose stands along Y, its poses along {up}: up is the poses'"
    one, same = retarget(clip, body), retarget(other, body)
    np.testing.assert_allclose(one.roots, same.roots, atol=1e-9)
    np.testing.assert_allclose(quaternions.to_matrix(one.rotations), quaternions.to_matrix(same.rotations), atol=1e-9)


@pytest.mark.parametrize("up", ["Z", "-Y", *(pytest.param(up, marks=pytest.mark.long) for up in ("-Z", "X", "-X"))])
def test_what_is_told_to_be_up_is_not_doubted(body: BodyModel, up: str) -> None:
    """Poses that lie along Y are played standing when Y is told not to be up, whatever poses and floor say."""
    clip = demo("walk")
    other = turned_by_its_root(clip, *TURNS[up], (7.0, 7.0, 7.0))
    parts = find_parts(clip.joint_names, clip.parents)
    told = up.lower()
    assert upward_axis(other, parts, told) == (up, "as told")
    same, as_found = retarget(other, body, up=told), retarget(other, body)
    np.testing.assert_array_equal(same.rotations, as_found.rotations)
    lying = retarget(other, body, up="y")  # the rest pose's axis: now the same poses lie
    assert with_standing_rest(other, parts, "y") == (other, "")
    trunk = quaternions.rotate(lying.rotations[:, 0], np.broadcast_to([0.0, 1.0, 0.0], (len(lying.roots), 3)))
    assert np.abs(trunk[:, 1]).max() < 0.5 if up != "-Y" else trunk[:, 1].max() < -0.5
    assert tilt(other, parts, "y") == 0.0


def test_a_rest_pose_is_turned_to_what_is_told_to_be_up() -> None:
    clip = demo("walk")
    parts = find_parts(clip.joint_names, clip.parents)
    turned, told = with_standing_rest(clip, parts, "z")
    assert told == "its rest pose stands along Y, up is as told, Z: it was turned upright"
    assert np.ptp(turned.rest_positions()[:, 2]) == pytest.approx(np.ptp(clip.rest_positions()[:, 1]))
    np.testing.assert_allclose(turned.world()[0], clip.world()[0], atol=1e-12)


def test_turning_the_rest_pose_leaves_every_joint_and_tip_where_it_is() -> None:
    other = turned_by_its_root(demo("squat"), X, 90.0)
    stood, _ = with_standing_rest(other, find_parts(other.joint_names, other.parents))
    assert stood is not other
    (before, turns), (after, turned) = other.world(), stood.world()
    np.testing.assert_allclose(after, before, atol=1e-12)
    for joint, tip in other.end_sites.items():
        there = quaternions.rotate(turned[:, joint], stood.end_sites[joint])
        np.testing.assert_allclose(there, quaternions.rotate(turns[:, joint], tip), atol=1e-12)


def test_a_tilt_is_told_of_poses_of_another_up_axis_too() -> None:
    other = turned_by_its_root(demo("walk"), X, 90.0 + 30.0)
    assert tilt(other, find_parts(other.joint_names, other.parents)) == pytest.approx(30.0, abs=5.0)


def test_who_lies_on_the_floor_all_along_goes_on_lying() -> None:
    """The floor, at zero along the axis of the rest pose and not along the poses', says that nobody stands here."""
    clip = turned_by_its_root(demo("turn"), X, 90.0)
    parts = find_parts(clip.joint_names, clip.parents)
    lowest = clip.world()[0][..., 1].min()
    lying = replace(clip, positions=clip.positions.copy())
    lying.positions[:, 0] += [0.0, 0.1 - lowest, -0.9]
    assert with_standing_rest(lying, parts) == (lying, "")
    assert upward_axis(lying, parts) == (
        "Y",
        "from feet to shoulders in its rest pose: in its poses the person lies along Z",
    )
    assert tilt(lying, parts) == 0.0


def lying_on_the_back(name: str, at: float) -> tuple[BvhClip, SkeletonParts]:
    """A demo motion done on the back, its root held; lowest `at` m above zero along both Y and the axis to the head."""
    clip = demo(name)
    turn = quaternions.from_axis_angle(X, np.radians(-90.0))
    positions, rotations = clip.positions.copy(), clip.rotations.copy()
    positions[:, 0] = 0.0
    rotations[:, 0] = quaternions.multiply(turn, rotations[:, 0])
    clip = replace(clip, positions=positions, rotations=rotations)
    joints = clip.world()[0]
    positions[:, 0] += [0.0, at - joints[..., 1].min(), -at - joints[..., 2].max()]
    return replace(clip, positions=positions), find_parts(clip.joint_names, clip.parents)


@pytest.mark.parametrize("at", [0.05, 0.6])
def test_who_lies_with_moving_legs_is_told_by_the_height_that_stays(body: BodyModel, at: float) -> None:
    """With the floor at zero along both axes, or along neither: on the back, on the ground or on a bed."""
    clip, parts = lying_on_the_back("squat", at)
    assert upward_axis(clip, parts)[0] == "Y"
    assert lying_or_standing(clip, parts) == (
        "the person is played lying, since its lowest joint stays at one height along Y; "
        "if it stands, with -Z up, --motion-up=-z tells"
    )
    assert lying_or_standing(clip, parts, "y") == ""
    played = retarget(clip, body)
    trunk = quaternions.rotate(played.rotations[:, 0], np.broadcast_to(Y, (played.frame_count, 3)))
    assert np.abs(trunk[:, 1]).max() < 0.7


def test_what_is_assumed_of_who_lies_or_stands_is_told_where_nothing_decides() -> None:
    """On the back or turned by its root, a jumping jack touches both a floor and the plane of its back all along."""
    clip, parts = lying_on_the_back("jumping_jack", 0.05)
    assert upward_axis(clip, parts)[0] == "-Z"
    assert lying_or_standing(clip, parts) == (
        "the person is played standing, as if its root turned it to another upward axis; "
        "if it lies, with Y up, --motion-up=y tells"
    )
    clip = demo("walk")
    assert lying_or_standing(clip, parts) == ""
    told = lying_or_standing(turned_by_its_root(clip, X, 90.0), parts)
    assert told.startswith("the person is played standing, since the floor is at zero along Z")


@pytest.mark.parametrize("name", ["walk", "turn", "squat", "jumping_jack"])
@pytest.mark.parametrize("up", [up for up in TURNS if up != "-Y"])
@pytest.mark.parametrize("floors", [(0.05, 0.05), (5.0, 5.0)])
def test_who_is_turned_to_another_up_axis_goes_on_standing(name: str, up: str, floors: tuple[float, float]) -> None:
    """With the floor at zero along both axes, or along neither."""
    clip = turned_by_its_root(demo(name), *TURNS[up])
    axis = TURNS[up][1] / 90.0 * np.cross(TURNS[up][0], Y)
    joints = clip.world()[0]
    moved = (floors[0] - (joints @ axis).min()) * axis + (floors[1] - joints[..., 1].min()) * Y
    clip.positions[:, 0] += moved
    parts = find_parts(clip.joint_names, clip.parents)
    assert upward_axis(clip, parts) == (up, "from feet to shoulders in its poses")


@pytest.mark.parametrize("height", [None, 7.0])
@pytest.mark.parametrize("standing", [0.0, 0.2])
def test_a_handstand_stays_one(body: BodyModel, height: float | None, standing: float) -> None:
    """All along or only at first, with the floor at zero or elsewhere: who is on the hands was not turned by a file."""
    clip = demo("jumping_jack")
    parts = find_parts(clip.joint_names, clip.parents)
    joints = clip.world()[0][..., 1]
    hands = joints[:, [parts.joints["left_hand"], parts.joints["right_hand"]]]
    raised = np.flatnonzero(hands.min(axis=1) > joints[:, parts.joints["head"]] + 0.1)[:20]
    upright = np.flatnonzero(hands.max(axis=1) < joints[:, parts.joints["head"]])[: round(standing * 25)]
    up = replace(clip, positions=clip.positions[raised], rotations=clip.rotations[raised])
    over = turned_by_its_root(up, X, 180.0, (0.0, joints[raised].max() if height is None else height, 0.0))
    after = clip.positions[upright].copy()
    after[:, 0] = over.positions[-1, 0]
    both = replace(
        over,
        positions=np.concatenate([over.positions, after]),
        rotations=np.concatenate([over.rotations, clip.rotations[upright]]),
        dt=0.1,  # time to come down in
    )
    assert with_standing_rest(both, parts) == (both, "")
    told = "from feet to shoulders in its rest pose: in most of its poses the person is upside down"
    assert upward_axis(both, parts) == ("Y", told)
    assert tilt(both, parts) == 0.0
    told = lying_or_standing(both, parts)
    assert told.startswith("the person is played upside down, since ")
    assert told.endswith("; if it stands, with -Y up, --motion-up=-y tells")
    played = retarget(both, body)
    world = quaternions.rotate(played.rotations[: len(raised), 0], np.broadcast_to(Y, (len(raised), 3)))
    assert (world[:, 1] < -0.7).all()
    if standing == 0.0:
        lowest = min(skin(body, played.pose(k))[:, 1].min() for k in range(played.frame_count))
        assert lowest == pytest.approx(0.0, abs=0.02), "on the floor, by the hands"


def test_who_is_upside_down_with_the_arms_along_the_trunk_has_the_head_on_the_floor(body: BodyModel) -> None:
    """Where it is told that the file means it; else it is played standing, which is told with what tells otherwise."""
    over = turned_by_its_root(demo("walk"), X, 180.0)
    parts = find_parts(over.joint_names, over.parents)
    assert lying_or_standing(over, parts) == (
        "the person is played standing, since the floor is at zero along -Y; "
        "if it is upside down, with Y up, --motion-up=y tells"
    )
    assert lying_or_standing(over, parts, "y") == ""
    played = retarget(over, body, up="y")
    lowest = min(skin(body, played.pose(k))[:, 1].min() for k in range(0, played.frame_count, 10))
    assert lowest == pytest.approx(0.0, abs=0.02)
    assert floor(body, played)[1] == "the floor is under its lowest part, the head, 0.67 m below its hands"
    assert floor(body, retarget(over, body))[1] == ""


def test_who_lies_and_then_gets_up_is_not_turned() -> None:
    """Without a floor at zero: who ever stands along the rest pose's axis has it for up."""
    clip = demo("turn")
    lying = turned_by_its_root(clip, X, 90.0, (0.0, 5.0, 5.0))
    standing = turned_by_its_root(clip, X, 0.0, (0.0, 5.0, 5.0))
    for stands, axis in ((0.0, "Z"), (0.2, "Y")):
        first = round(clip.frame_count * (1.0 - stands))
        both = replace(
            clip,
            positions=np.concatenate([lying.positions[:first], standing.positions[first:]]),
            rotations=np.concatenate([lying.rotations[:first], standing.rotations[first:]]),
        )
        assert upward_axis(both, find_parts(clip.joint_names, clip.parents))[0] == axis
