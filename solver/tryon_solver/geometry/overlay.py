"""Which fabric of one cut of a garment another is made of: the flat pieces of both laid over each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tryon_solver.geometry.locate import Points, locate
from tryon_solver.geometry.panel_mesh import PanelMesh


@dataclass(frozen=True, eq=False)
class Overlay:
    """For each vertex of the new mesh the triangle `face` (V,) of the old one in which its flat place lies, and its
    barycentric `weights` (V, 3) there; `placed` (U, 3) m are the old one's flat places."""

    placed: Points
    face: np.ndarray
    weights: Points

    @staticmethod
    def of(before: PanelMesh, after: PanelMesh) -> Overlay:
        """Lay the mesh `after` over `before`, both in the size that is worn."""
        face, weights = np.empty(len(after.placed), np.int64), np.empty((len(after.placed), 3))
        corner = np.empty(len(before.placed), np.int64)  # one of each vertex: there it lies if its piece is as it was
        corner[before.faces.ravel()] = np.arange(before.faces.size)
        other = np.ones(len(face), bool)
        for own, old in unchanged_panels(before, after):
            face[own], weights[own], other[own] = corner[old] // 3, np.eye(3)[corner[old] % 3], False
        face[other], weights[other] = locate(after.placed[other], before.placed[before.faces])
        return Overlay(before.placed, face, weights)

    def is_over(self, before: PanelMesh) -> bool:
        """Is it laid over that, which has the triangles of the mesh that it was made for?"""
        return np.array_equal(self.placed, before.placed)


def unchanged_panels(before: PanelMesh, after: PanelMesh) -> Iterator[tuple[slice, slice]]:
    """Vertices of `after` and of `before` of each piece that lies in both with the same points."""
    for number, name in enumerate(after.panel_names):
        if name in before.panel_names:
            own, old = after.vertices_of(number), before.vertices_of(before.panel_names.index(name))
            if np.array_equal(after.placed[own], before.placed[old]):
                yield own, old
