"""Distances of contact stencils in numpy float64, as the smallest over all pairs of features.

A stencil is (..., 4, 3) m: point and triangle (kind 0), or the two ends of two edges (kind 1). Written without the case
analysis of the solver, so that both can't be wrong together.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

POINT_TRIANGLE, EDGE_EDGE = 0, 1


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(-1)


def point_segment(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squared distance and the parameter of the foot, 0 at a and 1 at b."""
    ab = b - a
    length_sq = _dot(ab, ab)
    t = np.clip(_dot(p - a, ab) / np.where(length_sq > 0, length_sq, 1.0), 0, 1)
    foot = a + t[..., None] * ab
    return _dot(p - foot, p - foot), t


def point_triangle(stencils: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (...) m and weights (..., 4)."""
    p, *corner = np.moveaxis(stencils, -2, 0)
    best = np.full(p.shape[:-1], np.inf)
    weights = np.zeros((*best.shape, 4))
    weights[..., 0] = 1
    for i, j in ((0, 1), (1, 2), (2, 0)):
        d_sq, t = point_segment(p, corner[i], corner[j])
        side = np.zeros_like(weights)
        side[..., 0], side[..., 1 + i], side[..., 1 + j] = 1, -(1 - t), -t
        closer = d_sq < best
        best, weights = np.where(closer, d_sq, best), np.where(closer[..., None], side, weights)
    u, v, w = corner[1] - corner[0], corner[2] - corner[0], p - corner[0]
    uu, uv, vv = _dot(u, u), _dot(u, v), _dot(v, v)
    determinant = uu * vv - uv * uv
    regular = determinant > 1e-18 * uu * vv
    safe = np.where(regular, determinant, 1.0)
    b1 = (vv * _dot(u, w) - uv * _dot(v, w)) / safe
    b2 = (uu * _dot(v, w) - uv * _dot(u, w)) / safe
    inside = regular & (b1 >= 0) & (b2 >= 0) & (b1 + b2 <= 1)
    foot = w - b1[..., None] * u - b2[..., None] * v
    d_sq = _dot(foot, foot)
    closer = inside & (d_sq < best)
    face = np.stack([np.ones_like(b1), b1 + b2 - 1, -b1, -b2], axis=-1)
    return np.sqrt(np.where(closer, d_sq, best)), np.where(closer[..., None], face, weights)


def edge_edge(stencils: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (...) m and weights (..., 4)."""
    a0, a1, b0, b1 = np.moveaxis(stencils, -2, 0)
    best = np.full(a0.shape[:-1], np.inf)
    weights = np.zeros((*best.shape, 4))
    for point, own, start, end, others, sign in (
        (a0, 0, b0, b1, (2, 3), 1),
        (a1, 1, b0, b1, (2, 3), 1),
        (b0, 2, a0, a1, (0, 1), -1),
        (b1, 3, a0, a1, (0, 1), -1),
    ):
        d_sq, t = point_segment(point, start, end)
        case = np.zeros_like(weights)
        case[..., own], case[..., others[0]], case[..., others[1]] = sign, -sign * (1 - t), -sign * t
        closer = d_sq < best
        best, weights = np.where(closer, d_sq, best), np.where(closer[..., None], case, weights)
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    uu, uv, vv = _dot(u, u), _dot(u, v), _dot(v, v)
    determinant = uu * vv - uv * uv
    regular = determinant > 1e-18 * uu * vv
    safe = np.where(regular, determinant, 1.0)
    s = (uv * _dot(v, w) - vv * _dot(u, w)) / safe
    t = (uu * _dot(v, w) - uv * _dot(u, w)) / safe
    inside = regular & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    across = w + s[..., None] * u - t[..., None] * v
    d_sq = _dot(across, across)
    closer = inside & (d_sq < best)
    both = np.stack([1 - s, s, t - 1, -t], axis=-1)
    return np.sqrt(np.where(closer, d_sq, best)), np.where(closer[..., None], both, weights)


def stencil_distances(kinds: np.ndarray, stencils: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances and weights of stencils (..., S, 4, 3) whose kinds (S,) differ."""
    d = np.empty(stencils.shape[:-2])
    weights = np.empty(stencils.shape[:-1])
    for kind, measure in ((POINT_TRIANGLE, point_triangle), (EDGE_EDGE, edge_edge)):
        here = kinds == kind
        d[..., here], weights[..., here, :] = measure(stencils[..., here, :, :])
    return d, weights


def all_stencils(faces_a: np.ndarray, faces_b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Kinds (S,) and vertex ids (S, 4) of every point-triangle and edge-edge pair between two surfaces.

    Pairs that share a vertex are left out; with both surfaces the same, each edge pair appears once.
    """
    kinds, ids = [], []

    def edges(faces: np.ndarray) -> np.ndarray:
        return np.unique(np.sort(np.vstack([faces[:, list(k)] for k in combinations(range(3), 2)]), axis=1), axis=0)

    for points, triangles in ((np.unique(faces_a), faces_b), (np.unique(faces_b), faces_a)):
        p, t = np.meshgrid(points, np.arange(len(triangles)), indexing="ij")
        ids.append(np.column_stack([p.ravel(), triangles[t.ravel()]]))
        kinds.append(np.full(p.size, POINT_TRIANGLE))
        if faces_a is faces_b:
            break
    first, second = edges(faces_a), edges(faces_b)
    i, j = np.meshgrid(np.arange(len(first)), np.arange(len(second)), indexing="ij")
    once = i < j if faces_a is faces_b else np.ones_like(i, bool)
    ids.append(np.column_stack([first[i[once]], second[j[once]]]))
    kinds.append(np.full(int(once.sum()), EDGE_EDGE))
    kind, stencil = np.concatenate(kinds), np.vstack(ids)
    one_side = np.where(kind == POINT_TRIANGLE, 1, 2)
    shared = np.zeros(len(kind), bool)
    for a in range(2):
        for b in range(1, 4):
            shared |= (a < one_side) & (b >= one_side) & (stencil[:, a] == stencil[:, b])
    return kind[~shared], stencil[~shared]
