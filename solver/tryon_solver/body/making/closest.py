"""Closest points of a triangle mesh, in numpy: used when the body is made, never while simulating."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree


@dataclass(frozen=True)
class Closest:
    """Closest points of P query points on a triangle mesh."""

    points: np.ndarray  # (P, 3) m
    faces: np.ndarray  # (P,) int, index of the triangle
    barycentric: np.ndarray  # (P, 3), non-negative, sums to 1
    distances: np.ndarray  # (P,) m


def closest_points(queries: np.ndarray, vertices: np.ndarray, triangles: np.ndarray, candidates: int = 32) -> Closest:
    """Closest point of the mesh (vertices (V, 3) m, triangles (F, 3)) to each of the queries (P, 3) m.

    Exact among the `candidates` triangles whose centroids lie nearest to the query; on a mesh whose neighbouring
    triangles are of similar size these contain the closest one.
    """
    corners = vertices[triangles]
    count = min(candidates, len(triangles))
    _, near = cKDTree(corners.mean(axis=1)).query(queries, k=count)
    near = near.reshape(len(queries), count)
    barycentric = _closest_barycentric(queries[:, None], corners[near])
    points = np.einsum("pck,pckx->pcx", barycentric, corners[near])
    distances = np.linalg.norm(points - queries[:, None], axis=-1)
    rows, best = np.arange(len(queries)), distances.argmin(axis=1)
    return Closest(points[rows, best], near[rows, best], barycentric[rows, best], distances[rows, best])


def _closest_barycentric(p: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (..., 3) of the point of each triangle (..., 3, 3) closest to p (..., 3).

    The projection onto the plane where it falls inside, otherwise the best of the three edges.
    """
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    ab, ac, ap = b - a, c - a, p - a
    d00, d01, d11 = (ab * ab).sum(-1), (ab * ac).sum(-1), (ac * ac).sum(-1)
    d20, d21 = (ap * ab).sum(-1), (ap * ac).sum(-1)
    denominator = np.maximum(d00 * d11 - d01 * d01, 1e-30)
    v = (d11 * d20 - d01 * d21) / denominator
    w = (d00 * d21 - d01 * d20) / denominator
    inside = np.stack([1 - v - w, v, w], axis=-1)

    options, squares = [], []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        start, edge = corners[..., i, :], corners[..., j, :] - corners[..., i, :]
        t = np.clip(((p - start) * edge).sum(-1) / np.maximum((edge * edge).sum(-1), 1e-30), 0.0, 1.0)
        option = np.zeros(inside.shape)
        option[..., i], option[..., j] = 1 - t, t
        options.append(option)
        squares.append(((start + t[..., None] * edge - p) ** 2).sum(-1))
    nearest = np.argmin(np.stack(squares), axis=0)
    on_edge = np.take_along_axis(np.stack(options), nearest[None, ..., None], axis=0)[0]
    return np.where((inside >= 0).all(-1, keepdims=True), inside, on_edge)
