"""The carry field against its definition in float64, and against closed forms."""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.body import quaternions
from tryon_solver.body.carry import SHARPNESS, Carry

FULL, NONE = 0.015, 0.06  # m
JOINTS, SKIN, CLOTH, INFLUENCES = 7, 300, 200, 3


class Case:
    """Skin on a patch 0.3 m wide, a metre and more from the origin, and cloth from 0 to 0.12 m above it."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.surface = self.places(SKIN, 0.0, 0.0)
        self.cloth = self.places(CLOTH, 0.0, 0.12)
        self.joints = self.random.integers(0, JOINTS, (SKIN, INFLUENCES)).astype(np.int32)
        weights = self.random.dirichlet(np.ones(INFLUENCES), SKIN)
        self.weights = weights.astype(np.float32)

    def places(self, count: int, lowest: float, highest: float) -> np.ndarray:
        """(count, 3) m, exact in float32."""
        low, high = [1.0, 1.5 + lowest, -0.7], [1.3, 1.5 + highest, -0.4]
        return self.random.uniform(low, high, (count, 3)).astype(np.float32).astype(np.float64)

    def motions(self) -> np.ndarray:
        """(J, 4, 4): turns of up to 0.3 rad about places near the patch."""
        axis = self.random.normal(size=(JOINTS, 3))
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        turn = quaternions.to_matrix(quaternions.from_axis_angle(axis, self.random.uniform(-0.3, 0.3, JOINTS)))
        centre = self.places(JOINTS, -0.1, 0.1)
        motions = np.tile(np.eye(4), (JOINTS, 1, 1))
        motions[:, :3, :3] = turn
        motions[:, :3, 3] = centre - (turn @ centre[..., None])[..., 0]
        return motions

    def field(self, motions: np.ndarray, x: np.ndarray, device: str) -> tuple[np.ndarray, np.ndarray]:
        """u (N, 3) m at x (N, 3) m, weighted by the distances at `cloth`, and the skin's marks (B,)."""
        carry = Carry.build(CLOTH, self.joints, self.weights, JOINTS, device)
        begun = wp.array(np.vstack([self.cloth, self.surface]), dtype=wp.vec3, device=device)
        now = wp.array(np.vstack([x, self.surface + 1.0]), dtype=wp.vec3, device=device)
        found = wp.zeros_like(now)
        carry.set_places(begun, NONE)
        carry.take(np.full((4, 4), 7.0), motions)  # the root's is not the field's
        carry.fetch()
        carry.find_field(now, FULL, NONE, found)
        assert not found.numpy()[CLOTH:].any()
        return found.numpy()[:CLOTH], carry.near.numpy()

    def distances(self) -> np.ndarray:
        """(N, B) m between cloth and surface."""
        return np.linalg.norm(self.cloth[:, None] - self.surface[None], axis=2)


def skinning_weights(case: Case) -> np.ndarray:
    """(N, J) W of the field, rows sum to one: joint by joint, as it is defined."""
    d = case.distances()
    w = np.where(d < NONE, (1.0 - d / NONE) ** 2 / (d**2 + SHARPNESS**2) ** 2, 0.0)
    of_skin = np.zeros((SKIN, JOINTS))
    np.add.at(of_skin, (np.arange(SKIN)[:, None], case.joints), case.weights.astype(np.float64))
    t = np.clip((NONE - d.min(axis=1)) / (NONE - FULL), 0.0, 1.0)
    share = t * t * (3.0 - 2.0 * t)
    total = w.sum(axis=1)
    result = (share / np.where(total > 0.0, total, 1.0))[:, None] * (w @ of_skin)
    result[:, 0] += 1.0 - share
    return result


def moved(motions: np.ndarray, x: np.ndarray) -> np.ndarray:
    """(J, N, 3) m: A_j x - x."""
    return np.einsum("jxy,ny->jnx", motions[:, :3, :3], x) + motions[:, None, :3, 3] - x


def test_field_is_the_joints_motions_weighted_as_the_skin_around_is(device: str) -> None:
    for seed in (1, 2):
        case = Case(seed)
        motions, x = case.motions(), case.cloth + case.places(CLOTH, 0.0, 0.0) - [1.0, 1.5, -0.7]
        weights = skinning_weights(case)
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
        found, _ = case.field(motions, x, device)
        np.testing.assert_allclose(found, np.einsum("nj,jnx->nx", weights, moved(motions, x)), atol=2e-7)


def test_one_motion_of_all_joints_carries_everything_rigidly(device: str) -> None:
    case = Case(3)
    motions = np.tile(case.motions()[2], (JOINTS, 1, 1))
    found, _ = case.field(motions, case.cloth, device)
    np.testing.assert_allclose(found, moved(motions[:1], case.cloth)[0], atol=2e-7)


def test_joints_that_stand_still_leave_everything_where_it_is(device: str) -> None:
    case = Case(4)
    found, _ = case.field(np.tile(np.eye(4), (JOINTS, 1, 1)), case.cloth, device)
    assert not found.any()


def test_cloth_far_from_the_skin_goes_with_the_root(device: str) -> None:
    case = Case(5)
    far = case.distances().min(axis=1) > NONE
    assert 10 < far.sum() < CLOTH - 10
    motions = case.motions()
    found, _ = case.field(motions, case.cloth, device)
    np.testing.assert_allclose(found[far], moved(motions[:1], case.cloth[far])[0], atol=1e-7)


def test_cloth_at_skin_of_one_joint_goes_with_that_joint(device: str) -> None:
    case = Case(6)
    case.joints[:] = 4
    close = case.distances().min(axis=1) < FULL
    assert 10 < close.sum() < CLOTH - 10
    motions = case.motions()
    found, _ = case.field(motions, case.cloth, device)
    np.testing.assert_allclose(found[close], moved(motions[4:5], case.cloth[close])[0], atol=2e-7)


def test_skin_is_near_where_cloth_was_within_reach(device: str) -> None:
    case = Case(7)
    case.surface[: SKIN // 3, 1] -= 1.0 / 16.0
    _, near = case.field(case.motions(), case.cloth + 1.0, device)
    np.testing.assert_array_equal(near, (case.distances() < NONE).any(axis=0))
    assert 0 < near.sum() < SKIN
