"""Several persons in one mesh: parts as tall as a person, side by side. Ours.

A garment would be laid around them all, and that it is too tight for this body is then not what is wrong.
"""

from __future__ import annotations

import numpy as np

from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.files.standing import trunk_middle
from tryon_solver.geometry.surface_repair import turned_alike

TALL = 0.6  # share of the whole height: a child beside a grown-up; a leg by itself is shorter
UPRIGHT = 0.8  # of its breadth: with arms spread out a person is as broad as tall
ROOMY = 0.2  # share of the largest one's volume: what a person holds or leans on, such as a staff, has less
ASIDE = 0.15  # share of the height between trunks: halves that were never joined are closer to each other


class SeveralError(MeshFileError):
    """The mesh holds more than one person."""


def refuse_several(x: np.ndarray, faces: np.ndarray, name: str) -> None:
    """Raises SeveralError where x (V, 3) m, Y up, with faces (F, 3), holds more than one person.

    Clothes are parts as well, and as tall: but they are around the trunk that they belong to.
    """
    _, part, _ = turned_alike(faces)
    height = float(np.ptp(x[:, 1]))
    low, high = np.full((2, part.max() + 1, 3), [[[np.inf]], [[-np.inf]]])
    np.minimum.at(low, part, x[faces].min(axis=1))
    np.maximum.at(high, part, x[faces].max(axis=1))
    extent = high - low
    upright = extent[:, 1] > np.maximum(TALL * height, UPRIGHT * extent[:, [0, 2]].max(axis=1))
    found = []
    for k in np.flatnonzero(upright):
        used, own = np.unique(faces[part == k], return_inverse=True)
        places, own = x[used], own.reshape(-1, 3)
        found.append((_volume(places, own), trunk_middle(places, own)))
    largest = max((volume for volume, _ in found), default=0.0)
    trunks: list[np.ndarray] = []
    for volume, middle in found:
        if volume > ROOMY * largest and all(np.hypot(*(middle - m)[[0, 2]]) > ASIDE * height for m in trunks):
            trunks.append(middle)
    if len(trunks) > 1:
        raise SeveralError(
            f"it holds {len(trunks)} persons: parts as tall as a person, side by side", name, "Export one of them"
        )


def _volume(x: np.ndarray, faces: np.ndarray) -> float:
    """m^3 that the surface x (V, 3) m, faces (F, 3), encloses, whichever way it is turned; of an open one roughly."""
    turned = turned_alike(faces)[0]
    a, b, c = (x[np.where(turned[:, None], faces[:, ::-1], faces)[:, k]] - x.mean(axis=0) for k in range(3))
    return abs(float(np.einsum("fd,fd->", a, np.cross(b, c)))) / 6
