"""Other sizes of a pattern: everything larger or smaller by one factor, from its highest point down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tryon_solver.geometry.panel_mesh import PanelMesh, mesh_pattern
from tryon_solver.geometry.pattern import Pattern, PatternError
from tryon_solver.geometry.weld import weld

COUNT_ROUNDS = 6  # meshes made at most until one has the number of vertices that was asked for
COUNT_WITHIN = 0.03  # of that number
FIRST_EDGE = 0.02  # m

SIZE_MIN, SIZE_MAX = 0.5, 2.0  # beyond, a pattern is drawn anew or was drawn in another unit


def mesh_in_size(pattern: Pattern, edge_length: float, size: float) -> PanelMesh:
    """The pattern in `size` times its own size, meshed with triangles of about edge_length [m].

    It starts with its highest point where the pattern has it, so that waist or shoulders stay. Raises PatternError.
    """
    if not SIZE_MIN <= size <= SIZE_MAX:
        raise PatternError(f"{size:g} is no size", "size", f"Give {SIZE_MIN:g} to {SIZE_MAX:g}; 1 is the pattern's own")
    return in_size(mesh_pattern(pattern, edge_length / size), size)


def in_size(mesh: PanelMesh, size: float) -> PanelMesh:
    """The mesh of a pattern in `size` times the size it has."""
    top = np.array([0.0, mesh.placed[:, 1].max(), 0.0])
    return replace(mesh, uv=size * mesh.uv, placed=top + size * (mesh.placed - top))


def mesh_with_vertices(pattern: Pattern, vertices: int, size: float = 1.0) -> PanelMesh:
    """The pattern in `size`, meshed as finely as gives about so many vertices once its seams are closed.

    Raises PatternError; ValueError for fewer than 3.
    """
    if vertices < 3:
        raise ValueError(f"vertices: {vertices} are no mesh; ask for 3 or more")
    edge, mesh = FIRST_EDGE, None
    for _ in range(COUNT_ROUNDS):
        mesh = mesh_in_size(pattern, edge, size)
        count = weld(mesh).vertex_count
        if abs(count - vertices) <= COUNT_WITHIN * vertices:
            break
        edge *= (count / vertices) ** 0.5
    assert mesh is not None
    return mesh
