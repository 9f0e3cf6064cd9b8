"""The body made at set-up, and a small one made by hand."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from tryon_solver.body import BodyModel, default_body

sys.path.insert(0, str(Path(__file__).parent / "support"))


@pytest.fixture(scope="session")
def body() -> BodyModel:
    return default_body()


@pytest.fixture
def finger() -> BodyModel:
    """Two bones along y, jointed at y = 1, and four vertices: below, at the joint half and half, and two above."""
    return BodyModel(
        rest_vertices=np.array([[0.5, 0.5, 0.0], [0.5, 1.0, 0.0], [0.5, 1.5, 0.0], [0.0, 2.0, 0.5]]),
        faces=np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
        joint_names=("base", "tip"),
        parents=np.array([-1, 0], dtype=np.int32),
        rest_joints=np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        skin_joints=np.array([[0, 1], [0, 1], [1, 0], [1, 0]], dtype=np.int32),
        skin_weights=np.array([[1.0, 0.0], [0.5, 0.5], [1.0, 0.0], [1.0, 0.0]], dtype=np.float32),
    )
