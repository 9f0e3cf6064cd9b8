"""Distances of contact stencils in numpy float64, as the smallest over all pairs of features.

A stencil is (..., 4, 3) m: point and triangle (kind 0), or the two ends of two edges (kind 1). Written without the case
analysis of the solver, so that both can't be wrong together.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

POINT_TRIANGLE, EDGE_EDGE = 0, 1
AT_ONCE = 8192  # stencils whose intermediate results stay in a processor's cache: three times as fast as all together


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _corners(stencils: np.ndarray) -> np.ndarray:
    """(4, 3, ...) of stencils (..., 4, 3): along a last axis of three, numpy takes several times as long."""
    return np.ascontiguousarray(np.moveaxis(stencils, (-2, -1), (0, 1)))


def _nothing_yet(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squared distances (...) and weights (4, ...) to begin with, as precise as the points (3, ...) are."""
    precision = np.result_type(points, np.float64)
    return np.full(points.shape[1:], np.inf, precision), np.zeros((4, *points.shape[1:]), precision)


def _keep_closer(best: np.ndarray, weights: np.ndarray, closer: np.ndarray, d_sq: np.ndarray, case: tuple) -> None:
    """Put the squared distances (...) and the four weights of a case where it is closer than the best so far."""
    np.copyto(best, d_sq, where=closer)
    for kept, weight in zip(weights, case):
        np.copyto(kept, weight, where=closer)


def point_segment(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squared distance and the parameter of the foot, 0 at a and 1 at b; all points (3, ...)."""
    ab = b - a
    length_sq = _dot(ab, ab)
    t = np.clip(_dot(p - a, ab) / np.where(length_sq > 0, length_sq, 1.0), 0, 1)
    away = p - (a + t * ab)
    return _dot(away, away), t


def point_triangle(stencils: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (...) m and weights (..., 4)."""
    p, *corner = _corners(stencils)
    best, weights = _nothing_yet(p)
    weights[0] = 1
    for i, j in ((0, 1), (1, 2), (2, 0)):
        d_sq, t = point_segment(p, corner[i], corner[j])
        side = [1.0, 0.0, 0.0, 0.0]
        side[1 + i], side[1 + j] = -(1 - t), -t
        _keep_closer(best, weights, d_sq < best, d_sq, side)
    u, v, w = corner[1] - corner[0], corner[2] - corner[0], p - corner[0]
    uu, uv, vv, uw, vw = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    determinant = uu * vv - uv * uv
    regular = determinant > 1e-18 * uu * vv
    safe = np.where(regular, determinant, 1.0)
    b1 = (vv * uw - uv * vw) / safe
    b2 = (uu * vw - uv * uw) / safe
    inside = regular & (b1 >= 0) & (b2 >= 0) & (b1 + b2 <= 1)
    foot = w - b1 * u - b2 * v
    d_sq = _dot(foot, foot)
    _keep_closer(best, weights, inside & (d_sq < best), d_sq, (1.0, b1 + b2 - 1, -b1, -b2))
    return np.sqrt(best), np.moveaxis(weights, 0, -1)


def edge_edge(stencils: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (...) m and weights (..., 4)."""
    a0, a1, b0, b1 = _corners(stencils)
    best, weights = _nothing_yet(a0)
    for point, own, start, end, others, sign in (
        (a0, 0, b0, b1, (2, 3), 1),
        (a1, 1, b0, b1, (2, 3), 1),
        (b0, 2, a0, a1, (0, 1), -1),
        (b1, 3, a0, a1, (0, 1), -1),
    ):
        d_sq, t = point_segment(point, start, end)
        case = [0.0, 0.0, 0.0, 0.0]
        case[own], case[others[0]], case[others[1]] = sign, -sign * (1 - t), -sign * t
        _keep_closer(best, weights, d_sq < best, d_sq, case)
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    uu, uv, vv, uw, vw = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    determinant = uu * vv - uv * uv
    regular = determinant > 1e-18 * uu * vv
    safe = np.where(regular, determinant, 1.0)
    s = (uv * vw - vv * uw) / safe
    t = (uu * vw - uv * uw) / safe
    inside = regular & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    across = w + s * u - t * v
    d_sq = _dot(across, across)
    _keep_closer(best, weights, inside & (d_sq < best), d_sq, (1 - s, s, t - 1, -t))
    return np.sqrt(best), np.moveaxis(weights, 0, -1)


def stencil_distances(kinds: np.ndarray, stencils: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances and weights of stencils (..., S, 4, 3) whose kinds (S,) differ."""
    d = np.empty(stencils.shape[:-2])
    weights = np.empty(stencils.shape[:-1])
    for kind, measure in ((POINT_TRIANGLE, point_triangle), (EDGE_EDGE, edge_edge)):
        here = np.flatnonzero(kinds == kind)
        for start in range(0, len(here), AT_ONCE):
            some = here[start : start + AT_ONCE]
            d[..., some], weights[..., some, :] = measure(stencils[..., some, :, :])
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


def stencil_keys(kinds: np.ndarray, ids: np.ndarray) -> np.ndarray:
    """(S,) int64, the same for a stencil however its triangle's corners, its edges or their ends are ordered."""
    assert ids.max(initial=0) < 1 << 15, "five numbers in 63 bits"
    triangle = np.column_stack([ids[:, 0], np.sort(ids[:, 1:], axis=1)])
    a, b = np.sort(ids[:, :2], axis=1), np.sort(ids[:, 2:], axis=1)
    swap = (a[:, 0] > b[:, 0])[:, None]
    edges = np.column_stack([np.where(swap, b, a), np.where(swap, a, b)])
    key = kinds.astype(np.int64)
    for column in np.where((kinds == POINT_TRIANGLE)[:, None], triangle, edges).T:
        key = key << 15 | column
    return key
