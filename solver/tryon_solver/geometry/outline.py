"""Plane polygons as outlines of pattern pieces: area, winding, distance to the outline, and whether it meets itself.

An outline is a closed polygon, shape (n, 2) in metres, the last point joined to the first; no point is repeated.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]

# Points times outline segments handled at once: bounds the memory of the all-pairs tests to a few hundred megabytes.
PAIRS_AT_ONCE = 4_000_000
CONTACTS_KEPT = 256  # whether outlines meet themselves: an edit has most of a pattern's pieces as they were


def signed_area(outline: Points) -> float:
    """Enclosed area [m^2], positive for a counter-clockwise outline (shoelace formula)."""
    x, y = outline[:, 0], outline[:, 1]
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def contains(outline: Points, points: Points) -> NDArray[np.bool_]:
    """Whether each point (K, 2) m lies inside the outline, by the crossings of a ray towards +x, shape (K,)."""
    x0, y0 = outline.T
    x1, y1 = np.roll(outline, -1, axis=0).T
    inside = np.empty(len(points), dtype=bool)
    for rows in _blocks(len(points), len(outline)):
        x, y = points[rows].T
        by_height = np.argsort(y, kind="stable")
        first, last = (np.searchsorted(y[by_height], ends(y0, y1)) for ends in (np.minimum, np.maximum))
        count = last - first  # of points beside each segment; a segment has its lower end, not its upper one
        segment = np.repeat(np.arange(len(outline)), count)
        point = by_height[np.arange(len(segment)) + np.repeat(first - np.cumsum(count) + count, count)]
        crossing = x0[segment] + (y[point] - y0[segment]) * (x1 - x0)[segment] / (y1 - y0)[segment]
        crossed = np.bincount(point[x[point] < crossing], minlength=len(x))
        inside[rows] = crossed % 2 == 1
    return inside


def distance(outline: Points, points: Points) -> Points:
    """Distance [m] of each point (K, 2) m to the outline, shape (K,)."""
    result = np.empty(len(points))
    for rows in _blocks(len(points), len(outline)):
        result[rows] = segment_distances(points[rows, None], outline, np.roll(outline, -1, axis=0)).min(axis=1)
    return result


def self_contact(outline: Points, tolerance: float) -> tuple[int, int] | None:
    """Two segments (i, j) of the outline that cross or come within the tolerance [m]; None when there are none.

    Segment i runs from point i to point i + 1. Neighbouring segments share a point; they are reported when they fold
    back onto each other.
    """
    return _self_contact(np.asarray(outline, dtype=np.float64).tobytes(), tolerance)


@lru_cache(maxsize=CONTACTS_KEPT)
def _self_contact(points: bytes, tolerance: float) -> tuple[int, int] | None:
    outline = np.frombuffer(points).reshape(-1, 2)
    count = len(outline)
    start, end = outline, np.roll(outline, -1, axis=0)
    low, high = np.minimum(start, end) - tolerance, np.maximum(start, end) + tolerance
    for rows in _blocks(count, count):
        near = (low[rows, None, 0] <= high[:, 0]) & (high[rows, None, 0] >= low[:, 0])
        near &= (low[rows, None, 1] <= high[:, 1]) & (high[rows, None, 1] >= low[:, 1])
        i, j = np.nonzero(near)
        i += rows.start
        i, j = i[i != j], j[i != j]
        apart = ((i + 1) % count != j) & ((j + 1) % count != i)
        across = _side(start[i], end[i], start[j]) * _side(start[i], end[i], end[j]) < 0
        back = _side(start[j], end[j], start[i]) * _side(start[j], end[j], end[i]) < 0
        # Point i belongs to the segments i and i - 1; on any other segment it is a touch.
        touches = (segment_distances(start[i], start[j], end[j]) < tolerance) & ((j + 1) % count != i)
        found = np.flatnonzero((across & back & apart) | touches)
        if len(found):
            return int(i[found[0]]), int(j[found[0]])
    return None


def flatness(outline: Points) -> float:
    """How thin the outline is as a cloud of points: its standard deviation across over that along, 0 to 1."""
    along, across = np.linalg.svd(outline - outline.mean(axis=0), compute_uv=False)
    return float(across / along)


def _side(start: Points, end: Points, points: Points) -> Points:
    """Twice the signed area of (start, end, point), each (..., 2), in their broadcast shape without the last axis."""
    along, offset = end - start, points - start
    return along[..., 0] * offset[..., 1] - along[..., 1] * offset[..., 0]


def segment_distances(points: Points, start: Points, end: Points) -> Points:
    """Distances [m] of points to segments, each (..., 2), in their broadcast shape without the last axis."""
    along = end - start
    offset = points - start
    t = np.clip((offset * along).sum(axis=-1) / (along * along).sum(axis=-1), 0.0, 1.0)
    return np.linalg.norm(offset - t[..., None] * along, axis=-1)


def _blocks(rows: int, columns: int) -> list[slice]:
    """Slices over the rows such that a block times the columns stays under PAIRS_AT_ONCE."""
    step = max(1, PAIRS_AT_ONCE // max(columns, 1))
    return [slice(first, first + step) for first in range(0, rows, step)]
