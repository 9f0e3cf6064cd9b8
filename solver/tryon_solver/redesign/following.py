"""Partners follow: vertices sewn to those that moved go where every seam keeps the ratio of its sides' lengths.

Of all such places they take the nearest: the least sum of squared moves, found by Gauss-Newton steps of least norm. An
edge's length is that of its chord times a factor, as edges keep their shape when their ends move (moving.py).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tryon_solver.geometry.curves import Points
from tryon_solver.redesign.draft import Draft, Seam, Vertex
from tryon_solver.redesign.edge_shapes import chord

ROUNDS = 20
FITS = 1e-8  # m, that a seam may miss
FARTHEST = 3.0  # times the farthest move of the edit; who would have to go further is not meant to follow
AT_REST = 1e-7  # m; less is no move


def follow(draft: Draft, moves: Mapping[Vertex, Points]) -> dict[Vertex, Points]:
    """Moves (2,) m of the vertices sewn to those that `moves` (2,) m each moved already.

    None, where no moves make all of their seams fit again: these are then reported as they are.
    """
    largest = max((float(np.hypot(*by)) for by in moves.values()), default=0.0)
    free = _sewn_to(draft, moves)
    seams = [seam for seam in draft.seams if any(vertex in free for pair in seam.ends() for vertex in pair)]
    if largest < AT_REST or not seams:
        return {}
    column = {vertex: 2 * i for i, vertex in enumerate(free)}
    solution = _solve(draft, seams, column)
    if solution is None:
        return {}
    found = {vertex: solution[i : i + 2] for vertex, i in column.items()}
    if max(float(np.hypot(*by)) for by in found.values()) > FARTHEST * largest:
        return {}
    return {vertex: by for vertex, by in found.items() if np.hypot(*by) > AT_REST}


def _sewn_to(draft: Draft, moves: Mapping[Vertex, Points]) -> list[Vertex]:
    """The vertices that seams make one with any of the moved, these left out."""
    together = set(moves)
    pairs = [set(pair) for seam in draft.seams for pair in seam.ends()]
    while found := [pair for pair in pairs if pair & together and not pair <= together]:
        together = together.union(*found)
    ordered = [vertex for piece in draft.pieces.values() for vertex in piece.vertices]
    return [vertex for vertex in ordered if vertex in together and vertex not in moves]


def _solve(draft: Draft, seams: list[Seam], column: Mapping[Vertex, int]) -> Points | None:
    """Moves (2 F,) m of the vertices, each from its column on, by which the seams fit; None when there are none."""
    factor = {edge: draft.length(edge) / chord(edge) for seam in seams for edge in (seam.first, seam.second)}
    x = np.zeros(2 * len(column))
    for _ in range(ROUNDS):
        residual = np.zeros(len(seams))
        slopes = np.zeros((len(seams), len(x)))
        for row, seam in enumerate(seams):
            for edge, weight in ((seam.first, 1.0), (seam.second, -seam.ratio)):
                start, end = (v.position + (x[column[v] :][:2] if v in column else 0.0) for v in (edge.start, edge.end))
                length = float(np.hypot(*(end - start)))
                if length == 0:
                    return None
                residual[row] += weight * factor[edge] * length
                for vertex, sign in ((edge.start, -1.0), (edge.end, 1.0)):
                    if vertex in column:
                        i = column[vertex]
                        slopes[row, i : i + 2] += sign * weight * factor[edge] * (end - start) / length
        if np.abs(residual).max() < FITS:
            return x
        x = x - np.linalg.lstsq(slopes, residual, rcond=None)[0]
    return None
