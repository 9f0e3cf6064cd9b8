"""Sewn vertices: which mesh vertices become one, and where sewing would break the surface.

A sewn garment must stay an edge-manifold: every edge in one or two faces, no face twice, no face with a vertex twice.
A fine mesh sewn along whole edges has that by itself; a coarse one can lose it at corners and in narrow pieces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tryon_solver.geometry.distinct import ascending, distinct

Indices = NDArray[np.int32]


def merge(vertex_count: int, pairs: Indices) -> Indices:
    """Id (vertex_count,) of the merged vertex of every vertex, when the pairs (S, 2) are joined.

    Ids are counted from 0 in the order in which the merged vertices first occur.
    """
    links = (np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1]))
    _, part = connected_components(coo_array(links, shape=(vertex_count, vertex_count)), directed=False)
    _, first, inverse = np.unique(part, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int32)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[inverse].astype(np.int32)


def face_edges(faces: Indices) -> Indices:
    """Edges (3 F, 2) of the faces, directed as the faces turn; row 3 f + k starts at corner k of face f."""
    return np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)


def sides_of_one_edge(faces: Indices) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Sides (K,) of the faces, numbered as in face_edges, and of each the next one (K,) that is of the same edge.

    Ordered by the edge, smaller id first, and along an edge by number: one that m faces have is there m - 1 times.
    """
    keys = _keys(face_edges(faces), int(faces.max(initial=0)) + 1)
    order = np.argsort(keys, kind="stable")
    shared = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    return order[shared], order[shared + 1]


@dataclass(frozen=True)
class SewingFaults:
    """Edges (K, 2) of the unsewn mesh that must be cut for the sewn one to be an edge-manifold, smaller id first."""

    inner: Indices  # edges inside a piece: cut them by a vertex
    outline: Indices  # edges of an outline: sample that edge of the piece more finely

    @property
    def vertices(self) -> Indices:
        """Their vertices (K,), each once."""
        return np.unique(np.vstack([self.inner, self.outline]))

    def __bool__(self) -> bool:
        return len(self.inner) + len(self.outline) > 0


def sewing_faults(faces: Indices, merged: Indices, sewn_edges: Indices) -> SewingFaults:
    """The edges of the unsewn faces (F, 3) that collapse or coincide when sewn, though no seam joins them.

    merged: merged vertex of every vertex, as from merge(). sewn_edges: (P, 2, 2) outline edges that a seam joins.
    """
    directed = face_edges(faces)
    edges, _, side, uses = distinct(ascending(directed))
    on_outline = uses == 1
    merged_edges = ascending(merged[edges])
    group = distinct(merged_edges).which
    inner_count = np.bincount(group, weights=~on_outline)[group]
    outline_count = np.bincount(group, weights=on_outline)[group]
    in_seam = np.isin(_keys(edges, len(merged)), _keys(sewn_edges.reshape(-1, 2), len(merged)))
    # An outline edge may coincide with its partner of the seam and with nothing else, an inner edge with nothing.
    alone = np.where(on_outline, outline_count == np.where(in_seam, 2, 1), outline_count == 0)
    alone &= inner_count == np.where(on_outline, 0, 1)
    bad = ~alone | (merged_edges[:, 0] == merged_edges[:, 1])
    # Cutting inner edges is enough wherever there are any: an outline's edge is shared with its neighbours.
    inner = bad & ~on_outline
    cured = np.isin(group, group[inner])
    at_outline = (bad & ~cured) | _sides_of_doubled_faces(faces, merged, side.reshape(-1, 3), inner)
    return SewingFaults(edges[inner].astype(np.int32), edges[at_outline & on_outline].astype(np.int32))


def pinched(faces: Indices, vertex_count: int) -> Indices:
    """Vertices (K,) in which parts of the surface meet that share no edge there, for welded faces (F, 3)."""
    edges = face_edges(faces)
    one, other = sides_of_one_edge(faces)
    # A node is a face's corner; two corners at one vertex are joined when their faces share an edge there.
    corners = np.stack(
        [np.arange(faces.size), np.roll(np.arange(faces.size).reshape(-1, 3), -1, axis=1).ravel()], axis=1
    )
    same_way = edges[one, 0] == edges[other, 0]
    joined = np.where(same_way[:, None], corners[other], corners[other][:, ::-1])
    links = (np.ones(2 * len(one)), (corners[one].ravel(), joined.ravel()))
    _, fan = connected_components(coo_array(links, shape=(faces.size, faces.size)), directed=False)
    fans = distinct(np.stack([faces.ravel(), fan], axis=1)).rows
    return np.flatnonzero(np.bincount(fans[:, 0], minlength=vertex_count) > 1).astype(np.int32)


def _keys(edges: Indices, vertex_count: int) -> NDArray[np.int64]:
    """One number per undirected edge (K, 2)."""
    ordered = ascending(edges).astype(np.int64)
    return ordered[:, 0] * vertex_count + ordered[:, 1]


def _sides_of_doubled_faces(
    faces: Indices, merged: Indices, sides: NDArray[np.intp], cut: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Whether each edge is a side of a face that another face coincides with when sewn, and that no cut edge cures.

    sides: (F, 3) edge of each side. cut: whether each edge is to be cut anyway.
    """
    _, _, group, copies = distinct(np.sort(merged[faces], axis=1))
    uncured = (copies[group] > 1) & ~cut[sides].any(axis=1)
    result = np.zeros(len(cut), dtype=bool)
    result[sides[uncured]] = True
    return result
