"""What follows from a garment's triangles alone: made when it is first asked for, and kept when the shape changes."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from tryon_solver.geometry.distinct import distinct
from tryon_solver.geometry.element_sum import ElementSum, stable_order

CORNERS = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])  # a triangle's sides, each with the corner opposite


class ManyTrianglesError(ValueError):
    """An edge is in more than two triangles."""


class Connectivity:
    """Of the triangles `faces` (F, 3) over `count` vertices."""

    def __init__(self, faces: np.ndarray, count: int) -> None:
        self.faces, self.count = faces, count

    @cached_property
    def edges(self) -> np.ndarray:
        """(E, 2) int32 unique edges, smaller vertex first, sorted."""
        pairs = np.vstack([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]])
        return distinct(np.sort(pairs, axis=1)).rows.astype(np.int32)

    @cached_property
    def hinges(self) -> np.ndarray:
        """(H, 6) int64: edge ends v0 v1, opposite vertices v2 v3, and the two faces, for every interior edge.

        Raises ManyTrianglesError for an edge in more than two triangles.
        """
        table = self.faces[:, CORNERS].reshape(-1, 3).astype(np.int64)
        face = np.repeat(np.arange(len(self.faces)), 3)
        key = np.sort(table[:, :2], axis=1)
        order = stable_order(key[:, 1], self.count)
        order = order[stable_order(key[order, 0], self.count)]
        key, table, face = key[order], table[order], face[order]
        same = (key[1:] == key[:-1]).all(axis=1)
        if (same[1:] & same[:-1]).any():
            at = int(np.flatnonzero(same[1:] & same[:-1])[0])
            raise ManyTrianglesError(
                f"edge {key[at, 0]}-{key[at, 1]} is in more than two triangles; split the garment there"
            )
        first = np.flatnonzero(same)
        return np.column_stack([key[first], table[first, 2], table[first + 1, 2], face[first], face[first + 1]])

    @cached_property
    def hinge_corners(self) -> np.ndarray:
        """(2, 3, H): in each of a hinge's two triangles, which of all 3 F corners is v0, which v1, which the opposite
        one."""
        return np.array([[self._corner(side, column) for column in (0, 1, 2 + side)] for side in range(2)])

    def _corner(self, side: int, column: int) -> np.ndarray:
        """(H,) the corner, of the triangle on this side of each hinge, that is the vertex in this column."""
        face, vertex = self.hinges[:, 4 + side], self.hinges[:, column]
        return 3 * face + np.argmax(self.faces[face] == vertex[:, None], axis=1)

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
