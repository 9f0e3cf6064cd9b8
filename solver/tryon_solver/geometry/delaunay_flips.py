"""A triangulation kept Delaunay while its points move: by flips, many at once.

Points that move a little leave most edges Delaunay, and a few rounds of Lawson's flips (C. L. Lawson, "Software for C1
surface interpolation", 1977) bring back what a triangulation from scratch would find, in a fraction of its time. Edges
with one triangle, the outline's, are never flipped: the triangulation is the constrained one of what the faces fill.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry.constrained import Faces, Points

ROUNDING = 1e-10  # of its terms: an edge's test nearer to zero than this is of four points on a circle
THINNEST = 1e-9  # of the two triangles' area: a flip that would leave less in one of its new ones is not made

HalfEdges = NDArray[np.int64]
"""Numbers of sides of faces: 3 f + k is the side of face f opposite to its corner k, and so is that corner's place."""


class KeptDelaunay:
    """Counter-clockwise faces (F, 3) of points in the plane, of which every inner edge is in two."""

    def __init__(self, faces: Faces) -> None:
        self._corners = faces.astype(np.int64).ravel()  # (3 F,)
        self._link()

    @property
    def faces(self) -> Faces:
        """(F, 3) as they are now."""
        return self._corners.reshape(-1, 3).astype(np.int32)

    def restore(self, points: Points) -> None:
        """Flip edges until each is Delaunay for these points (V, 2) m, of which no face is turned over."""
        x, y = np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
        sides = np.flatnonzero(self._across > np.arange(len(self._across)))
        for _ in range(len(self._corners)):
            sides = sides[self._to_flip(x, y, sides)]
            if not len(sides):
                return
            mine, others = sides // 3, self._across[sides] // 3
            first = np.full(len(self._corners) // 3, len(sides))
            order = np.arange(len(sides))
            np.minimum.at(first, mine, order)
            np.minimum.at(first, others, order)
            alone = (first[mine] == order) & (first[others] == order)  # each face is in one flip of a round at most
            self._flip(sides[alone])
            changed = np.concatenate([mine[alone], others[alone]])
            near = (3 * changed[:, None] + np.arange(3)).ravel()
            near = np.concatenate([near[self._across[near] >= 0], 3 * mine[~alone], 3 * mine[~alone] + 1])
            near = np.concatenate([near, 3 * mine[~alone] + 2])
            near = near[self._across[near] >= 0]
            sides = np.unique(np.minimum(near, self._across[near]))

    def add(self, points: Points, vertices: range) -> None:
        """Join these of the points (V, 2) m, which are inside of faces, to the faces around them, and restore."""
        for vertex in vertices:
            x, y = points.T
            a, b, c = self._corners.reshape(-1, 3).T
            inside = np.full(len(a), np.inf)
            for p, q in ((a, b), (b, c), (c, a)):
                inside = np.minimum(inside, _cross(x[q] - x[p], y[q] - y[p], x[vertex] - x[p], y[vertex] - y[p]))
            face = int(np.argmax(inside))
            a, b, c = self._corners[3 * face : 3 * face + 3]
            self._corners[3 * face + 2] = vertex
            self._corners = np.concatenate([self._corners, [b, c, vertex, c, a, vertex]])
        if vertices:
            self._link()
            self.restore(points)

    def _link(self) -> None:
        """Find for each side the one that is the same edge in another face; -1 where there is none."""
        corners = self._corners.reshape(-1, 3)
        start, end = corners[:, [1, 2, 0]].ravel(), corners[:, [2, 0, 1]].ravel()
        key = np.minimum(start, end) * (int(corners.max()) + 1) + np.maximum(start, end)
        order = np.argsort(key, kind="stable")
        same = np.flatnonzero(key[order[1:]] == key[order[:-1]])
        self._across = np.full(len(key), -1)
        self._across[order[same]], self._across[order[same + 1]] = order[same + 1], order[same]

    def _to_flip(self, x: Points, y: Points, sides: HalfEdges) -> NDArray[np.bool_]:
        """Whether the two angles opposite to each edge are together over 180 degrees, and its flip is possible."""
        others = self._across[sides]
        a, d = self._corners[sides], self._corners[others]
        b, c = self._corners[_next(sides)], self._corners[_next(others)]
        abx, aby, acx, acy = x[b] - x[a], y[b] - y[a], x[c] - x[a], y[c] - y[a]
        dbx, dby, dcx, dcy = x[b] - x[d], y[b] - y[d], x[c] - x[d], y[c] - y[d]
        cosine_a, sine_a = abx * acx + aby * acy, _cross(abx, aby, acx, acy)
        cosine_d, sine_d = dbx * dcx + dby * dcy, _cross(dcx, dcy, dbx, dby)
        one, other = cosine_a * sine_d, cosine_d * sine_a
        over = one + other < -ROUNDING * (np.abs(one) + np.abs(other))
        ends = THINNEST * (sine_a + sine_d)
        at_b = _cross(abx, aby, abx - dbx, aby - dby)  # b - a and d - a
        at_c = _cross(acx - dcx, acy - dcy, acx, acy)
        return over & (at_b > ends) & (at_c > ends)

    def _flip(self, sides: HalfEdges) -> None:
        """Join the corners opposite to these edges instead; no two are of one face."""
        corners, across = self._corners, self._across
        others = across[sides]
        f, e = 3 * (sides // 3), 3 * (others // 3)
        a, b, c, d = corners[sides], corners[_next(sides)], corners[_next(others)], corners[others]
        # Faces (a, b, c) and (d, c, b) become (a, b, d) and (d, c, a); the four sides around them go along.
        was = np.concatenate([_next(others), _next(_next(sides)), _next(sides), _next(_next(others))])
        now = np.concatenate([f, f + 2, e, e + 2])
        moved = np.arange(len(across))
        moved[was] = now
        beyond = across[was]
        there = beyond >= 0
        beyond = np.where(there, moved[beyond], -1)
        across[now] = beyond
        across[beyond[there]] = now[there]
        across[f + 1], across[e + 1] = e + 1, f + 1
        corners[f], corners[f + 1], corners[f + 2] = a, b, d
        corners[e], corners[e + 1], corners[e + 2] = d, c, a


def _next(sides: HalfEdges) -> HalfEdges:
    """The next side, or corner, of the same face."""
    return sides + np.where(sides % 3 == 2, -2, 1)


def _cross(ax: Points, ay: Points, bx: Points, by: Points) -> Points:
    """m^2, of two vectors by their coordinates."""
    return ax * by - ay * bx
