"""Forward kinematics and linear blend skinning by hand, their invariances, and the refusal of bad poses."""

from __future__ import annotations

import numpy as np
import pytest
from body_cases import random_pose
from scipy.spatial.transform import Rotation

from tryon_solver.body import BodyModel, Pose, PoseError, quaternions, skin, world_from_joint
from tryon_solver.body.pose import world_from_rest
from tryon_solver.geometry import rigid

QUARTER_ABOUT_Z = quaternions.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.pi / 2)


def test_rest_pose_returns_the_rest_vertices(body: BodyModel) -> None:
    np.testing.assert_allclose(skin(body, Pose.rest(body)), body.rest_vertices, atol=2e-7)


def test_bent_finger_by_hand(finger: BodyModel) -> None:
    pose = Pose(np.array([0.0, 0.0, 0.0]), np.stack([quaternions.IDENTITY, QUARTER_ABOUT_Z]))
    # the tip turns about (0, 1, 0): (x, y) -> (-(y - 1), 1 + x); the second vertex blends half of both
    expected = [[0.5, 0.5, 0.0], [0.25, 1.25, 0.0], [-0.5, 1.5, 0.0], [-1.0, 1.0, 0.5]]
    np.testing.assert_allclose(skin(finger, pose), expected, atol=1e-7)


def test_turned_base_carries_the_tip_by_hand(finger: BodyModel) -> None:
    pose = Pose(np.array([10.0, 0.0, 0.0]), np.stack([QUARTER_ABOUT_Z, quaternions.IDENTITY]))
    transforms = world_from_joint(finger, pose)
    np.testing.assert_allclose(transforms[0, :3, 3], [10.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(transforms[1, :3, 3], [9.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(skin(finger, pose)[2], [8.5, 0.5, 0.0], atol=1e-7)


def test_skinning_follows_the_definition_literally(body: BodyModel) -> None:
    pose = random_pose(body, 3)
    transforms = world_from_joint(body, pose)
    expected = np.zeros((200, 3))
    for b in range(200):
        for joint, weight in zip(body.skin_joints[b], body.skin_weights[b]):
            to_joint = np.eye(4)
            to_joint[:3, 3] = -body.rest_joints[joint]
            expected[b] += weight * (transforms[joint] @ to_joint @ [*body.rest_vertices[b], 1.0])[:3]
    np.testing.assert_allclose(skin(body, pose)[:200], expected, atol=1e-12)


def test_moving_the_root_moves_the_whole_body_rigidly(body: BodyModel) -> None:
    pose = random_pose(body, 1)
    turn = Rotation.random(rng=np.random.default_rng(2))
    step = np.array([1.0, -2.0, 0.5])
    rotations = pose.rotations.copy()
    rotations[0] = quaternions.multiply(turn.as_quat(), rotations[0])
    moved = Pose(turn.apply(pose.root) + step, rotations)
    np.testing.assert_allclose(skin(body, moved), turn.apply(skin(body, pose)) + step, atol=1e-6)


def test_joints_keep_their_bone_lengths_in_any_pose(body: BodyModel) -> None:
    positions = world_from_joint(body, random_pose(body, 4))[:, :3, 3]
    for places in (positions, body.rest_joints):
        assert np.isfinite(places).all()
    lengths = np.linalg.norm(positions[1:] - positions[body.parents[1:]], axis=1)
    expected = np.linalg.norm(body.rest_joints[1:] - body.rest_joints[body.parents[1:]], axis=1)
    np.testing.assert_allclose(lengths, expected, atol=1e-12)


def test_rest_transforms_fix_their_joint(body: BodyModel) -> None:
    pose = random_pose(body, 5)
    carried = world_from_rest(body, pose) @ np.append(body.rest_joints, np.ones((body.joint_count, 1)), 1)[..., None]
    np.testing.assert_allclose(carried[:, :3, 0], world_from_joint(body, pose)[:, :3, 3], atol=1e-12)


def test_interpolation_ends_halves_and_takes_the_shorter_arc(finger: BodyModel) -> None:
    start = Pose.rest(finger)
    end = Pose(np.array([2.0, 0.0, 0.0]), np.stack([-QUARTER_ABOUT_Z, quaternions.IDENTITY]))
    np.testing.assert_allclose(skin(finger, Pose.interpolate(start, end, 0.0)), skin(finger, start), atol=1e-12)
    np.testing.assert_allclose(skin(finger, Pose.interpolate(start, end, 1.0)), skin(finger, end), atol=1e-12)
    half = Pose.interpolate(start, end, 0.5)
    np.testing.assert_allclose(half.root, [1.0, 0.0, 0.0])
    assert quaternions.angle_of(half.rotations[0]) == pytest.approx(np.pi / 4)


def test_valid_pose_passes(body: BodyModel) -> None:
    random_pose(body, 6).validate(body)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_rotation_that_is_not_finite_is_refused_by_joint(body: BodyModel, bad: float) -> None:
    pose = Pose.rest(body)
    pose.rotations[body.index_of["left_forearm"], 2] = bad
    with pytest.raises(PoseError, match=r"joint 'left_forearm' .*last good rotation"):
        pose.validate(body)


@pytest.mark.parametrize("scale", [0.0, 0.9, 1.01])
def test_quaternion_that_is_not_unit_is_refused_by_joint(body: BodyModel, scale: float) -> None:
    pose = Pose.rest(body)
    pose.rotations[body.index_of["head"]] *= scale
    with pytest.raises(PoseError, match=r"joint 'head' has a quaternion of length .*unit quaternions"):
        pose.validate(body)


def test_missing_joint_is_named(body: BodyModel) -> None:
    pose = Pose(np.zeros(3), Pose.rest(body).rotations[:-1])
    with pytest.raises(PoseError, match=r"37 rotations, the body has 38 joints; the first without one is 'right_toes'"):
        pose.validate(body)


@pytest.mark.parametrize("shape", [(38, 3), (39, 4), (38,)])
def test_wrong_shape_of_rotations_is_refused(body: BodyModel, shape: tuple[int, ...]) -> None:
    with pytest.raises(PoseError, match="shape"):
        Pose(np.zeros(3), np.ones(shape)).validate(body)


def test_root_that_is_not_finite_is_refused(body: BodyModel) -> None:
    with pytest.raises(PoseError, match="root position"):
        Pose(np.array([0.0, np.nan, 0.0]), Pose.rest(body).rotations).validate(body)


def test_the_inverse_of_a_rigid_transform_takes_back_what_it_does(body: BodyModel) -> None:
    there = world_from_rest(body, random_pose(body, 5))
    back = rigid.inverse(there)
    assert np.abs(back - np.linalg.inv(there)).max() < 1e-12
    np.testing.assert_allclose(back @ there, np.broadcast_to(np.eye(4), there.shape), atol=1e-12)
