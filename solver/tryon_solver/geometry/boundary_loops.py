"""Boundary loops of a surface: the neck, the sleeves, the hem of a sewn garment."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry.seams import Indices, face_edges, sides_of_one_edge


def boundary_loops(faces: Indices) -> list[NDArray[np.int32]]:
    """Closed loops of vertex ids along the boundary of the edge-manifold faces (F, 3), each (L,), L >= 3.

    A loop runs as its first face turns: the surface lies to its left. Loops are ordered by their smallest vertex id and
    start there. Where two parts of the boundary meet in one vertex, the loop follows the faces around it.
    Raises ValueError when an edge is in more than two faces.
    """
    one, other = sides_of_one_edge(faces)
    crowded = one[:-1][other[:-1] == one[1:]]
    tails, heads = face_edges(faces).T
    if len(crowded):
        first = crowded.min()
        a, b = sorted((int(tails[first]), int(heads[first])))
        count = int(((np.minimum(tails, heads) == a) & (np.maximum(tails, heads) == b)).sum())
        raise ValueError(f"edge {a}-{b} is in {count} faces; the surface is not a manifold there")
    beyond = np.full(len(tails), -1)
    beyond[one], beyond[other] = other, one
    starts = np.flatnonzero(beyond < 0).tolist()
    sides = _Sides(tails.tolist(), heads.tolist(), beyond.tolist())
    waiting = set(starts)
    loops = []
    for start in starts:
        if start not in waiting:
            continue
        loop = []
        side, tail, head = start, sides.tails[start], sides.heads[start]
        while side in waiting:
            waiting.remove(side)
            loop.append(tail)
            side = sides.next_of_boundary(side, head)
            tail, head = head, sides.tails[side] + sides.heads[side] - head
        loops.append(loop)
    turned = [loop[loop.index(min(loop)) :] + loop[: loop.index(min(loop))] for loop in loops]
    return [np.array(loop, dtype=np.int32) for loop in sorted(turned)]


class _Sides(NamedTuple):
    """Of each side of the faces, in Python's own numbers as it is walked along them one by one: the vertices at its
    ends, as the face turns, and the other side of the same edge, -1 at the boundary."""

    tails: list[int]
    heads: list[int]
    beyond: list[int]

    def next_of_boundary(self, side: int, pivot: int) -> int:
        """The other boundary side at the pivot vertex, found by walking through the faces around it from the given
        side."""
        while True:
            corner = side - side % 3
            for k in (corner, corner + 1, corner + 2):
                if k != side and pivot in (self.tails[k], self.heads[k]):
                    side = k
                    break
            if self.beyond[side] < 0:
                return side
            side = self.beyond[side]
