"""What a scene holds beside the person: a floor, a wall, a sky."""

from __future__ import annotations

import numpy as np

from tryon_solver.files.convention import HUMAN
from tryon_solver.files.raw_mesh import MeshFileError, RawMesh


def refuse_surroundings(raw: RawMesh) -> None:
    """Raises MeshFileError naming the parts (of a mesh in metres) that are too large for a person's, where without
    them it is as large as a person."""
    def extent(faces: np.ndarray) -> float:
        return float(np.ptp(raw.vertices[faces].reshape(-1, 3), axis=0).max())

    parts = np.unique(raw.part_of_face)
    large = [int(part) for part in parts if extent(raw.faces[raw.part_of_face == part]) > HUMAN[1]]
    rest = raw.faces[~np.isin(raw.part_of_face, large)]
    if not large or not len(rest) or not HUMAN[0] <= extent(rest) <= HUMAN[1]:
        return
    said = ", ".join(
        f"{raw.part_names[part]!r} ({extent(raw.faces[raw.part_of_face == part]):.3g} m)" for part in large
    )
    raise MeshFileError(
        f"it holds more than a person: {said}",
        raw.name,
        "Leave that out of the export; without it what is there has a person's size",
    )
