"""Distances of contact stencils with their first and second derivatives, all stencils at once, in float64.

A stencil is a point and a triangle (kind 0) or the ends of two edges (kind 1); r = sum_i lam_i x_i joins the closest
points and d = |r|. On the closest feature lam depends linearly on the parameters beta that are free there (none at a
corner, one on an edge, two inside), and beta minimises D = |r|^2/2, so that

    dD/dx = lam (x) r,   d2D/dx2 = D_xx - D_xb D_bb^-1 D_bx,   grad d = dD/dx / d,   d2d = (d2D - grad d grad d^T)/d
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

POINT_TRIANGLE, EDGE_EDGE = 0, 1
PARALLEL = 1e-12  # squared sine below which two edges are parallel and one parameter is any


@dataclass(frozen=True)
class Closest:
    """Per stencil: distance `d` (S,) m, weights `lam` (S, 4), unit `normal` (S, 3), what the free parameters change
    `rates` (S, 2, 4), zero rows for those that are not free."""

    d: np.ndarray
    lam: np.ndarray
    normal: np.ndarray
    rates: np.ndarray


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(-1)


class _Nearest:
    """Collects, feature by feature, what is nearest so far."""

    def __init__(self, corners: np.ndarray) -> None:
        count = len(corners)
        self.corners = corners
        self.d_sq = np.full(count, np.inf)
        self.lam, self.rates = np.zeros((count, 4)), np.zeros((count, 2, 4))

    def offer(self, lam: np.ndarray, rates: np.ndarray, allowed: np.ndarray) -> None:
        """Take the feature where it is allowed and nearer; its rows `rates` (2, 4) are the same for all."""
        r = np.einsum("si,sid->sd", lam, self.corners)
        d_sq = np.where(allowed, _dot(r, r), np.inf)
        nearer = d_sq < self.d_sq
        self.d_sq = np.where(nearer, d_sq, self.d_sq)
        self.lam[nearer] = lam[nearer]
        self.rates[nearer] = rates


def _offer_point_segment(nearest: _Nearest, point: int, start: int, end: int, sign: float) -> None:
    """A corner against a segment: its inside and its two ends. `sign` is that of the point's own weight."""
    x = nearest.corners
    along = x[:, end] - x[:, start]
    length_sq = _dot(along, along)
    t = _dot(x[:, point] - x[:, start], along) / np.where(length_sq > 0, length_sq, 1.0)
    inside = (t > 0) & (t < 1) & (length_sq > 0)
    rates = np.zeros((2, 4))
    rates[0, start], rates[0, end] = sign, -sign
    for value, allowed, rate in (
        (t, inside, rates),
        (np.zeros_like(t), np.ones_like(inside), np.zeros((2, 4))),
        (np.ones_like(t), np.ones_like(inside), np.zeros((2, 4))),
    ):
        lam = np.zeros((len(t), 4))
        lam[:, point], lam[:, start], lam[:, end] = sign, -sign * (1 - value), -sign * value
        nearest.offer(lam, rate, allowed)


def _point_triangle(corners: np.ndarray) -> _Nearest:
    nearest = _Nearest(corners)
    for start, end in ((1, 2), (2, 3), (3, 1)):
        _offer_point_segment(nearest, 0, start, end, 1.0)
    p, a, b, c = np.moveaxis(corners, 1, 0)
    u, v, w = b - a, c - a, p - a
    uu, uv, vv, uw, vw = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    determinant = uu * vv - uv * uv
    regular = determinant > 1e-18 * uu * vv
    safe = np.where(regular, determinant, 1.0)
    b1, b2 = (vv * uw - uv * vw) / safe, (uu * vw - uv * uw) / safe
    lam = np.stack([np.ones_like(b1), b1 + b2 - 1, -b1, -b2], axis=1)
    rates = np.array([[0.0, 1, -1, 0], [0, 1, 0, -1]])
    nearest.offer(lam, rates, regular & (b1 > 0) & (b2 > 0) & (b1 + b2 < 1))
    return nearest


def _edge_edge(corners: np.ndarray) -> _Nearest:
    nearest = _Nearest(corners)
    for point, start, end, sign in ((0, 2, 3, 1.0), (1, 2, 3, 1.0), (2, 0, 1, -1.0), (3, 0, 1, -1.0)):
        _offer_point_segment(nearest, point, start, end, sign)
    a0, a1, b0, b1 = np.moveaxis(corners, 1, 0)
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    uu, uv, vv, uw, vw = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    determinant = uu * vv - uv * uv
    regular = determinant > PARALLEL * uu * vv
    safe = np.where(regular, determinant, 1.0)
    s, t = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    lam = np.stack([1 - s, s, t - 1, -t], axis=1)
    rates = np.array([[-1.0, 1, 0, 0], [0, 0, 1, -1]])
    nearest.offer(lam, rates, regular & (s > 0) & (s < 1) & (t > 0) & (t < 1))
    return nearest


def closest(kinds: np.ndarray, corners: np.ndarray) -> Closest:
    """Of stencils (S,) with corners (S, 4, 3) m."""
    count = len(kinds)
    d, lam, rates = np.empty(count), np.empty((count, 4)), np.empty((count, 2, 4))
    for kind, measure in ((POINT_TRIANGLE, _point_triangle), (EDGE_EDGE, _edge_edge)):
        here = kinds == kind
        found = measure(corners[here])
        d[here], lam[here], rates[here] = np.sqrt(found.d_sq), found.lam, found.rates
    r = np.einsum("si,sid->sd", lam, corners)
    return Closest(d, lam, r / np.maximum(d, 1e-300)[:, None], rates)


def distance_hessian(at: Closest, corners: np.ndarray) -> np.ndarray:
    """(S, 12, 12) 1/m, second derivative of d over the corners (S, 4, 3) m."""
    count = len(corners)
    r = at.d[:, None] * at.normal
    w = np.einsum("sai,sid->sad", at.rates, corners)
    free = (at.rates != 0).any(2)
    d_bb = np.einsum("sad,sbd->sab", w, w)
    d_bb[:, [0, 1], [0, 1]] += np.where(free, 0.0, 1.0)
    d_bx = np.einsum("sad,si->said", w, at.lam) + np.einsum("sai,sd->said", at.rates, r)
    d_bx = d_bx.reshape(count, 2, 12)
    d_xx = np.einsum("si,sj,de->sidje", at.lam, at.lam, np.eye(3)).reshape(count, 12, 12)
    hessian = d_xx - np.swapaxes(d_bx, 1, 2) @ np.linalg.solve(d_bb, d_bx)
    slope = distance_gradient(at)
    return (hessian - slope[:, :, None] * slope[:, None, :]) / at.d[:, None, None]


def distance_gradient(at: Closest) -> np.ndarray:
    """(S, 12), dimensionless."""
    return np.einsum("si,sd->sid", at.lam, at.normal).reshape(len(at.d), 12)
