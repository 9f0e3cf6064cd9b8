"""Forces given edges into a Delaunay triangulation of the plane by flipping the edges in their way.

Method: S. W. Sloan, "A fast algorithm for generating constrained Delaunay triangulations", Computers & Structures 47,
1993.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Faces = NDArray[np.int32]


class TriangulationError(ValueError):
    """An edge that cannot be part of a triangulation, because another vertex or edge is in its way."""


def constrain(points: Points, faces: Faces, edges: NDArray[np.int32]) -> Faces:
    """Counter-clockwise faces (F, 3) that contain all given edges (K, 2) and are Delaunay otherwise.

    points: (V, 2) m. faces: (F, 3), the Delaunay triangles of the points, counter-clockwise. Returns the same faces
    when no edge is missing. Raises TriangulationError when an edge runs through a vertex or another given edge.
    """
    sides = np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1).astype(np.int64)
    wanted = np.sort(edges, axis=1).astype(np.int64)
    count = len(points)
    missing = wanted[~np.isin(wanted @ [count, 1], sides @ [count, 1])]
    if len(missing) == 0:
        return faces
    flips = _Flips(points, faces, map(tuple, wanted.tolist()))
    for a, b in missing.tolist():
        flips.insert(a, b)
    flips.restore_delaunay()
    return flips.faces()


class _Flips:
    """A triangulation as a map from each directed edge to the vertex left of it."""

    def __init__(self, points: Points, faces: Faces, fixed: Iterable[tuple[int, int]]) -> None:
        self.points = points.tolist()
        self.apex: dict[tuple[int, int], int] = {}
        self.outgoing: dict[int, list[int]] = {}
        for a, b, c in faces.tolist():
            self._add(a, b, c)
        for a, b in self.apex:
            self.outgoing.setdefault(a, []).append(b)
        self.fixed = set(fixed)
        self.touched: deque[tuple[int, int]] = deque()

    def faces(self) -> Faces:
        unique = {(a, b, c) for (a, b), c in self.apex.items() if a < b and a < c}
        return np.array(sorted(unique), dtype=np.int32)

    def insert(self, a: int, b: int) -> None:
        """Flip the edges that cross the segment a-b until it is an edge itself."""
        crossing = deque(self._edges_across(a, b))
        patience = len(crossing) ** 2 + 10
        while crossing:
            patience -= 1
            if patience < 0:
                raise TriangulationError(f"the edge between vertices {a} and {b} cannot be inserted")
            u, v = crossing.popleft()
            c, d = self.apex[u, v], self.apex[v, u]
            if not self._convex(u, v, c, d):
                crossing.append((u, v))
                continue
            self._flip(u, v)
            if self._cross(c, d, a, b):
                crossing.append((c, d))

    def restore_delaunay(self) -> None:
        """Lawson's flips, started at the edges that changed, until every free edge is locally Delaunay."""
        patience = 100 * len(self.touched) + 10_000
        while self.touched and patience > 0:
            patience -= 1
            u, v = self.touched.popleft()
            if (min(u, v), max(u, v)) in self.fixed or (u, v) not in self.apex or (v, u) not in self.apex:
                continue
            c, d = self.apex[u, v], self.apex[v, u]
            if self._convex(u, v, c, d) and self._in_circle(u, v, c, d):
                self._flip(u, v)

    def _edges_across(self, a: int, b: int) -> list[tuple[int, int]]:
        """Edges that the segment a-b crosses, in order from a."""
        u, v = self._first_edge(a, b)
        found = []
        while True:
            if (min(u, v), max(u, v)) in self.fixed:
                raise TriangulationError(f"the edges {a}-{b} and {u}-{v} of the outline cross")
            found.append((u, v))
            w = self.apex[v, u]
            if w == b:
                return found
            side = self._side(a, b, w)
            if side == 0:
                raise TriangulationError(f"the edge between vertices {a} and {b} runs through vertex {w}")
            u, v = (u, w) if side > 0 else (w, v)

    def _first_edge(self, a: int, b: int) -> tuple[int, int]:
        """The edge (u, v) opposite to a, with u right and v left of the segment, through which it leaves a."""
        for u in self.outgoing[a]:
            v = self.apex.get((a, u))
            if v is not None and self._side(a, b, u) < 0 < self._side(a, b, v):
                return u, v
        raise TriangulationError(f"the edge between vertices {a} and {b} runs through another vertex")

    def _flip(self, u: int, v: int) -> None:
        """Replace the edge u-v by the edge that joins the two opposite vertices."""
        c, d = self.apex.pop((u, v)), self.apex.pop((v, u))
        self._add(c, u, d)
        self._add(d, v, c)
        self.outgoing[c].append(d)
        self.outgoing[d].append(c)
        self.touched.extend([(c, u), (u, d), (d, v), (v, c), (c, d)])

    def _add(self, a: int, b: int, c: int) -> None:
        self.apex[a, b], self.apex[b, c], self.apex[c, a] = c, a, b

    def _side(self, a: int, b: int, c: int) -> float:
        (ax, ay), (bx, by), (cx, cy) = self.points[a], self.points[b], self.points[c]
        return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)

    def _convex(self, u: int, v: int, c: int, d: int) -> bool:
        return self._side(c, u, d) > 0 and self._side(d, v, c) > 0

    def _cross(self, p: int, q: int, a: int, b: int) -> bool:
        if {p, q} & {a, b}:
            return False
        return self._side(a, b, p) * self._side(a, b, q) < 0

    def _in_circle(self, u: int, v: int, c: int, d: int) -> bool:
        """Whether d lies inside the circle through u, v, c (counter-clockwise), by more than rounding."""
        dx, dy = self.points[d]
        rows = [(x - dx, y - dy) for x, y in (self.points[u], self.points[v], self.points[c])]
        (ax, ay), (bx, by), (cx, cy) = rows
        a2, b2, c2 = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
        terms = (a2 * (bx * cy - cx * by), -b2 * (ax * cy - cx * ay), c2 * (ax * by - bx * ay))
        return sum(terms) > 1e-10 * sum(abs(term) for term in terms)
