"""From a stranger's triangles to one consistently turned surface: joined along seams, each triangle once."""

from __future__ import annotations

from collections import deque

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tryon_solver.geometry.distinct import ascending, distinct
from tryon_solver.geometry.seams import face_edges, merge, sides_of_one_edge

WELD = 1e-4  # m, vertices on open edges nearer than this are one: exporters split them along seams of the texture
ALONG = 0.05  # share of an open edge's length by which both its ends may miss those of another that is the same edge
ALONG_MOST = 5e-4  # m, and no further than this: less than fabrics are thick
GAPING = 0.3, 5e-3  # as these two, of edges that may be meant to be one and are not joined


def boundary_vertices(faces: np.ndarray) -> np.ndarray:
    """Ids, sorted, of the vertices on edges that only one triangle has."""
    edges, counts = _edges(faces)
    return np.unique(edges[counts == 1])


def open_edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(K, 2) the edges that only one triangle has, smaller vertex first, and (K,) that triangle."""
    edges, first, _, counts = distinct(_sides(faces))
    return edges[counts == 1], first[counts == 1] // 3


def weld_coincident(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(V,) the vertex each one becomes: those on open edges that lie within WELD of each other are one, and then the
    ends of open edges that lie along each other, within ALONG of their length and ALONG_MOST.

    `vertices` (V, 3) m. Vertices of one triangle are never joined. A triangle and its copy on the same vertices, as
    double-sided exports have them, count as one: an edge that only they have is open.
    """
    faces = faces[~twins(faces)]
    open_ids = boundary_vertices(faces)
    pairs = open_ids[cKDTree(vertices[open_ids]).query_pairs(WELD, output_type="ndarray")].reshape(-1, 2)
    joined = merge(len(vertices), _of_no_edge(pairs, faces))
    count = np.bincount(joined)
    middles = np.stack([np.bincount(joined, vertices[:, k]) / count for k in range(3)], axis=1)
    merged = joined[faces]
    merged = merged[three_corners(merged)]
    merged = merged[~twins(merged)]
    return merge(len(middles), _of_no_edge(_along(middles, merged, ALONG, ALONG_MOST), merged))[joined]


def gaping(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(K, 2) pairs of vertices, ends of open edges that lie along each other too far apart to be welded."""
    return _of_no_edge(_along(vertices, faces, *GAPING), faces)


def _along(vertices: np.ndarray, faces: np.ndarray, share: float, most: float) -> np.ndarray:
    """(K, 2) pairs of ends of open edges that lie along each other, within a share of their length and `most` m."""
    edges, counts = _edges(faces)
    edges = edges[counts == 1]
    ends = vertices[edges]
    within = np.minimum(share * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), most)
    if not len(edges):
        return np.empty((0, 2), np.int64)
    near = cKDTree(ends.mean(axis=1)).query_pairs(float(within.max()), output_type="ndarray").reshape(-1, 2)
    one, other = near.T
    allowed = np.minimum(within[one], within[other])
    pairs = []
    for turned in (ends, ends[:, ::-1]):
        alike = np.linalg.norm(ends[one] - turned[other], axis=2).max(axis=1) <= allowed
        ids = edges if turned is ends else edges[:, ::-1]
        pairs.append(np.stack([edges[one[alike]], ids[other[alike]]], axis=-1).reshape(-1, 2))
    found = np.vstack(pairs)
    return found[found[:, 0] != found[:, 1]]


def _of_no_edge(pairs: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Those pairs of vertices that no triangle joins, int32."""
    if not len(pairs):
        return pairs.astype(np.int32)
    which = distinct(np.vstack([ascending(pairs), _sides(faces)])).which
    return pairs[~np.isin(which[: len(pairs)], which[len(pairs) :])].astype(np.int32)


def three_corners(faces: np.ndarray) -> np.ndarray:
    """(F,) which triangles have three different vertices."""
    return (faces != np.roll(faces, 1, axis=1)).all(axis=1)


def hanging_on_none(faces: np.ndarray) -> np.ndarray:
    """Triangles, sorted, that share no side with another."""
    _, _, which, counts = distinct(_sides(faces))
    return np.flatnonzero((counts[which.reshape(-1, 3)] == 1).all(axis=1))


def usual_gap(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Median distance [m] from a corner of these triangles to the next vertex."""
    used = vertices[np.unique(faces)]
    return float(np.median(cKDTree(used).query(used, k=2)[0][:, 1]))


def crowded_edges(faces: np.ndarray) -> np.ndarray:
    """Triangles, sorted, at edges that more than two triangles have."""
    _, _, which, counts = distinct(_sides(faces))
    return np.flatnonzero((counts[which.reshape(-1, 3)] > 2).any(axis=1))


def twins(faces: np.ndarray) -> np.ndarray:
    """(F,) which triangles are the second copy of another, as double-sided exports have them."""
    low, middle, high = np.sort(faces, axis=1).T
    ends = distinct(np.column_stack([low, high])).which  # three numbers at once might be too large for it
    first = distinct(np.column_stack([ends, middle])).first
    copy = np.ones(len(faces), bool)
    copy[first] = False
    return copy


def turned_alike(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which triangles to turn over so that neighbours turn alike, (F,) bool; each one's part, (F,); and the triangles
    where that can't be (a Moebius strip), sorted."""
    sides = face_edges(faces)
    forward = sides[:, 0] < sides[:, 1]
    one, other = sides_of_one_edge(faces)
    differ = forward[one] == forward[other]  # neighbours that turn alike run along their common side in opposite senses
    links = np.stack([one, other], axis=1) // 3
    # Each triangle is there as it is and, numbered after all, turned over: what hangs together then turns alike. Which
    # of the two hangs together with the part's first triangle as that is, has been met first.
    count = len(faces)
    over = links + np.where(differ[:, None], [[0, count]], 0)
    met = merge(2 * count, np.vstack([over, (over + count) % (2 * count)]))
    as_is, turned = met[:count], met[count:]
    part = np.unique(np.minimum(as_is, turned), return_inverse=True)[1]
    flipped = as_is > turned
    one_sided = as_is == turned
    if one_sided.any():
        within = one_sided[links[:, 0]]
        _turn_one_by_one(flipped, np.flatnonzero(one_sided), links[within], differ[within])
    torn = (flipped[links[:, 0]] != flipped[links[:, 1]]) != differ
    return flipped, part, np.unique(links[torn])


def _turn_one_by_one(flipped: np.ndarray, torn: np.ndarray, links: np.ndarray, differ: np.ndarray) -> None:
    """Set `flipped` (F,) of triangles `torn` (K,) that can't all turn alike: each as the one it is reached from, over
    `links` (L, 2) between them, from each part's first triangle on, the nearest first. `differ` (L,) of links says
    which join triangles that turn differently."""
    around: dict[int, list[tuple[int, bool]]] = {face: [] for face in torn.tolist()}
    for (left, right), turn in zip(links.tolist(), differ.tolist()):
        around[left].append((right, turn))
        around[right].append((left, turn))
    wanted: dict[int, bool] = {}
    for seed in around:
        if seed in wanted:
            continue
        wanted[seed] = False
        queue = deque([seed])
        while queue:
            here = queue.popleft()
            for there, turn in around[here]:
                if there not in wanted:
                    wanted[there] = wanted[here] != turn
                    queue.append(there)
    flipped[list(wanted)] = list(wanted.values())


def connected_faces(face_count: int, pairs: np.ndarray) -> np.ndarray:
    """(F,) label of each triangle's component, when the triangles of each pair (K, 2) hang together."""
    links = (np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1]))
    return connected_components(coo_array(links, shape=(face_count, face_count)), directed=False)[1]


def neighbours(faces: np.ndarray) -> np.ndarray:
    """(K, 4): two triangles at one edge, and which side of each, 0 to 2, it is."""
    one, other = sides_of_one_edge(faces)
    return np.column_stack([one // 3, other // 3, one % 3, other % 3])


def _edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    edges, _, _, counts = distinct(_sides(faces))
    return edges, counts


def _sides(faces: np.ndarray) -> np.ndarray:
    """(3 F, 2) side by side of each triangle, smaller vertex first."""
    return ascending(face_edges(faces))
