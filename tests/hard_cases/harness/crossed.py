"""Which triangles of a frame cross others: IPC Toolkit says it of every pair of an edge and a triangle that may."""

from __future__ import annotations

import ipctk
import numpy as np
from scipy.spatial import cKDTree

CLOSE = 1e-6  # of a triangle's size: so far outside a meeting point may seem, by rounding, before the toolkit is asked


class Crossings:
    """Prepared for one cloth and one body; the body with itself is nobody's business."""

    def __init__(self, faces: np.ndarray, body_faces: np.ndarray, cloth_count: int) -> None:
        """Faces (F, 3) of each in its own numbering."""
        self.faces, self.count, theirs = faces, cloth_count, body_faces + cloth_count
        own, body = edges_of(faces), edges_of(theirs)
        self.asked = ((own, faces), (own, theirs), (body, faces))

    def among(self, cloth: np.ndarray, body: np.ndarray) -> np.ndarray:
        """(F,) bool: triangles of the cloth that cross cloth or body; none where a position is not a number."""
        x = np.vstack([cloth, body]).astype(np.float64)
        edges_found: set[tuple[int, int]] = set()
        found = np.zeros(len(self.faces), bool)
        if not np.isfinite(x).all():
            return found
        for edges, triangles in self.asked:
            for edge, triangle in pairs(x, edges, triangles):
                ends = edges[edge]
                if ipctk.is_edge_intersecting_triangle(*x[ends], *x[triangles[triangle]]):
                    edges_found.add((int(ends[0]), int(ends[1])))
                    if triangles is self.faces:
                        found[triangle] = True
        for k in range(3):
            sides = np.sort(self.faces[:, [k, (k + 1) % 3]], axis=1)
            found |= np.array([(a, b) in edges_found for a, b in sides.tolist()], bool)
        return found


def edges_of(faces: np.ndarray) -> np.ndarray:
    """(E, 2) edges, each once, smaller vertex first."""
    sides = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(sides, axis=1), axis=0)


def pairs(x: np.ndarray, edges: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(P, 2) numbers of edges and triangles that may cross: they share no vertex, and the plane is met about there."""
    if not len(edges) or not len(triangles):
        return np.zeros((0, 2), np.int64)
    middles, centres = x[edges].mean(1), x[triangles].mean(1)
    half = np.linalg.norm(x[edges[:, 0]] - middles, axis=1)
    reach = float(np.linalg.norm(x[triangles] - centres[:, None], axis=2).max())
    near = cKDTree(centres).query_ball_point(middles, half + reach)
    edge = np.repeat(np.arange(len(edges)), [len(n) for n in near])
    triangle = np.concatenate([np.array(n, np.int64) for n in near])
    apart = ~(edges[edge][:, :, None] == triangles[triangle][:, None]).any((1, 2))
    edge, triangle = edge[apart], triangle[apart]
    a, b, c = x[triangles[triangle]].swapaxes(0, 1)
    p, q = x[edges[edge]].swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    first, second = (((end - a) * normal).sum(1) for end in (p, q))
    flat = first == second  # parallel to the plane: the toolkit's to say
    share = first / np.where(flat, 1.0, first - second)
    at = p + share[:, None] * (q - p)
    area = (normal * normal).sum(1)
    inside = [(np.cross(v - u, at - u) * normal).sum(1) >= -CLOSE * area for u, v in ((a, b), (b, c), (c, a))]
    may = (first * second <= 0) & (np.all(inside, axis=0) | flat)
    return np.column_stack([edge, triangle])[may]
