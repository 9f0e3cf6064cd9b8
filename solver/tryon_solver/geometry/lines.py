"""Lines of a garment along the edges of its mesh: where elastic is sewn, where a crease is pressed."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra

from tryon_solver.geometry.garment import Garment


def line_between(garment: Garment, start: int, end: int) -> np.ndarray:
    """(K, 2) int32 edges, one after the other, of the shortest way along edges of the mesh from vertex to vertex, by
    their length in the pattern. Raises ValueError where none leads there."""
    first = garment.faces.ravel().astype(np.int64)
    second = garment.faces[:, [1, 2, 0]].ravel().astype(np.int64)
    length = np.linalg.norm(garment.uv_corners[:, [1, 2, 0]] - garment.uv_corners, axis=2).ravel()
    count = garment.vertex_count
    low, high = np.minimum(first, second), np.maximum(first, second)
    _, once = np.unique(low * count + high, return_index=True)
    graph = sp.csr_matrix((length[once], (low[once], high[once])), shape=(count, count))
    _, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    way = [end]
    while way[-1] != start:
        previous = int(before[way[-1]])
        if previous < 0:
            raise ValueError(f"line: no edges lead from vertex {start} to vertex {end}; name two of one piece")
        way.append(previous)
    return chain(np.array(way[::-1]))


def chain(vertices: np.ndarray, closed: bool = False) -> np.ndarray:
    """(K, 2) int32 edges from each of the vertices to the next, and from the last to the first if it is `closed`."""
    following = np.roll(vertices, -1)
    pairs = np.column_stack([vertices, following]).astype(np.int32)
    return pairs if closed else pairs[:-1]


def corners_of_edges(garment: Garment, edges: np.ndarray, name: str) -> np.ndarray:
    """(K, 2) int32: of a triangle at each edge (K, 2), which of all 3 F corners are the edge's ends. Raises ValueError,
    beginning with `name`, for a pair of vertices that is no edge."""
    faces, count = garment.faces.astype(np.int64), garment.vertex_count
    here = np.arange(faces.size)
    there = here + np.tile([1, 1, -2], len(faces))
    first, second = faces.ravel()[here], faces.ravel()[there]
    keys = np.concatenate([first * count + second, second * count + first])
    ends = np.vstack([np.column_stack([here, there]), np.column_stack([there, here])])
    order = np.argsort(keys, kind="stable")
    wanted = edges[:, 0].astype(np.int64) * count + edges[:, 1]
    at = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    said, remedy = f"{name}: no triangle has the edge", "edges of the garment's mesh"
    refuse_strangers(keys[order][at] == wanted, edges, said, remedy)
    return ends[order][at].astype(np.int32)


def hinges_of_edges(garment: Garment, edges: np.ndarray, name: str) -> np.ndarray:
    """(K,) int64: which of the garment's hinges each edge (K, 2) is. Raises ValueError, beginning with `name`, for a
    pair of vertices that is none: no edge, or one at the border."""
    count = garment.vertex_count
    hinges = np.sort(garment.hinges()[:, :2], axis=1)
    keys = hinges[:, 0] * count + hinges[:, 1]
    order = np.argsort(keys, kind="stable")
    sorted_edges = np.sort(edges.astype(np.int64), axis=1)
    wanted = sorted_edges[:, 0] * count + sorted_edges[:, 1]
    at = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    said, remedy = f"{name}: no two triangles share the edge", "edges of the garment's mesh that are not at its border"
    refuse_strangers(keys[order][at] == wanted, edges, said, remedy)
    return order[at]


def refuse_strangers(found: np.ndarray, edges: np.ndarray, said: str, remedy: str) -> None:
    """Raise ValueError for the first edge that was not found."""
    if not found.all():
        a, b = edges[int(np.argmin(found))]
        raise ValueError(f"{said} {int(a)}-{int(b)}; give {remedy}")
