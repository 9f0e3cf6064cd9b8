"""Tells trunk and arms of a standing body apart by its horizontal sections, and how an arm is held: no skeleton."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

Points = NDArray[np.float64]

# Levels, as shares of the height, from the hips to above the shoulders of a standing person. Raised a little, as a
# tracked person's are at rest, the arms end above the lowest.
LOWEST_LEVEL, HIGHEST_LEVEL, LEVELS = 0.5, 0.88, 39
# A body whose lowest point is so high, as a share of its highest, has no legs; its levels are counted from y = 0.
WITHOUT_LEGS = 0.25
# Where a section of the trunk is wider than the one below by this factor, the arms have joined it.
ARMS_JOINED = 1.4
# An arm begins where the body is wider than the trunk by this factor.
ARM_BEYOND = 1.1
# An arm's direction is that of so much of it at least: over a shorter piece it is as wide as long.
SHORTEST_ARM = 0.25  # m
ROOT_SHARE = 0.1  # of the arm's length, whose middle is its root
FEWEST_VERTICES = 8  # of a part of the arm


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


@dataclass(frozen=True)
class Arm:
    """An arm as the body holds it, over the length that the garment's sleeve covers."""

    vertices: Points  # (B, 3) m, of the whole arm
    root: Points  # (3,) m, middle of its end at the trunk
    axis: Points  # (3,) unit, towards the trunk

    def turned(self, positions: Points, normal: Points) -> Points:
        """The flat piece (K, 3) m with that unit normal, turned about the root until the arm's axis is in its plane.

        Turned the shortest way: the axis as seen along the normal comes to lie on the axis itself.
        """
        seen = self.axis - (self.axis @ normal) * normal
        seen /= np.linalg.norm(seen)
        turn = Rotation.from_rotvec(_between(seen, self.axis))
        result: Points = self.root + turn.apply(positions - self.root)
        return result

    def behind(self, positions: Points) -> Points:
        """The arm's vertices (B, 3) m between the ends of the piece (K, 3) m; the whole arm where it ends before."""
        reach = positions @ self.axis
        at = self.vertices @ self.axis
        inside = (at >= reach.min()) & (at <= reach.max())
        return self.vertices[inside] if np.count_nonzero(inside) >= FEWEST_VERTICES else self.vertices


def find_arm(body: Points, trunk: Trunk, side: int, pieces: Points) -> Arm:
    """The arm on the side +1 or -1 of the body (B, 3) m, its axis that of what the pieces (K, 3) m cover."""
    vertices = body[trunk.arms(body, side)]
    axis = _long_axis(vertices, np.array([-side, 0.0, 0.0]))
    at = (vertices @ axis).max() - vertices @ axis
    root = vertices[at < ROOT_SHARE * at.max()].mean(axis=0)
    covered = max(SHORTEST_ARM, float((root - pieces).dot(axis).max()))
    return Arm(vertices, root, _long_axis(vertices[at < covered], axis))


def _long_axis(points: Points, towards: Points) -> Points:
    """(3,) unit, the direction in which the points (K, 3) m spread most, on the side of `towards`."""
    spread = points - points.mean(axis=0)
    axis: Points = np.linalg.eigh(spread.T @ spread)[1][:, 2]
    return axis if axis @ towards >= 0 else -axis


def _between(one: Points, other: Points) -> Points:
    """Rotation vector (3,) rad of the shortest turn from one unit vector (3,) to another, less than half round."""
    across = np.cross(one, other)
    sine = float(np.linalg.norm(across))
    return across * (np.arctan2(sine, one @ other) / sine) if sine > 0 else across


def find_trunk(vertices: Points, faces: NDArray[np.int32]) -> Trunk:
    """The trunk of the body with vertices (B, 3) m and closed faces (F, 3), standing upright, y up, arms apart.

    Going up from the hips, the sections' part nearest the middle is the trunk, until it suddenly widens: the armpit.
    """
    lowest, high = vertices[:, 1].min(), vertices[:, 1].max()
    low = 0.0 if lowest > WITHOUT_LEGS * high else lowest
    middle = float((vertices[:, 0].min() + vertices[:, 0].max()) / 2)
    levels = (np.linspace(LOWEST_LEVEL, HIGHEST_LEVEL, LEVELS) * (high - low) + low).tolist()
    hips, levels = levels[0], [level for level in levels if level > lowest]
    widest = 0.0
    previous = np.inf
    for below, level in zip([low, *levels], levels):
        half_width = _trunk_half_width(vertices, faces, level, middle)
        if half_width > ARMS_JOINED * previous:
            return Trunk(middle, widest, below, hips)
        widest, previous = max(widest, half_width), half_width
    return Trunk(middle, np.inf, levels[-1], hips)


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
