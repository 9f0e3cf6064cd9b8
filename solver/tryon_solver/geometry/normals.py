"""Normals of a triangle mesh at its vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def vertex_normals(x: NDArray[np.float64], faces: NDArray[np.integer]) -> NDArray[np.float64]:
    """(V, 3) unit, the mean of those of the triangles (F, 3) around each of x (V, 3), by their areas; zero where there
    are none."""
    a, b, c = (x[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    corners = faces.T.ravel()
    total = np.stack([np.bincount(corners, np.tile(column, 3), len(x)) for column in normal.T], axis=1)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30)
