"""Random poses, and where the motion clips lie."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from tryon_solver.body import BodyModel, Pose

REPOSITORY = Path(__file__).resolve().parents[4]
DEMO_MOTIONS = REPOSITORY / "server" / "tryon_server" / "demo" / "motions"


def random_pose(model: BodyModel, seed: int) -> Pose:
    """A pose with every joint turned anyhow and the root within a few metres."""
    rng = np.random.default_rng(seed)
    rotations = rng.normal(size=(model.joint_count, 4))
    return Pose(rng.uniform(-3.0, 3.0, 3), rotations / np.linalg.norm(rotations, axis=1, keepdims=True))


def shared_clips() -> list[Path]:
    """Captured clips outside the repository: folder bvh under $TRYON_SHARED_DATA, default ../shared/data."""
    folder = Path(os.environ.get("TRYON_SHARED_DATA", REPOSITORY.parent / "shared" / "data"))
    return sorted((folder / "bvh").glob("*.bvh"))
