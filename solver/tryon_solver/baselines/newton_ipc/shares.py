"""How much a stencil counts whose closest points lie on an edge or a corner: METHOD.md section 5, in float64."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_solver.baselines.newton_ipc.distance import EDGE_EDGE, Closest


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
    zeros = (at.lam == 0.0).sum(1)
    share = np.where((kinds == EDGE_EDGE) & (zeros > 0), 0.0, 1.0)
    away = at.d[:, None] * at.normal
    on_edge, on_corner = (np.flatnonzero((kinds != EDGE_EDGE) & (zeros == k)) for k in (1, 2))
    if len(on_edge):
        share[on_edge] = _on_edges(neighbours, ids[on_edge], at.lam[on_edge], away[on_edge], x)
    if len(on_corner):
        rows = np.arange(len(on_corner))
        corner = ids[on_corner][rows, 1 + np.argmax(at.lam[on_corner, 1:] != 0.0, axis=1)]
        around = neighbours.around[corner]
        leads = np.einsum("kd,knd->kn", away[on_corner], x[around] - x[corner][:, None]) > 0.0
        nearer = (leads & (around >= 0)).any(1)
        share[on_corner] = np.where(nearer, 0.0, 1.0 / neighbours.triangles[corner])
    return share


def _on_edges(
    neighbours: Neighbours, ids: np.ndarray, lam: np.ndarray, away: np.ndarray, x: np.ndarray
) -> np.ndarray:
    rows, absent = np.arange(len(ids)), np.argmax(lam[:, 1:] == 0.0, axis=1)
    third = ids[rows, 1 + absent]
    a, b = ids[rows, 1 + (absent + 1) % 3], ids[rows, 1 + (absent + 2) % 3]
    name = np.minimum(a, b).astype(np.int64) * len(x) + np.maximum(a, b)
    beside = neighbours.beside[np.searchsorted(neighbours.edges, name)]
    other = np.where(beside[:, 0] == third, beside[:, 1], beside[:, 0])
    along, across = x[b] - x[a], x[other] - x[a]
    across -= ((across * along).sum(1) / (along * along).sum(1))[:, None] * along
    nearer = (away * across).sum(1) > 0.0
    return np.where(other < 0, 1.0, np.where(nearer, 0.0, 0.5))
