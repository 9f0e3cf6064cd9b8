"""Seams whose two sides have different vertices: where those of one lie on the edges of the other."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from tryon_solver.geometry.surface_repair import ALONG, ALONG_MOST, GAPING, WELD, open_edges

STEEP = 4.0  # a triangle is so many times as high over an edge as a vertex that is put on the edge lies off it

Edge = tuple[int, int]
Places = dict[Edge, list[tuple[float, int]]]
"""Of an open edge, smaller vertex first: how far along it, 0 to 1, and which vertices lie on it, in this order."""


def on_edges(x: np.ndarray, faces: np.ndarray) -> Places:
    """The vertices on open edges of x (V, 3) m, faces (F, 3) that lie on other such edges, and with which pieces of
    these become the same on both sides: so the sides of a seam are one."""
    edges, owner = open_edges(faces)
    length = np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)
    within = np.minimum(ALONG * length, ALONG_MOST)
    places: Places = {(a, b): [] for a, b in edges.tolist()}
    for k, vertex, along, off in _near(x, edges, np.maximum(within, WELD)):
        corners = x[faces[owner[k]]]
        height = np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) / length[k]
        inside = min(along, 1 - along) * length[k] > max(within[k], WELD)
        if inside and STEEP * off < height and vertex not in faces[owner[k]]:
            places[int(edges[k, 0]), int(edges[k, 1])].append((along, vertex))
    while True:
        for on in places.values():
            on.sort()
        shared = Counter(piece for edge, on in places.items() for piece in _pieces(edge, on))
        kept = {}
        for edge, on in places.items():
            twice = [shared[piece] == 2 for piece in _pieces(edge, on)]
            kept[edge] = [it for it, before, after in zip(on, twice, twice[1:]) if before or after]
        if kept == places:
            return {edge: on for edge, on in places.items() if on}
        places = kept


def beside_edges(x: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(K,) vertices, sorted, of open edges that lie along other such edges too far from them to be put on them, and
    (K,) m how far they are."""
    edges, _ = open_edges(faces)
    share, most = GAPING
    length = np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)
    near: dict[tuple[int, int], float] = {
        (k, vertex): off for k, vertex, _, off in _near(x, edges, np.minimum(share * length, most))
    }
    at: dict[int, set[int]] = {}
    for k, vertex in near:
        at.setdefault(vertex, set()).add(k)
    found: dict[int, float] = {}
    for (a, b), size in zip(edges.tolist(), length.tolist()):
        for k in at.get(a, set()) & at.get(b, set()):
            offs = near[k, a], near[k, b]
            if max(offs) <= share * size:
                found |= {v: min(off, found.get(v, off)) for v, off in zip((a, b), offs)}
    ids = np.array(sorted(found), np.int64)
    return ids, np.array([found[v] for v in ids.tolist()])


def _near(x: np.ndarray, edges: np.ndarray, within: np.ndarray) -> list[tuple[int, int, float, float]]:
    """Edge, vertex of another, share of the edge's length along it, and distance [m], of those that are `within` (E,)
    m of the edge."""
    if not len(edges):
        return []
    ids = np.unique(edges)
    a, across = x[edges[:, 0]], x[edges[:, 1]] - x[edges[:, 0]]
    length = np.linalg.norm(across, axis=1)
    around = cKDTree(x[ids]).query_ball_point(a + 0.5 * across, 0.5 * length + within)
    k = np.repeat(np.arange(len(edges)), [len(some) for some in around])
    others = ids[np.concatenate(around).astype(np.int64)]
    other = (others[:, None] != edges[k]).all(axis=1) & (length[k] > 0)
    k, others = k[other], others[other]
    offset = x[others] - a[k]
    along = np.clip(np.einsum("kd,kd->k", offset, across[k]) / length[k] ** 2, 0, 1)
    off = np.linalg.norm(offset - along[:, None] * across[k], axis=1)
    near = off <= within[k]
    return list(zip(k[near].tolist(), others[near].tolist(), along[near].tolist(), off[near].tolist()))


def _pieces(edge: Edge, on: list[tuple[float, int]]) -> list[Edge]:
    """The edges that it is cut into, smaller vertex first."""
    chain = [edge[0], *(vertex for _, vertex in on), edge[1]]
    return [(min(pair), max(pair)) for pair in pairwise(chain)]
