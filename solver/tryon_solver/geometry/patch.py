"""Pieces that lie on others: a pocket, a patch. Sewn on along their edges, flat on the right side of the fabric."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry import outline
from tryon_solver.geometry.normals import vertex_normals

Points = NDArray[np.float64]

MARGIN = 3e-3  # m that the host reaches beyond what is sewn on it, a seam's own width


@dataclass(frozen=True)
class Patch:
    """A piece on another one, by their indices: its own origin comes to `at`, and it is turned about that."""

    panel: int
    host: int
    at: tuple[float, float]  # m, in the host's plane
    turn: float  # radians, counter-clockwise as the host is drawn
    open: frozenset[int]  # its edges that are not sewn on

    def on_host(self, points: Points) -> Points:
        """Points (K, 2) m of its plane, in the host's."""
        c, s = np.cos(self.turn), np.sin(self.turn)
        turned: Points = points @ np.array([[c, s], [-s, c]]) + self.at
        return turned


@dataclass(frozen=True)
class Laid:
    """Where the vertices of all patches lie on the pieces beneath, as shares of the corners of a triangle there."""

    vertices: NDArray[np.int32]  # (K,)
    onto: NDArray[np.int32]  # (K, 3), vertices of the host
    weights: Points  # (K, 3), sum to 1
    sewn: NDArray[np.bool_]  # (K,), on an edge that is sewn on

    @staticmethod
    def nothing() -> Laid:
        """Of a pattern without patches."""
        empty = np.empty(0, np.int32)
        return Laid(empty, np.empty((0, 3), np.int32), np.empty((0, 3)), np.empty(0, bool))

    @staticmethod
    def together(several: list[Laid]) -> Laid:
        """Of several patches."""
        if not several:
            return Laid.nothing()
        names = ("vertices", "onto", "weights", "sewn")
        return Laid(*(np.concatenate([getattr(laid, name) for laid in several]) for name in names))

    def on(self, x: Points, faces: NDArray[np.int32], lift: float) -> Points:
        """Places (K, 3) m over the pieces at x (V, 3) m with these faces (F, 3), `lift` m off their right side."""
        if not len(self.vertices):
            return np.empty((0, 3))
        normals = vertex_normals(x, faces)
        here, up = (np.einsum("kc,kcd->kd", self.weights, values[self.onto]) for values in (x, normals))
        lifted: Points = here + lift * up / np.linalg.norm(up, axis=1, keepdims=True)
        return lifted


def lies_within(inner: Points, host: Points) -> bool:
    """Does the outline (n, 2) m lie inside the host's (m, 2) m, `MARGIN` from its edges?"""
    if not outline.contains(host, inner).all() or outline.contains(inner, host).any():
        return False
    return min(outline.distance(host, inner).min(), outline.distance(inner, host).min()) >= MARGIN


def overlap(one: Points, other: Points) -> bool:
    """Do two outlines (n, 2), (m, 2) m share a place, or come within `MARGIN`?"""
    if outline.contains(one, other).any() or outline.contains(other, one).any():
        return True
    return min(outline.distance(one, other).min(), outline.distance(other, one).min()) < MARGIN or _cross_each_other(
        one, other
    )


def _cross_each_other(one: Points, other: Points) -> bool:
    """Do edges of two closed polygons cross?"""
    p, r = one[:, None], (np.roll(one, -1, axis=0) - one)[:, None]
    q, s = other[None], (np.roll(other, -1, axis=0) - other)[None]
    area = _cross(r, s)
    with np.errstate(divide="ignore", invalid="ignore"):
        t, u = _cross(q - p, s) / area, _cross(q - p, r) / area
    return bool(((t > 0) & (t < 1) & (u > 0) & (u < 1)).any())


def _cross(u: Points, v: Points) -> Points:
    product: Points = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return product
