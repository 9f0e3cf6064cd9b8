"""Where a mesh garment passes through itself as it comes: told when it is read, not only when it is put on."""

from __future__ import annotations

import numpy as np

from tryon_solver.contact.crossings import CrossingSearch
from tryon_solver.files.mesh_garment import MeshGarment


def self_crossings(garment: MeshGarment) -> np.ndarray:
    """(K, 2) an edge, of ``garment.garment.edges()``, and a triangle that it passes through, sorted.

    As dressing/untangle.py counts them: ends of one stitch are one.
    """
    cloth = garment.garment
    group = np.arange(cloth.vertex_count) if cloth.group is None else cloth.group
    return CrossingSearch(cloth.edges(), cloth.faces, group, "cpu").find(garment.x)


def crossing_notes(garment: MeshGarment) -> tuple[str, ...]:
    """For people: a note naming triangles of the file, or nothing."""
    pairs = self_crossings(garment)
    if not len(pairs):
        return ()
    where = garment.places(np.unique(pairs[:, 1]))
    return (
        f"it comes with {len(pairs)} crossings of itself ({where}): its layers are drawn apart when it is put on, or "
        "it is refused then where that can't be done",
    )
