"""Boundary loops of a surface: the neck, the sleeves, the hem of a sewn garment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry.seams import Indices, face_edges


def boundary_loops(faces: Indices) -> list[NDArray[np.int32]]:
    """Closed loops of vertex ids along the boundary of the edge-manifold faces (F, 3), each (L,), L >= 3.

    A loop runs as its first face turns: the surface lies to its left. Loops are ordered by their smallest vertex id and
    start there. Where two parts of the boundary meet in one vertex, the loop follows the faces around it.
    Raises ValueError when an edge is in more than two faces.
    """
    sides: dict[tuple[int, int], list[int]] = {}
    for side, (a, b) in enumerate(face_edges(faces).tolist()):
        sides.setdefault((min(a, b), max(a, b)), []).append(side)
    for (a, b), users in sides.items():
        if len(users) > 2:
            raise ValueError(f"edge {a}-{b} is in {len(users)} faces; the surface is not a manifold there")
    ends = face_edges(faces).tolist()
    waiting = {users[0] for users in sides.values() if len(users) == 1}
    loops = []
    for start in sorted(waiting):
        if start not in waiting:
            continue
        loop = []
        side, (tail, head) = start, ends[start]
        while side in waiting:
            waiting.remove(side)
            loop.append(tail)
            side = _next_boundary_side(faces, sides, side, head)
            tail, head = head, sum(ends[side]) - head
        loops.append(loop)
    turned = [loop[loop.index(min(loop)) :] + loop[: loop.index(min(loop))] for loop in loops]
    return [np.array(loop, dtype=np.int32) for loop in sorted(turned)]


def _next_boundary_side(faces: Indices, sides: dict[tuple[int, int], list[int]], side: int, pivot: int) -> int:
    """The other boundary side at the pivot vertex, found by walking through the faces around it from the given side."""
    while True:
        face = side // 3
        corners = faces[face].tolist()
        for k in range(3):
            a, b = corners[k], corners[(k + 1) % 3]
            if pivot in (a, b) and 3 * face + k != side:
                side = 3 * face + k
                users = sides[min(a, b), max(a, b)]
                break
        if len(users) == 1:
            return side
        side = users[0] if users[1] == side else users[1]
