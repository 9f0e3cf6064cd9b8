"""The volume that triangles enclose, their openings closed by caps."""

from __future__ import annotations

import numpy as np

from tryon_solver.geometry.boundary_loops import boundary_loops


def closed_by_caps(faces: np.ndarray) -> np.ndarray:
    """(T, 3) int32: the faces (F, 3), and for each loop of their boundary a fan of triangles from its first vertex.

    Raises ValueError when an edge is in more than two faces.
    """
    fans = [np.column_stack([np.full(len(loop) - 2, loop[0]), loop[2:], loop[1:-1]]) for loop in boundary_loops(faces)]
    return np.vstack([faces, *fans]).astype(np.int32)


def enclosed_volume(x: np.ndarray, faces: np.ndarray) -> float:
    """m^3 within closed faces (T, 3) of positions (N, 3) m, above 0 where they are counter-clockwise from outside: the
    sum of tetrahedra (x0, x1, x2, any point)."""
    corners = x[faces] - x[faces[0, 0]]
    return float(np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


def area_of(x: np.ndarray, faces: np.ndarray) -> float:
    """m^2 of faces (T, 3) of positions (N, 3) m."""
    a, b, c = (x[faces[:, k]] for k in range(3))
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
