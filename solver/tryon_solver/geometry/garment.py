"""The worn garment as the solver sees it: welded triangles, pattern coordinates per corner, rest quantities."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tryon_solver.geometry.connectivity import Connectivity, ManyTrianglesError


class GarmentError(ValueError):
    """A garment the solver can't take; the message names the triangle or vertex and the remedy."""


@dataclass(frozen=True)
class Layer:
    """One garment of an outfit: its name, and which of the outfit's vertices, triangles and panels are its own."""

    name: str
    vertices: slice
    faces: slice
    panels: slice


@dataclass(frozen=True)
class Garment:
    """Welded triangles with their pattern.

    `faces` (F, 3) int32 vertex ids; `uv_corners` (F, 3, 2) float64 m, pattern coordinates of each corner (a seam vertex
    has one pair per panel); `panel_of_face` (F,) int32. Vertices are 0..vertex_count-1 and every one is in a face.
    `group` (vertex_count,) int32: vertices of one group are meant to become one (stitches not yet closed) and don't
    collide with each other's triangles; None when every vertex stands for itself.
    `spline_corners` (F, 3, 2) m, coordinates over which the subspace lays its splines where `uv_corners` do not hang
    together from triangle to triangle; None for uv_corners. `layers`: of an outfit (outfit.py) its garments, from the
    innermost outwards; () of a garment alone. `connectivity` is made of the triangles, and handed on to another shape
    of them.
    """

    faces: np.ndarray
    uv_corners: np.ndarray
    panel_of_face: np.ndarray
    vertex_count: int
    group: np.ndarray | None = None
    spline_corners: np.ndarray | None = None
    layers: tuple[Layer, ...] = ()
    connectivity: Connectivity = field(default=None, repr=False, compare=False)  # type: ignore[assignment]

    def __post_init__(self) -> None:
        known = self.connectivity is not None and self.connectivity.faces is self.faces
        if not known:
            object.__setattr__(self, "connectivity", Connectivity(self.faces, self.vertex_count))
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
        if known:  # a garment of these triangles has passed
            return
        used = np.zeros(self.vertex_count, bool)
        used[self.faces.ravel()] = True
        if not used.all():
            raise GarmentError(f"vertex {int(np.flatnonzero(~used)[0])} is in no triangle; remove it")

    def signed_areas(self) -> np.ndarray:
        """(F,) m^2, rest areas in the pattern; not to be written to."""
        return self._areas

    def corner_gradients(self) -> np.ndarray:
        """(F, 3, 2) 1/m, gradient of each corner's barycentric coordinate in pattern space: F = sum_i x_i g_i^T; not to
        be written to."""
        return self._gradients

    @cached_property
    def _areas(self) -> np.ndarray:
        (ax, ay), (bx, by) = self._sides
        return kept(0.5 * (ax * by - ay * bx))

    @cached_property
    def _gradients(self) -> np.ndarray:
        (ax, ay), (bx, by) = self._sides
        second, third = (np.column_stack(rows) / (2 * self._areas)[:, None] for rows in ((by, -bx), (-ay, ax)))
        return kept(np.stack([-second - third, second, third], axis=1))

    @property
    def _sides(self) -> tuple[np.ndarray, np.ndarray]:
        """(2, F) m each, from corner 0."""
        start, second, third = by_corners(self.uv_corners)
        return second - start, third - start

    @property
    def panel_count(self) -> int:
        """How many panels there are; they are 0..panel_count-1."""
        return int(self.panel_of_face.max()) + 1

    def vertex_areas(self) -> np.ndarray:
        """(vertex_count,) m^2, a third of the rest area around each vertex."""
        return np.bincount(self.faces.ravel(), np.repeat(self.signed_areas() / 3, 3), self.vertex_count)

    def edges(self) -> np.ndarray:
        """(E, 2) int32 unique edges, smaller vertex first, sorted."""
        return self.connectivity.edges

    def mean_edge_length(self) -> float:
        """m, mean over triangle sides in the pattern."""
        return self._mean_edge_length

    @cached_property
    def _mean_edge_length(self) -> float:
        sides = self.uv_corners[:, [1, 2, 0]] - self.uv_corners
        return float(np.linalg.norm(sides, axis=2).mean())

    def hinges(self) -> np.ndarray:
        """(H, 6) int64: edge ends v0 v1, opposite vertices v2 v3, and the two faces, for every interior edge.

        Raises GarmentError for an edge in more than two triangles.
        """
        try:
            return self.connectivity.hinges
        except ManyTrianglesError as error:
            raise GarmentError(str(error)) from error


def by_corners(uv_corners: np.ndarray) -> np.ndarray:
    """(3, 2, F) m of (F, 3, 2) m: each corner's coordinates by columns, which are quicker to compute with."""
    return np.ascontiguousarray(uv_corners.reshape(-1, 6).T).reshape(3, 2, -1)


def kept(values: np.ndarray) -> np.ndarray:
    """The array, handed out more than once: nobody may write to it."""
    values.setflags(write=False)
    return values
