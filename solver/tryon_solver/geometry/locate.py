"""Where a point lies on a mesh: its triangle and its barycentric coordinates there, in the plane or in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Points = NDArray[np.float64]

NEIGHBOURS = 24  # triangles that are looked at for a point, by their middles


def locate(points: Points, triangles: Points) -> tuple[NDArray[np.int64], Points]:
    """Of each point (K, d) m, d = 2 or 3: which of the triangles (F, 3, d) m it lies in or nearest, (K,), and its
    barycentric coordinates in that one's plane, (K, 3), below 0 and above 1 for what lies beside it."""
    count = min(NEIGHBOURS, len(triangles))
    _, near = cKDTree(triangles.mean(axis=1)).query(points, k=count)
    near = near.reshape(len(points), count)
    a, b, c = (triangles[near, k] for k in range(3))
    weights = barycentric(a, b, c, points[:, None])
    clipped = np.clip(weights, 0.0, None)
    clipped /= clipped.sum(axis=-1, keepdims=True)
    nearest = np.einsum("knc,kncd->knd", clipped, triangles[near])
    best = np.linalg.norm(nearest - points[:, None], axis=-1).argmin(axis=1)
    row = np.arange(len(best))
    return near[row, best], weights[row, best]


def barycentric(a: Points, b: Points, c: Points, p: Points) -> Points:
    """(..., 3) coordinates in the triangles' planes of the points' feet there, (..., d) m each."""
    u, v, w = b - a, c - a, p - a
    uu, uv, vv = ((s * t).sum(-1) for s, t in ((u, u), (u, v), (v, v)))
    wu, wv = (w * u).sum(-1), (w * v).sum(-1)
    area = uu * vv - uv * uv
    beta, gamma = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    return np.stack([1.0 - beta - gamma, beta, gamma], axis=-1)
