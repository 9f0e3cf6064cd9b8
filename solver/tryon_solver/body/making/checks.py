"""What a body's surface must be: closed, manifold, outward, of one piece, free of self-intersections."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree


def surface_faults(vertices: np.ndarray, faces: np.ndarray) -> list[str]:
    """Sentences about what is wrong with a surface (vertices (V, 3) m, faces (F, 3)); empty for a sound one."""
    faults = []
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    forward, reverse = directed @ [len(vertices), 1], directed @ [1, len(vertices)]
    if len(np.unique(forward)) != len(forward):
        faults.append("an edge is used twice in one direction: not manifold or not consistently oriented")
    if not np.isin(forward, reverse).all():
        faults.append("the surface has a boundary")
    if len(np.unique(faces)) != len(vertices):
        faults.append("a vertex belongs to no triangle")
    graph = coo_matrix((np.ones(len(directed)), directed.T), shape=(len(vertices), len(vertices)))
    pieces = connected_components(graph, directed=False)[0]
    if pieces != 1:
        faults.append(f"the surface has {pieces} pieces")
    if len(vertices) - len(directed) // 2 + len(faces) != 2:
        faults.append("the surface is not a sphere topologically")
    if volume(vertices, faces) <= 0.0:
        faults.append("the triangles face inwards")
    crossings = len(self_intersections(vertices, faces))
    if crossings:
        faults.append(f"{crossings} edges pass through a triangle")
    return faults


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Enclosed volume [m^3], positive when the triangles face outwards."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def self_intersections(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(P, 2) int: pairs (edge, face) that cross without sharing a vertex, in float64; edges number as np.unique's.

    Candidates are the pairs whose bounding spheres meet, found by k-d trees over groups of similar radius, since a
    posed body has a few triangles that are stretched several times over.
    """
    corners = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges = np.unique(np.sort(corners, axis=1), axis=0)
    ends, triangles = vertices[edges], vertices[faces]
    e, f = _meeting_spheres(ends, triangles)
    apart = ~(edges[e][:, :, None] == faces[f][:, None, :]).any(axis=(1, 2))
    e, f = e[apart], f[apart]

    start, direction = ends[e, 0], ends[e, 1] - ends[e, 0]
    a = triangles[f, 0]
    u, w = triangles[f, 1] - a, triangles[f, 2] - a
    p = np.cross(direction, w)
    determinant = (u * p).sum(axis=1)
    safe = np.where(np.abs(determinant) < 1e-18, np.inf, determinant)
    first = ((start - a) * p).sum(axis=1) / safe
    q = np.cross(start - a, u)
    second, along = (direction * q).sum(axis=1) / safe, (w * q).sum(axis=1) / safe
    crossing = (first >= 0) & (second >= 0) & (first + second <= 1) & (along >= 0) & (along <= 1) & np.isfinite(safe)
    return np.stack([e[crossing], f[crossing]], axis=1)


def _meeting_spheres(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices into both of the pairs of point sets (N, k, 3) and (M, l, 3) whose spheres about their means meet."""
    centres = [points.mean(axis=1) for points in (first, second)]
    radii = [np.linalg.norm(p - c[:, None], axis=-1).max(axis=1) for p, c in zip((first, second), centres)]
    found: list[tuple[np.ndarray, np.ndarray]] = []
    for a in _by_radius(radii[0]):
        tree = cKDTree(centres[0][a])
        for b in _by_radius(radii[1]):
            reach = radii[0][a].max() + radii[1][b].max()
            near = tree.sparse_distance_matrix(cKDTree(centres[1][b]), reach, output_type="coo_matrix")
            i, j = a[near.row], b[near.col]
            meets = near.data <= radii[0][i] + radii[1][j]
            found.append((i[meets], j[meets]))
    return np.concatenate([i for i, _ in found]), np.concatenate([j for _, j in found])


def _by_radius(radii: np.ndarray) -> list[np.ndarray]:
    """Indices in groups within which the radius varies by a factor of two at most, above the median."""
    level = np.ceil(np.log2(np.maximum(radii / np.median(radii), 1.0)))
    return [np.flatnonzero(level == value) for value in np.unique(level)]
