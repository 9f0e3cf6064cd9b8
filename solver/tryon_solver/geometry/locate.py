"""Where a point lies on a mesh: its triangle and its barycentric coordinates there, in the plane or in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Points = NDArray[np.float64]

NEIGHBOURS = 24  # triangles that are looked at for a point, by their middles,
FIRST = 6  # after so many, in one of which most points lie
WITHIN = 1e-9  # of a triangle's size: so near it is in it, whatever others are near


def locate(points: Points, triangles: Points) -> tuple[NDArray[np.int64], Points]:
    """Of each point (K, d) m, d = 2 or 3: which of the triangles (F, 3, d) m it lies in or nearest, (K,), and its
    barycentric coordinates in that one's plane, (K, 3), below 0 and above 1 for what lies beside it."""
    middles = cKDTree(triangles.mean(axis=1))
    face, weights, off = among(middles, points, triangles, FIRST)
    size = np.linalg.norm(triangles[face, 1] - triangles[face, 0], axis=-1)
    left = np.flatnonzero(off > WITHIN * size)
    if len(left):
        face[left], weights[left], _ = among(middles, points[left], triangles, NEIGHBOURS)
    return face, weights


def among(
    middles: cKDTree, points: Points, triangles: Points, count: int
) -> tuple[NDArray[np.int64], Points, NDArray[np.float64]]:
    """Of each point, among so many triangles by their middles: the nearest one, the coordinates, how far off."""
    count = min(count, len(triangles))
    _, near = middles.query(points, k=count)
    near = near.reshape(len(points), count)
    a, b, c = (triangles[near, k] for k in range(3))
    weights = barycentric(a, b, c, points[:, None])
    clipped = np.clip(weights, 0.0, None)
    clipped /= clipped.sum(axis=-1, keepdims=True)
    nearest = clipped[..., :1] * a + clipped[..., 1:2] * b + clipped[..., 2:] * c
    off = np.linalg.norm(nearest - points[:, None], axis=-1)
    best = off.argmin(axis=1)
    row = np.arange(len(best))
    return near[row, best], weights[row, best], off[row, best]


def barycentric(a: Points, b: Points, c: Points, p: Points) -> Points:
    """(..., 3) coordinates in the triangles' planes of the points' feet there, (..., d) m each."""
    u, v, w = b - a, c - a, p - a
    uu, uv, vv = ((s * t).sum(-1) for s, t in ((u, u), (u, v), (v, v)))
    wu, wv = (w * u).sum(-1), (w * v).sum(-1)
    area = uu * vv - uv * uv
    beta, gamma = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    return np.stack([1.0 - beta - gamma, beta, gamma], axis=-1)
