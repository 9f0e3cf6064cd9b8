"""Points that a surface carries along: each in the frame of a triangle near it.

The frame of a triangle x0, x1, x2 has its origin at x0 and the axes t = (x1 - x0)/|x1 - x0|, n = the unit normal, and
n x t. A rigid motion of the triangle moves the point with it; what the triangle's own stretch does is left out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree


def carried_by(
    points: NDArray[np.float64], surface: NDArray[np.float64], faces: NDArray[np.integer]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """For points (K, 3) m and a surface of vertices (B, 3) m and faces (F, 3): of each point the corners (K, 3) of the
    triangle whose middle is nearest, and its offset (K, 3) m along t, n and n x t. Triangles without area are passed
    over."""
    corners = surface[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    sound = np.flatnonzero(area > 0.0)
    nearest = sound[cKDTree(corners[sound].mean(axis=1)).query(points)[1]]
    onto = np.asarray(faces)[nearest].astype(np.int32)
    frames = frames_of(surface[onto])
    return onto, np.einsum("kij,kj->ki", frames, points - surface[onto[:, 0]])


def frames_of(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K, 3, 3): rows t, n and n x t of triangles with these corners (K, 3, 3) m."""
    along = corners[:, 1] - corners[:, 0]
    normal = np.cross(along, corners[:, 2] - corners[:, 0])
    t = along / np.linalg.norm(along, axis=1, keepdims=True)
    n = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([t, n, np.cross(n, t)], axis=1)
