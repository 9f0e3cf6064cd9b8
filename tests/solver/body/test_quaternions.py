"""Quaternion algebra against scipy's rotations."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from tryon_solver.body import quaternions

seeds = st.integers(0, 2**32 - 1)


def random_rotations(seed: int, count: int) -> tuple[Rotation, np.ndarray]:
    rotations = Rotation.random(count, rng=np.random.default_rng(seed))
    return rotations, rotations.as_quat()


@settings(max_examples=25)
@given(seeds)
def test_product_matrix_and_action_agree_with_scipy(seed: int) -> None:
    (p, qp), (r, qr) = random_rotations(seed, 4), random_rotations(seed + 1, 4)
    v = np.random.default_rng(seed).normal(size=(4, 3))
    np.testing.assert_allclose(quaternions.to_matrix(quaternions.multiply(qp, qr)), (p * r).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(quaternions.rotate(qp, v), p.apply(v), atol=1e-12)
    np.testing.assert_allclose(quaternions.rotate(quaternions.conjugate(qp), p.apply(v)), v, atol=1e-12)


@settings(max_examples=25)
@given(seeds, st.floats(0.0, 1.0))
def test_slerp_agrees_with_scipy_and_ignores_the_sign(seed: int, t: float) -> None:
    rotations, (a, b) = random_rotations(seed, 2)
    expected = Slerp([0.0, 1.0], rotations)(t).as_matrix()
    for other in (b, -b):
        np.testing.assert_allclose(quaternions.to_matrix(quaternions.slerp(a, other, t)), expected, atol=1e-9)


def test_slerp_of_nearly_equal_rotations_keeps_unit_length_and_ends() -> None:
    a = quaternions.IDENTITY
    b = quaternions.from_axis_angle(np.array([0.0, 1.0, 0.0]), 1e-9)
    np.testing.assert_allclose(quaternions.slerp(a, b, 1.0), b, atol=1e-15)
    assert abs(np.linalg.norm(quaternions.slerp(a, b, 0.3)) - 1.0) < 1e-15


@settings(max_examples=25)
@given(seeds)
def test_twist_is_about_the_axis_and_the_rest_is_a_swing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    _, q = random_rotations(seed, 3)
    twist = quaternions.twist_about(q, axis)
    swing = quaternions.multiply(q, quaternions.conjugate(twist))
    np.testing.assert_allclose(quaternions.rotate(twist, np.tile(axis, (3, 1))), np.tile(axis, (3, 1)), atol=1e-12)
    np.testing.assert_allclose(swing[:, :3] @ axis, 0.0, atol=1e-12)


def test_between_takes_one_direction_to_the_other_even_when_opposite() -> None:
    for a, b in (([1, 0, 0], [0, 0, 2]), ([0, 3, 0], [0, -1, 0]), ([1, 1, 0], [1, 1, 0])):
        turned = quaternions.rotate(quaternions.between(np.array(a, float), np.array(b, float)), np.array(a, float))
        np.testing.assert_allclose(turned / np.linalg.norm(turned), np.array(b) / np.linalg.norm(b), atol=1e-12)


def test_continuous_keeps_rotations_and_removes_sign_jumps() -> None:
    angles = np.linspace(0.0, 4.0 * np.pi, 50)
    q = quaternions.from_axis_angle(np.array([0.0, 0.0, 1.0]), angles)
    q[10:20] *= -1.0
    smooth = quaternions.continuous(q)
    assert (np.linalg.norm(np.diff(smooth, axis=0), axis=1) < 0.2).all()
    np.testing.assert_allclose(quaternions.to_matrix(smooth), quaternions.to_matrix(q), atol=1e-12)
