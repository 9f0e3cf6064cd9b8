"""How much a stencil counts whose closest points lie on an edge or a corner: METHOD.md section 5, in float64."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_solver.baselines.newton_ipc.distance import EDGE_EDGE, POINT_TRIANGLE, Closest, closest

ENDS = 0.05  # of an edge's length, or of a triangle's height, over which it counts less towards its end


@dataclass(frozen=True)
class Neighbours:
    """Of A vertices and E edges: `edges` (E,) int64, smaller end times A plus the larger one, ascending; `beside`
    (E, 2), the corners of the triangles on both sides, -1 for none; `around` (A, D), the ends of each vertex's edges,
    -1 for none; `triangles` (A,), about it."""

    edges: np.ndarray
    beside: np.ndarray
    around: np.ndarray
    triangles: np.ndarray

    @staticmethod
    def of(faces: np.ndarray, count: int) -> Neighbours:
        """Of triangles (F, 3) of `count` vertices; raises ValueError for an edge of more than two."""
        ends = np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64), axis=1)
        third = np.concatenate([faces[:, 2], faces[:, 0], faces[:, 1]])
        names = ends[:, 0] * count + ends[:, 1]
        edges, which, sides = np.unique(names, return_inverse=True, return_counts=True)
        if (sides > 2).any():
            raise ValueError(f"edge {divmod(int(edges[np.argmax(sides)]), count)} has more than two triangles")
        beside = np.full((len(edges), 2), -1)
        order = np.argsort(which, kind="stable")
        place = np.arange(len(order)) - np.concatenate([[0], np.cumsum(sides)])[which[order]]
        beside[which[order], place] = third[order]
        both = np.vstack([np.stack(divmod(edges, count), axis=1), np.stack(divmod(edges, count), axis=1)[:, ::-1]])
        both = both[np.argsort(both[:, 0], kind="stable")]
        degree = np.bincount(both[:, 0], minlength=count)
        around = np.full((count, max(int(degree.max(initial=0)), 1)), -1)
        place = np.arange(len(both)) - np.concatenate([[0], np.cumsum(degree)])[both[:, 0]]
        around[both[:, 0], place] = both[:, 1]
        return Neighbours(edges, beside, around, np.bincount(faces.ravel(), minlength=count))


def shares(neighbours: Neighbours, kinds: np.ndarray, ids: np.ndarray, at: Closest, x: np.ndarray) -> np.ndarray:
    """(S,) of stencils (S,), (S, 4) with these closest points at x (A, 3) m."""
    of_edges = kinds == EDGE_EDGE
    ends = np.minimum(np.abs(at.lam[:, [0, 2]]), np.abs(at.lam[:, [1, 3]]))
    share = np.where(of_edges, _fade(ends).prod(1), 1.0)
    on_corner = ~of_edges & ((at.lam == 0.0).sum(1) == 2)
    for k in range(1, 4):
        near = np.flatnonzero(~of_edges & ~on_corner & (-at.lam[:, k] < ENDS))
        if len(near):
            share[near] *= _beside_edges(neighbours, ids[near], k, -at.lam[near, k], x)
    corners = np.flatnonzero(on_corner)
    if len(corners):
        corner = ids[corners, 1 + np.argmax(at.lam[corners, 1:] != 0.0, axis=1)]
        around = neighbours.around[corner]
        away = at.d[corners, None] * at.normal[corners]
        leads = np.einsum("kd,knd->kn", away, x[around] - x[corner][:, None]) > 0.0
        share[corners] = np.where((leads & (around >= 0)).any(1), 0.0, 1.0 / neighbours.triangles[corner])
    return share


def _fade(s: np.ndarray) -> np.ndarray:
    r = np.clip(s / ENDS, 0.0, 1.0)
    return r**2 * (3.0 - 2.0 * r)


def _beside_edges(neighbours: Neighbours, ids: np.ndarray, k: int, own: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Of points and triangles (K, 4), by what each's neighbour across the edge that is opposite corner k has."""
    p, third = ids[:, 0], ids[:, k]
    a, b = ids[:, 1 + k % 3], ids[:, 1 + (k + 1) % 3]
    name = np.minimum(a, b).astype(np.int64) * len(x) + np.maximum(a, b)
    beside = neighbours.beside[np.searchsorted(neighbours.edges, name)]
    other = np.where(beside[:, 0] == third, beside[:, 1], beside[:, 0])
    stencils = np.column_stack([p, a, b, np.where((other < 0) | (other == p), third, other)])
    there = np.where(other == p, 1.0, _fade(-closest(np.full(len(ids), POINT_TRIANGLE), x[stencils]).lam[:, 3]))
    return np.where(other < 0, 1.0, 1.0 - 0.5 * (1.0 - _fade(own)) * (1.0 + there))
