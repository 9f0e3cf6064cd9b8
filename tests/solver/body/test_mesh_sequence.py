"""A sequence of meshes: exact at its frames, turning between them, rigid parts found."""

import numpy as np
import pytest
import warp as wp

from tryon_solver.body import BodyError, quaternions
from tryon_solver.body.mesh_sequence import Moment, make_sequence


def bar(angle):
    """A long box along x, hinged at x = 0.5: its far half is turned about z by `angle`."""
    x, y, z = np.meshgrid(np.linspace(0, 1, 41), [0, 0.05, 0.1], [0, 0.05, 0.1], indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    turn = quaternions.from_axis_angle(np.array([0.0, 0.0, 1.0]), angle)
    far = points[:, 0] > 0.5
    moved = points.copy()
    hinge = np.array([0.5, 0.0, 0.0])
    moved[far] = hinge + quaternions.rotate(np.tile(turn, (far.sum(), 1)), points[far] - hinge)
    return moved, far


def faces():
    """Enough triangles to say who is next to whom."""
    index = np.arange(41 * 9).reshape(41, 9)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])


@pytest.fixture(scope="module")
def sequence():
    frames = np.stack([bar(angle)[0] + [0, 0, 0.1 * k] for k, angle in enumerate(np.linspace(0, 1.5, 4))])
    return frames, make_sequence(frames, faces(), 0.1)


def test_frames_are_met_exactly(sequence):
    frames, made = sequence
    for k in range(4):
        np.testing.assert_allclose(made.surface(Moment(0.1 * k, np.zeros(3))), frames[k], atol=1e-6)


def test_between_frames_a_limb_turns(sequence):
    """Straight lines between frames half a radian apart would shorten the far half by 3 %."""
    _, made = sequence
    _, far = bar(0.0)
    tip = np.flatnonzero(far)[-1]
    hinge = np.array([0.5, 0, 0])
    reach = np.linalg.norm(bar(0.0)[0][tip] - hinge)
    x = made.surface(Moment(0.15, np.zeros(3)))[tip] - hinge - [0, 0, 0.15]
    assert np.linalg.norm(x) == pytest.approx(reach, rel=2e-3)
    straight = 0.5 * (bar(0.5)[0][tip] + bar(1.0)[0][tip]) - hinge
    assert np.linalg.norm(straight) < 0.98 * reach


def test_parts_turn_as_the_bar_does(sequence):
    """A vertex well within a half moves with parts that turn as that half turns."""
    _, made = sequence
    points, far = bar(0.0)
    turned = quaternions.angle_of(
        quaternions.multiply(quaternions.conjugate(made.rotations[0]), made.rotations[3])
    )
    part = made.skin_joints[np.arange(len(points)), made.skin_weights.argmax(axis=1)]
    away = np.abs(points[:, 0] - 0.5) > 0.15
    np.testing.assert_allclose(turned[part[away & far]], 1.5, atol=0.02)
    np.testing.assert_allclose(turned[part[away & ~far]], 0.0, atol=0.02)


def test_weights_sum_to_one_and_the_whole_carries_nothing(sequence):
    _, made = sequence
    np.testing.assert_allclose(made.skin_weights.sum(axis=1), 1.0, atol=1e-6)
    assert not (made.skin_joints == 0).any()


def test_the_kernel_equals_the_reference(sequence):
    _, made = sequence
    moving = made.on_device("cpu")
    moment = Moment(0.17, np.array([1.0, 2.0, 3.0]))
    out = wp.full(made.vertex_count, wp.vec3(np.nan, np.nan, np.nan), dtype=wp.vec3, device="cpu")
    moving.take(moving.transforms(moment), moment)
    moving.write(out)
    np.testing.assert_allclose(out.numpy(), made.surface(moment), atol=1e-6)


def test_seen_from_elsewhere_the_surface_moves_along(sequence):
    """What move_body asks for: the stance's surface where another rigid motion puts it."""
    _, made = sequence
    moving = made.on_device("cpu")
    moment = moving.between(Moment(0.0, np.zeros(3)), Moment(0.2, np.zeros(3)), 0.4)
    motion = np.eye(4)
    motion[:3, :3] = quaternions.to_matrix(quaternions.normalise(np.array([0.1, 0.5, 0.2, 0.8])))
    motion[:3, 3] = [0.3, -0.2, 0.1]
    out = wp.full(made.vertex_count, wp.vec3(np.nan, np.nan, np.nan), dtype=wp.vec3, device="cpu")
    moving.take(motion @ moving.transforms(moment), moment)
    moving.write(out)
    expected = made.surface(moment) @ motion[:3, :3].T + motion[:3, 3]
    np.testing.assert_allclose(out.numpy(), expected, atol=1e-6)


def test_it_stands_before_and_after_and_is_not_looped(sequence):
    _, made = sequence
    assert made.sample(-1.0).time == 0.0
    assert made.sample(9.0).time == pytest.approx(0.3)
    with pytest.raises(BodyError, match=r"lasts 0\.30 s"):
        made.sample(0.4, loop=True)


def test_a_frame_with_a_hole_in_its_numbers_is_refused():
    frames = np.stack([bar(0.0)[0]] * 3)
    frames[2, 5, 1] = np.nan
    with pytest.raises(BodyError, match="frame 2"):
        make_sequence(frames, faces(), 0.1)
