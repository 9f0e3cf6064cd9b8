"""The posed body against the formula written out with 4x4 matrices, vertex by vertex."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tryon_protocol import BodySurface, Skinner


def random_body(rng: np.random.Generator, vertices: int, joints: int, influences: int) -> BodySurface:
    weights = rng.random((vertices, influences)) * (rng.random((vertices, influences)) < 0.6)
    weights[np.arange(vertices), rng.integers(0, influences, vertices)] += 0.2
    return BodySurface(
        rest_vertices=rng.normal(size=(vertices, 3)).astype(np.float32),
        faces=np.zeros((0, 3), dtype=np.uint32),
        joint_names=tuple(f"joint{j}" for j in range(joints)),
        parents=np.array([-1] + [int(rng.integers(0, j)) for j in range(1, joints)], dtype=np.int32),
        rest_joints=rng.normal(size=(joints, 3)).astype(np.float32),
        skin_joints=rng.integers(0, joints, (vertices, influences)).astype(np.uint16),
        skin_weights=(weights / weights.sum(axis=1, keepdims=True)).astype(np.float32),
    )


def translation(offset: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def turn(quaternion: np.ndarray) -> np.ndarray:
    """Rotation matrix column by column: each axis turned as q e q*."""
    vector, scalar = quaternion[:3], quaternion[3]
    matrix = np.eye(4)
    for axis in range(3):
        e = np.eye(3)[axis]
        matrix[:3, axis] = e + 2 * scalar * np.cross(vector, e) + 2 * np.cross(vector, np.cross(vector, e))
    return matrix


def reference(body: BodySurface, root: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """v = sum_k w_k world_from_joint[j_k] inverse(translation by the rest joint) v_rest."""
    rest = body.rest_joints.astype(np.float64)
    world: list[np.ndarray] = []
    for joint, parent in enumerate(body.parents):
        local = translation(root if parent < 0 else rest[joint] - rest[parent]) @ turn(rotations[joint])
        world.append(local if parent < 0 else world[parent] @ local)
    posed = np.zeros((len(body.rest_vertices), 4))
    for vertex, place in enumerate(np.c_[body.rest_vertices.astype(np.float64), np.ones(len(posed))]):
        for joint, weight in zip(body.skin_joints[vertex], body.skin_weights[vertex].astype(np.float64)):
            posed[vertex] += weight * (world[joint] @ translation(-rest[joint]) @ place)
    return posed[:, :3]


@given(st.integers(0, 2**31), st.integers(1, 12), st.integers(1, 5))
def test_posed_surface_is_the_formula(seed: int, joints: int, influences: int) -> None:
    rng = np.random.default_rng(seed)
    body = random_body(rng, 17, joints, influences)
    rotations = rng.normal(size=(joints, 4))
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    root = rng.normal(size=3)
    expected = reference(body, root, rotations)
    # float32 weights sum to 1 within 1e-7 only, and the documented formula adds the root outside the sum.
    np.testing.assert_allclose(Skinner(body).pose(root, rotations), expected, atol=1e-6)


def test_the_rest_pose_is_the_rest_surface_moved_to_the_root() -> None:
    body = random_body(np.random.default_rng(1), 40, 6, 3)
    root = np.array([3.0, -2.0, 1.0])
    rest = np.tile([0.0, 0.0, 0.0, 1.0], (6, 1))
    expected = body.rest_vertices - body.rest_joints[0] + root
    np.testing.assert_allclose(Skinner(body).pose(root, rest), expected, atol=1e-6)


def test_a_distant_root_costs_no_precision() -> None:
    body = random_body(np.random.default_rng(2), 40, 6, 3)
    rotations = np.tile([0.6, 0.0, 0.0, 0.8], (6, 1))
    near, far = np.zeros(3), np.array([65536.0, 0.0, -65536.0])
    skinner = Skinner(body)
    np.testing.assert_allclose(skinner.pose(far, rotations) - far, skinner.pose(near, rotations), atol=1e-10)


def test_a_pose_leaves_nothing_behind_for_the_next() -> None:
    body = random_body(np.random.default_rng(3), 40, 6, 3)
    skinner = Skinner(body)
    rest = np.tile([0.0, 0.0, 0.0, 1.0], (6, 1))
    first = skinner.pose(np.zeros(3), rest)
    kept = first.copy()
    skinner.pose(np.ones(3), np.tile([0.0, 0.6, 0.0, 0.8], (6, 1)))
    np.testing.assert_array_equal(first, kept)
    np.testing.assert_array_equal(skinner.pose(np.zeros(3), rest), kept)
