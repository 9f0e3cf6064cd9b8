"""What follows from a garment's triangles alone: made when it is first asked for, and kept when the shape changes."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tryon_solver.geometry.distinct import ascending, distinct
from tryon_solver.geometry.element_sum import ElementSum, stable_order

CORNERS = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])  # a triangle's sides, each with the corner opposite


class ManyTrianglesError(ValueError):
    """An edge is in more than two triangles."""


class Connectivity:
    """Of the triangles `faces` (F, 3) over `count` vertices."""

    def __init__(self, faces: np.ndarray, count: int) -> None:
        self.faces, self.count = faces, count

    def complete(self) -> None:
        """Make all that a simulation asks for: for who hands it on. Raises ManyTrianglesError."""
        with ThreadPoolExecutor(2) as others:  # numpy and scipy let go of Python for most of the time
            of_hinges = others.submit(lambda: self.hinge_sum)
            of_sides = others.submit(lambda: self.owned)
            _ = self.corners, self.pairs
            of_hinges.result()
            of_sides.result()

    @cached_property
    def of_one_piece(self) -> bool:
        """Does a way along edges lead from each vertex to all others?"""
        graph = coo_array((np.ones(len(self.edges), np.int8), self.edges.T), shape=(self.count, self.count))
        return int(connected_components(graph, directed=False)[0]) == 1

    @property
    def edges(self) -> np.ndarray:
        """(E, 2) int32 unique edges, smaller vertex first, sorted."""
        return self._edges_and_owned[0]

    @property
    def owned(self) -> np.ndarray:
        """(F,) int32, each vertex and edge being owned by the first triangle that has it: bit k set when the triangle
        owns its vertex k, bit 3 + k when it owns the edge from vertex k to the next."""
        return self._edges_and_owned[1]

    @cached_property
    def _edges_and_owned(self) -> tuple[np.ndarray, np.ndarray]:
        sides = np.stack([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]], axis=1)
        edges = distinct(ascending(sides.reshape(-1, 2)))
        corner = np.full(self.count, -1)  # the first of each vertex: of those written to one place the last stays
        corner[self.faces.ravel()[::-1]] = np.arange(self.faces.size)[::-1]
        corner = corner[corner >= 0]
        owned = np.zeros(len(self.faces), np.int32)
        np.bitwise_or.at(owned, corner // 3, (1 << (corner % 3)).astype(np.int32))
        np.bitwise_or.at(owned, edges.first // 3, (8 << (edges.first % 3)).astype(np.int32))
        return edges.rows.astype(np.int32), owned

    @cached_property
    def hinges(self) -> np.ndarray:
        """(H, 6) int64: edge ends v0 v1, opposite vertices v2 v3, and the two faces, for every interior edge.

        Raises ManyTrianglesError for an edge in more than two triangles.
        """
        corners = self.hinge_corners
        vertices = self.faces.ravel().astype(np.int64)
        (start, end), apexes = corners[0, :2], corners[:, 2]
        return np.column_stack([*(vertices[at] for at in (start, end, *apexes)), *(apexes // 3)])

    @cached_property
    def hinge_corners(self) -> np.ndarray:
        """(2, 3, H) int32: in each of a hinge's two triangles, which of all 3 F corners is v0, which v1, which the
        opposite one. Raises ManyTrianglesError."""
        first = np.arange(self.faces.size, dtype=np.int32)  # corner of each side of each triangle
        second, apex = first + np.tile([1, 1, -2], len(self.faces)), first + np.tile([2, -1, -1], len(self.faces))
        every = self.faces.ravel()
        a, b = every, every[second]
        low, high = np.minimum(a, b), np.maximum(a, b)
        order = stable_order(high, self.count)
        order = order[stable_order(low[order], self.count)]
        low, high = low[order], high[order]
        same = (low[1:] == low[:-1]) & (high[1:] == high[:-1])
        if (same[1:] & same[:-1]).any():
            at = int(np.flatnonzero(same[1:] & same[:-1])[0])
            raise ManyTrianglesError(
                f"edge {low[at]}-{high[at]} is in more than two triangles; split the garment there"
            )
        shared = np.flatnonzero(same)
        sides = order[np.stack([shared, shared + 1])]  # (2, H)
        rising = a[sides] < b[sides]
        ends = np.where(rising, first[sides], second[sides]), np.where(rising, second[sides], first[sides])
        return np.stack([*ends, apex[sides]], axis=1).astype(np.int32)

    @cached_property
    def corners(self) -> tuple[np.ndarray, np.ndarray]:
        """The corners, of all 3 F, at each vertex: `order` (3 F,), ascending at a vertex, and `starts` (N + 1,)."""
        every = self.faces.ravel()
        starts = np.concatenate([[0], np.cumsum(np.bincount(every, minlength=self.count))])
        return stable_order(every, self.count), starts

    @cached_property
    def triangle_sum(self) -> ElementSum:
        """Of matrices over triangles."""
        return ElementSum.over(self.faces, self.count)

    @cached_property
    def hinge_sum(self) -> ElementSum:
        """Of matrices over hinges' four vertices, the edge's ends first."""
        return ElementSum.over(self.hinges[:, :4], self.count)

    @cached_property
    def pairs(self) -> tuple[np.ndarray, np.ndarray]:
        """The pairs of vertices that share a triangle, in rows: `columns` (N, width) int32, a row's own vertex first,
        which also fills it up; `slots` (F, 9) int32, where corners' pair (i, j) is in its row, at 3 i + j."""
        found = self.triangle_sum
        starts, indices = found.pattern.indptr, found.pattern.indices
        row = np.repeat(np.arange(self.count), np.diff(starts))
        within = np.arange(len(row)) - starts[row]
        own = indices == row
        slot = np.where(own, 0, within + (within < within[own][row]))
        columns = np.repeat(np.arange(self.count, dtype=np.int32)[:, None], int(slot.max()) + 1, axis=1)
        columns[row, slot] = indices
        return columns, slot[found.places].reshape(-1, 9).astype(np.int32)
