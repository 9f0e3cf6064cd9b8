"""Which fabric of one cut of a garment another is made of: the flat pieces of both laid over each other."""

from __future__ import annotations

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
        return Overlay(before.placed, *locate(after.placed, before.placed[before.faces]))

    def is_over(self, before: PanelMesh) -> bool:
        """Is it laid over that, which has the triangles of the mesh that it was made for?"""
        return np.array_equal(self.placed, before.placed)
