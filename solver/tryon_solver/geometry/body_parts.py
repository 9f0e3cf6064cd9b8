"""Tells trunk and arms of a standing body apart by its horizontal sections, without a skeleton."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Points = NDArray[np.float64]

# Levels, as shares of the height, from the hips to above the shoulders of a standing person. Raised a little, as a
# tracked person's are at rest, the arms end above the lowest.
LOWEST_LEVEL, HIGHEST_LEVEL, LEVELS = 0.5, 0.88, 39
# Where a section of the trunk is wider than the one below by this factor, the arms have joined it.
ARMS_JOINED = 1.4
# An arm begins where the body is wider than the trunk by this factor.
ARM_BEYOND = 1.1


@dataclass(frozen=True)
class Trunk:
    """The trunk's place and width; arms lie beyond it. Without arms, half_width is infinite."""

    middle: float  # m, x of the trunk's middle
    half_width: float  # m, of its widest section below the armpits
    armpit: float  # m, y of the highest section that the arms do not join
    hips: float  # m, y below which there are no arms

    def arms(self, points: Points, side: int) -> NDArray[np.bool_]:
        """Which of the points (K, 3) m lie beyond the trunk on the side +1 (towards +x) or -1, shape (K,)."""
        return (side * (points[:, 0] - self.middle) > ARM_BEYOND * self.half_width) & (points[:, 1] > self.hips)

    def arm_side(self, centre: Points, label: str) -> int:
        """On which arm a piece with its middle at centre (3,) m belongs: +1, -1, or 0 for none.

        The label decides ("arm" is GarmentCode's for sleeves and cuffs); without one, the place does.
        """
        beyond = abs(centre[0] - self.middle) > 1.5 * self.half_width
        if not np.isfinite(self.half_width) or (label != "arm" and (label or not beyond)):
            return 0
        return 1 if centre[0] > self.middle else -1


def find_trunk(vertices: Points, faces: NDArray[np.int32]) -> Trunk:
    """The trunk of the body with vertices (B, 3) m and closed faces (F, 3), standing upright, y up, arms apart.

    Going up from the hips, the sections' part nearest the middle is the trunk, until it suddenly widens: the armpit.
    """
    low, high = vertices[:, 1].min(), vertices[:, 1].max()
    middle = float((vertices[:, 0].min() + vertices[:, 0].max()) / 2)
    levels = (np.linspace(LOWEST_LEVEL, HIGHEST_LEVEL, LEVELS) * (high - low) + low).tolist()
    widest = 0.0
    previous = np.inf
    for below, level in zip([low, *levels], levels):
        half_width = _trunk_half_width(vertices, faces, level, middle)
        if half_width > ARMS_JOINED * previous:
            return Trunk(middle, widest, below, levels[0])
        widest, previous = max(widest, half_width), half_width
    return Trunk(middle, np.inf, levels[-1], levels[0])


def _trunk_half_width(vertices: Points, faces: NDArray[np.int32], level: float, middle: float) -> float:
    """How far [m] from x = middle that loop of the section at y = level reaches which lies nearest to it."""
    above = vertices[faces, 1] > level
    crossing = faces[above.any(axis=1) & ~above.all(axis=1)]
    if len(crossing) == 0:
        return 0.0
    # Crossing faces that share a crossing edge belong to one loop of the section.
    edges = np.sort(np.stack([crossing, np.roll(crossing, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    up = vertices[edges, 1] > level
    cut = up[:, 0] != up[:, 1]
    ids = np.unique(edges[cut], axis=0, return_inverse=True)[1].ravel()
    owner = np.repeat(np.arange(len(crossing)), 3)[cut]
    graph = coo_array((np.ones(len(ids)), (owner, len(crossing) + ids)), shape=(len(crossing) + ids.max() + 1,) * 2)
    loop = connected_components(graph, directed=False)[1][owner]
    a, b = vertices[edges[cut, 0]], vertices[edges[cut, 1]]
    share = (level - a[:, 1]) / (b[:, 1] - a[:, 1])
    x = a[:, 0] + share * (b[:, 0] - a[:, 0])
    loops = np.unique(loop)
    low = np.array([x[loop == k].min() for k in loops])
    high = np.array([x[loop == k].max() for k in loops])
    nearest = int(np.argmin(np.abs((low + high) / 2 - middle)))
    return float(max(high[nearest] - middle, middle - low[nearest]))
