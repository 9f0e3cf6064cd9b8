"""The worn garment as the solver sees it: welded triangles, pattern coordinates per corner, rest quantities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


class GarmentError(ValueError):
    """A garment the solver can't take; the message names the triangle or vertex and the remedy."""


@dataclass(frozen=True)
class Garment:
    """Welded triangles with their pattern.

    `faces` (F, 3) int32 vertex ids; `uv_corners` (F, 3, 2) float64 m, pattern coordinates of each corner (a seam vertex
    has one pair per panel); `panel_of_face` (F,) int32. Vertices are 0..vertex_count-1 and every one is in a face.
    `group` (vertex_count,) int32: vertices of one group are meant to become one (stitches not yet closed) and don't
    collide with each other's triangles; None when every vertex stands for itself.
    `spline_corners` (F, 3, 2) m, coordinates over which the subspace lays its splines where `uv_corners` do not hang
    together from triangle to triangle; None for uv_corners.
    """

    faces: np.ndarray
    uv_corners: np.ndarray
    panel_of_face: np.ndarray
    vertex_count: int
    group: np.ndarray | None = None
    spline_corners: np.ndarray | None = None

    def __post_init__(self) -> None:
        area = self.signed_areas()
        if not np.isfinite(self.uv_corners).all():
            bad = int(np.flatnonzero(~np.isfinite(self.uv_corners).all(axis=(1, 2)))[0])
            raise GarmentError(f"triangle {bad} has a pattern coordinate that is not a finite number")
        if (area <= 0).any():
            bad = int(np.argmin(area))
            raise GarmentError(
                f"triangle {bad} has rest area {area[bad]:.3e} m^2; "
                "rest triangles must be counter-clockwise in pattern space"
            )
        used = np.zeros(self.vertex_count, bool)
        used[self.faces.ravel()] = True
        if not used.all():
            raise GarmentError(f"vertex {int(np.flatnonzero(~used)[0])} is in no triangle; remove it")

    def signed_areas(self) -> np.ndarray:
        """(F,) m^2, rest areas in the pattern."""
        a, b = self.uv_corners[:, 1] - self.uv_corners[:, 0], self.uv_corners[:, 2] - self.uv_corners[:, 0]
        return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])

    def corner_gradients(self) -> np.ndarray:
        """(F, 3, 2) 1/m, gradient of each corner's barycentric coordinate in pattern space: F = sum_i x_i g_i^T."""
        edges = np.stack(
            [self.uv_corners[:, 1] - self.uv_corners[:, 0], self.uv_corners[:, 2] - self.uv_corners[:, 0]], axis=2
        )
        dm_inv = np.linalg.inv(edges)  # rows: gradients of the second and third barycentric coordinate
        return np.stack([-dm_inv[:, 0] - dm_inv[:, 1], dm_inv[:, 0], dm_inv[:, 1]], axis=1)

    def vertex_areas(self) -> np.ndarray:
        """(vertex_count,) m^2, a third of the rest area around each vertex."""
        area = np.zeros(self.vertex_count)
        np.add.at(area, self.faces.ravel(), np.repeat(self.signed_areas() / 3, 3))
        return area

    def edges(self) -> np.ndarray:
        """(E, 2) int32 unique edges, smaller vertex first, sorted."""
        pairs = np.vstack([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]])
        return np.unique(np.sort(pairs, axis=1), axis=0).astype(np.int32)

    def mean_edge_length(self) -> float:
        """m, mean over triangle sides in the pattern."""
        sides = self.uv_corners[:, [1, 2, 0]] - self.uv_corners
        return float(np.linalg.norm(sides, axis=2).mean())

    def hinges(self) -> np.ndarray:
        """(H, 6) int64: edge ends v0 v1, opposite vertices v2 v3, and the two faces, for every interior edge.

        Raises GarmentError for an edge in more than two triangles.
        """
        corner = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])
        table = self.faces[:, corner].reshape(-1, 3).astype(np.int64)
        face = np.repeat(np.arange(len(self.faces)), 3)
        key = np.sort(table[:, :2], axis=1)
        order = np.lexsort((key[:, 1], key[:, 0]))
        key, table, face = key[order], table[order], face[order]
        same = (key[1:] == key[:-1]).all(axis=1)
        if (same[1:] & same[:-1]).any():
            at = int(np.flatnonzero(same[1:] & same[:-1])[0])
            raise GarmentError(
                f"edge {key[at, 0]}-{key[at, 1]} is in more than two triangles; split the garment there"
            )
        first = np.flatnonzero(same)
        return np.column_stack([key[first], table[first, 2], table[first + 1, 2], face[first], face[first + 1]])
