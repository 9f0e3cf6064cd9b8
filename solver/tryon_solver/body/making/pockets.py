"""Closes the pockets of the head - mouth, eyes, nostrils, ear shells - so that a coarse mesh of it stays clean.

Behind its lips and eyelids the MakeHuman head has bags. A garment never reaches them, a streamed body needs no teeth,
and a mesh of 15 mm edges folds there. Vertices that look onto the head itself are taken as pocket, and the surface
over them is replaced by the smooth membrane (bilaplacian, graph weights) through its surroundings.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from tryon_solver.geometry.normals import vertex_normals

REACH = 0.08  # m, how far a vertex looks along its normal for the opposite wall of a pocket
RINGS = 3  # rings of neighbours replaced with a pocket: lips, eyelids
START = 1e-5  # m, the look starts off the surface


def close_pockets(vertices: np.ndarray, faces: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Vertices (V, 3) m with the pockets among `where` (V,) bool closed; the faces (F, 3) stay as they are."""
    pocket = _facing_itself(vertices, faces, where)
    for _ in range(RINGS):
        pocket[faces[pocket[faces].any(axis=1)]] = True
    pocket &= where
    return _membrane(vertices, faces, pocket)


def _facing_itself(vertices: np.ndarray, faces: np.ndarray, where: np.ndarray) -> np.ndarray:
    """(V,) bool: vertices of `where` whose ray along the normal meets a face of `where` within REACH."""
    normals = vertex_normals(vertices, faces)
    walls = faces[where[faces].any(axis=1)]
    a = vertices[walls[:, 0]]
    u, w = vertices[walls[:, 1]] - a, vertices[walls[:, 2]] - a
    found = np.zeros(len(vertices), dtype=bool)
    asked = np.flatnonzero(where)
    for chunk in np.array_split(asked, max(1, len(asked) // 64)):
        direction = normals[chunk][:, None]
        to_origin = vertices[chunk][:, None] + START * direction - a
        p = np.cross(direction, w)
        determinant = (u * p).sum(axis=-1)
        safe = np.where(np.abs(determinant) < 1e-14, np.inf, determinant)
        first = (to_origin * p).sum(axis=-1) / safe
        q = np.cross(to_origin, u)
        second = (direction * q).sum(axis=-1) / safe
        distance = (w * q).sum(axis=-1) / safe
        met = (first >= 0) & (second >= 0) & (first + second <= 1) & (distance > 0) & (distance < REACH)
        found[chunk] = met.any(axis=1)
    return found


def _membrane(vertices: np.ndarray, faces: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Vertices with the free ones placed where their graph bilaplacian vanishes, the others given."""
    count = len(vertices)
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    ones = np.ones(len(pairs))
    adjacency = sparse.csr_matrix((ones, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    valence = np.asarray(adjacency.sum(axis=1)).ravel()
    laplacian = sparse.identity(count) - sparse.diags(1.0 / valence) @ adjacency
    bilaplacian = (laplacian @ laplacian).tocsr()
    inner, outer = np.flatnonzero(free), np.flatnonzero(~free)
    moved = vertices.copy()
    if inner.size:
        right = -bilaplacian[inner][:, outer] @ vertices[outer]
        moved[inner] = spsolve(bilaplacian[inner][:, inner].tocsc(), right)
    return moved
