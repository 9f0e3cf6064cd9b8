"""Slack that a rest shape begins with where a new cut had to be drawn out to be put on, taken in again over time.

What an edit sews together meets in one frame, and the fabric beside it is stretched (dressing/carry_over.py). Released
at once, that tension throws the cloth. So each such triangle begins with a rest shape as much larger as it was drawn
out, by which it is as taut as it was before, and comes to its own at a bounded rate of strain. With the deformation
gradients F = sum s_i u_i v_i^T as it lies and F' as it was carried over, in its own rest shape, sides are M times as
long to begin with,

    M = sum m_i v_i v_i^T,   m_i = max(s_i / max(s'_1, 1), 1),

and I + (1 - share) (M - I) on the way. Triangles need not fit together at rest: each has its own coordinates. Ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry.garment import Garment

Points = NDArray[np.float64]

STAYS = 1e-6  # m: a triangle no corner of which went further is not looked at, as most of a garment's
LEAST = 1.02  # times as long: what is drawn out by less is left to the fabric


@dataclass(frozen=True, eq=False)
class Slack:
    """Of the triangles `faces` (K,) of a garment: how many times as long they are at rest to begin with, `maps`
    (K, 2, 2), in the pattern's plane."""

    faces: NDArray[np.int64]
    maps: Points

    @staticmethod
    def of(garment: Garment, x: Points, carried: Points) -> Slack | None:
        """Of vertices at x (N, 3) m, whose triangles' corners were carried over to `carried` (F, 3, 3) m, all zero of
        what was not; None where nothing is drawn out."""
        lies = x[garment.faces]
        moved = np.flatnonzero(np.abs(lies - carried).max(axis=(1, 2)) > STAYS)
        own, now = (_squared(garment, moved, corners[moved]) for corners in (carried, lies))
        before = np.sqrt(np.maximum(np.linalg.eigvalsh(own)[:, 1], 1.0))
        values, vectors = np.linalg.eigh(now)
        longer = np.maximum(np.sqrt(np.maximum(values, 0.0)) / before[:, None], 1.0)
        out = np.flatnonzero(longer[:, 1] > LEAST)
        if not len(out):
            return None
        return Slack(moved[out], np.einsum("kia,ka,kja->kij", vectors[out], longer[out], vectors[out]))

    def largest_strain(self) -> float:
        """Logarithm of how many times as long a side is to begin with, at most."""
        return float(np.log(np.linalg.eigvalsh(self.maps)[:, 1].max()))

    def given(self, corners: Points, share: float) -> Points:
        """Corners (F, 3, 2) m in the pattern with what is left of the slack at this share of the way, 0 to 1."""
        given = corners.copy()
        sides = corners[self.faces] - corners[self.faces, :1]
        map_now = np.eye(2) + (1.0 - share) * (self.maps - np.eye(2))
        given[self.faces] = corners[self.faces, :1] + sides @ map_now
        return given


def _squared(garment: Garment, faces: NDArray[np.int64], corners: Points) -> Points:
    """(K, 2, 2): F^T F of the triangles `faces` (K,) with their corners at (K, 3, 3) m."""
    gradient = np.einsum("fkd,fke->fde", corners, garment.corner_gradients()[faces])
    product: Points = np.einsum("fda,fdb->fab", gradient, gradient)
    return product
