"""A tracker's pose on its way to the body, and the two tables of joints that must say the same."""

from __future__ import annotations

import numpy as np
import pytest

from tryon_protocol import CONVENTIONS, Skeleton, TrackedPose, conventions
from tryon_server.runtime.followers import Follower
from tryon_server.sessions.commands import UseTrackedPose
from tryon_solver.body.model import default_body
from tryon_solver.body.tracking import conventions as solver_conventions

NAMES = ("viewer",)
UPRIGHT = np.array([[0.0, 0.0, 0.0, 1.0]])


def command(seq: int, x: float, number: int = 1) -> UseTrackedPose:
    pose = TrackedPose(None, np.array([[x, 1.62, 0.0]]), UPRIGHT, np.ones(1, dtype=bool))
    return UseTrackedPose(1, seq, seq / 60, "session", Skeleton("head-hands", NAMES, None, None, None), number, pose)


def test_a_follower_goes_where_the_tracker_goes():
    follower = Follower(default_body())
    first, second = follower.pose(command(1, 0.0)), follower.pose(command(2, 0.5))
    np.testing.assert_allclose(second.root - first.root, [0.5, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(second.rotations, first.rotations, atol=2e-3)  # the twist of straight legs settles
    assert first.root[1] == pytest.approx(0.91, abs=0.05)


@pytest.mark.parametrize("convention", ["webxr", "mediapipe", "smpl"])
def test_the_tables_of_protocol_and_solver_name_the_same_joints(convention):
    tables = {
        "webxr": solver_conventions.sided(solver_conventions.WEBXR_SIDED) | solver_conventions.WEBXR_MIDDLE,
        "mediapipe": solver_conventions.sided(solver_conventions.MEDIAPIPE_SIDED),
        "smpl": solver_conventions.sided(solver_conventions.SMPL_SIDED) | solver_conventions.SMPL_MIDDLE,
    }
    read = set(tables[convention].values())
    assert read <= set(CONVENTIONS[convention].known)
    parts = ("upper_arm", "forearm", "hand")
    needed = {tables[convention][f"{side}_{part}"] for side in ("left", "right") for part in parts}
    assert needed <= set(CONVENTIONS[convention].required)


def test_protocol_and_solver_know_the_same_conventions():
    assert set(CONVENTIONS) == set(solver_conventions.READERS)
    assert conventions.SMPL_JOINTS == solver_conventions.SMPL_JOINTS
    assert conventions.IMAGE_FRAME == solver_conventions.IMAGE_FRAME
    assert len(solver_conventions.SMPL_PARENTS) == len(solver_conventions.SMPL_JOINTS)
