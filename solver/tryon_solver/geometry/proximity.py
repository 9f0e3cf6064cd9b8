"""Whether triangle surfaces come closer to each other than a distance, and whether points lie inside a closed one.

For setting a scene up on the host; the contact of a running simulation has its own kernels. Distances of segments and
of points to triangles after C. Ericson, "Real-Time Collision Detection" (2005), sections 5.1.5 and 5.1.9; the winding
number after A. van Oosterom and J. Strackee, "The solid angle of a plane triangle" (1983).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Points = NDArray[np.float64]

PAIRS_AT_ONCE = 20_000
WINDINGS_AT_ONCE = 2_000_000  # points times faces


class Surface:
    """Triangles in space, prepared for many questions of nearness."""

    def __init__(self, vertices: Points, faces: NDArray[np.int32]) -> None:
        """vertices: (V, 3) m. faces: (F, 3), F >= 1."""
        self.vertices = vertices
        self.faces = faces
        self.corners = vertices[faces]  # (F, 3, 3) m
        self.centres = self.corners.mean(axis=1)
        self.radii = np.linalg.norm(self.corners - self.centres[:, None], axis=2).max(axis=1)
        self.tree = cKDTree(self.centres)
        self.points = cKDTree(vertices)

    def is_nearer_than(self, distance: float, other: Surface) -> bool:
        """Whether any two triangles, one of each surface, cross or are nearer than the distance [m]."""
        if np.isfinite(self.points.query(other.vertices, distance_upper_bound=distance)[0]).any():
            return True
        pairs = self._candidates(distance, other)
        for first in range(0, len(pairs), PAIRS_AT_ONCE):
            mine, theirs = pairs[first : first + PAIRS_AT_ONCE].T
            if _triangles_nearer_than(distance, self.corners[mine], other.corners[theirs]):
                return True
        return False

    def contains(self, points: Points) -> NDArray[np.bool_]:
        """Whether the points (K, 3) m lie inside this surface, which must be closed and turn outwards, shape (K,)."""
        step = max(1, WINDINGS_AT_ONCE // len(self.faces))
        blocks = [points[first : first + step] for first in range(0, len(points), step)]
        windings = [_winding_numbers(self.corners, block) for block in blocks]
        return np.concatenate([np.empty(0), *windings]) > 0.5

    def _candidates(self, distance: float, other: Surface) -> NDArray[np.intp]:
        """Pairs (K, 2) of triangles whose bounding spheres and boxes come within the distance."""
        reach = other.radii + float(self.radii.max()) + distance
        near = self.tree.query_ball_point(other.centres, reach)
        theirs = np.repeat(np.arange(len(near)), [len(found) for found in near])
        mine = np.concatenate([np.empty(0, dtype=np.intp), *(np.asarray(found, dtype=np.intp) for found in near)])
        a, b = self.corners[mine], other.corners[theirs]
        gap = np.maximum(a.min(axis=1) - b.max(axis=1), b.min(axis=1) - a.max(axis=1)).max(axis=1)
        return np.stack([mine, theirs], axis=1)[gap < distance]


def _triangles_nearer_than(distance: float, a: Points, b: Points) -> bool:
    """Whether any pair of the triangles (K, 3, 3), row by row, crosses or is nearer than the distance."""
    for one, other in ((a, b), (b, a)):
        for k in range(3):
            if (_point_triangle_distance(one[:, k], other) < distance).any():
                return True
            if _segment_pierces(one[:, k], one[:, (k + 1) % 3], other).any():
                return True
    for k in range(3):
        for m in range(3):
            if (_segment_distance(a[:, k], a[:, (k + 1) % 3], b[:, m], b[:, (m + 1) % 3]) < distance).any():
                return True
    return False


def _dot(u: Points, v: Points) -> Points:
    return np.einsum("kd,kd->k", u, v)


def _point_triangle_distance(p: Points, triangle: Points) -> Points:
    """Distance of each point (K, 3) to its triangle (K, 3, 3)."""
    a, b, c = triangle[:, 0], triangle[:, 1], triangle[:, 2]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    turns = [_dot(np.cross(v - u, p - u), normal) for u, v in ((a, b), (b, c), (c, a))]
    above = np.minimum.reduce(turns) >= 0
    to_sides = np.minimum.reduce([_point_segment_distance(p, u, v) for u, v in ((a, b), (b, c), (c, a))])
    return np.where(above, np.abs(_dot(p - a, normal)), to_sides)


def _point_segment_distance(p: Points, start: Points, end: Points) -> Points:
    along = end - start
    t = np.clip(_dot(p - start, along) / _dot(along, along), 0.0, 1.0)
    return np.linalg.norm(p - start - t[:, None] * along, axis=1)


def _segment_distance(p1: Points, q1: Points, p2: Points, q2: Points) -> Points:
    """Distance of each segment p1-q1 to its segment p2-q2, all (K, 3) and of non-zero length."""
    d1, d2, r = q1 - p1, q2 - p2, p1 - p2
    a, e, b = _dot(d1, d1), _dot(d2, d2), _dot(d1, d2)
    c, f = _dot(d1, r), _dot(d2, r)
    denominator = a * e - b * b
    parallel = denominator <= 1e-12 * a * e
    s = np.where(parallel, 0.0, np.clip((b * f - c * e) / np.where(parallel, 1.0, denominator), 0.0, 1.0))
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    s = np.clip((b * t - c) / a, 0.0, 1.0)
    return np.linalg.norm(r + s[:, None] * d1 - t[:, None] * d2, axis=1)


def _segment_pierces(start: Points, end: Points, triangle: Points) -> NDArray[np.bool_]:
    """Whether each segment (K, 3)-(K, 3) passes through its triangle (K, 3, 3)."""
    a, b, c = triangle[:, 0], triangle[:, 1], triangle[:, 2]
    normal = np.cross(b - a, c - a)
    from_start, from_end = _dot(start - a, normal), _dot(end - a, normal)
    opposite = from_start * from_end < 0
    t = from_start / np.where(opposite, from_start - from_end, 1.0)
    hit = start + t[:, None] * (end - start)
    turns = [_dot(np.cross(v - u, hit - u), normal) for u, v in ((a, b), (b, c), (c, a))]
    return opposite & (np.minimum.reduce(turns) >= 0)


def _winding_numbers(corners: Points, points: Points) -> Points:
    """How often the triangles (F, 3, 3) enclose each point (K, 3), shape (K,)."""
    a, b, c = (corners[None, :, k] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    triple = np.einsum("kfd,kfd->kf", a, np.cross(b, c))
    dots = [np.einsum("kfd,kfd->kf", u, v) for u, v in ((a, b), (b, c), (c, a))]
    angle = 2 * np.arctan2(triple, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)
    return angle.sum(axis=1) / (4 * np.pi)
