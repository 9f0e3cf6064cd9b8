"""Sews the meshed pieces into one surface: vertices joined by stitches become one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry import seams
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.panel_mesh import PanelMesh


@dataclass(frozen=True)
class WeldedMesh:
    """The sewn garment, an edge-manifold with boundary. Pattern coordinates differ between the sides of a seam."""

    vertex_of_corner: NDArray[
        np.int32
    ]  # (F, 3), the faces: welded vertex of each corner, in the order of PanelMesh.faces
    uv_corners: NDArray[np.float64]  # (F, 3, 2) m, pattern coordinates of each corner
    welded_of_vertex: NDArray[np.int32]  # (V,), welded vertex of each vertex of the PanelMesh
    panel_of_face: NDArray[np.int32]  # (F,)
    seam_edges: NDArray[np.int32]  # (E, 2), edges that lie on a seam, smaller vertex first, sorted

    @property
    def vertex_count(self) -> int:
        """Number N of welded vertices, which are 0..N - 1."""
        return int(self.welded_of_vertex.max()) + 1

    def garment(self) -> Garment:
        """The fabric that is simulated."""
        return Garment(self.vertex_of_corner, self.uv_corners, self.panel_of_face, self.vertex_count)

    def mean_of_vertices(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (V, k) of the unsewn vertices averaged over those that are one welded vertex, shape (N, k)."""
        counts = np.bincount(self.welded_of_vertex, minlength=self.vertex_count)
        sums = [np.bincount(self.welded_of_vertex, weights=column, minlength=self.vertex_count) for column in values.T]
        return np.stack(sums, axis=1) / counts[:, None]


def weld(mesh: PanelMesh) -> WeldedMesh:
    """Join the stitched vertices of the mesh."""
    welded = seams.merge(len(mesh.uv), mesh.stitches)
    sewn = np.sort(welded[mesh.sewn_edges[:, 0]], axis=1)
    return WeldedMesh(
        vertex_of_corner=welded[mesh.faces],
        uv_corners=mesh.uv[mesh.faces],
        welded_of_vertex=welded,
        panel_of_face=mesh.panel_of_face,
        seam_edges=np.unique(sewn, axis=0).astype(np.int32),
    )


def unsewn(mesh: PanelMesh) -> WeldedMesh:
    """The pieces as they are before they are sewn: every vertex by itself."""
    every = np.arange(len(mesh.uv), dtype=np.int32)
    return WeldedMesh(mesh.faces, mesh.uv[mesh.faces], every, mesh.panel_of_face, np.zeros((0, 2), np.int32))
