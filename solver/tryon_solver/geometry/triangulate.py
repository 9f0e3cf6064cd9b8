"""Fills an outline with nearly equilateral triangles of one edge length, keeping the outline's own points.

A hexagonal lattice inside, the Delaunay triangulation of all points with the outline forced into it, and rounds of
moving each inner point to the area-weighted centroid of its triangles (after L. Chen and J. Xu, "Optimal Delaunay
triangulations", J. Comp. Math. 22, 2004), which also spreads the lattice evenly up to the outline. From round to round
the triangulation is kept Delaunay by flips (delaunay_flips.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay, cKDTree

from tryon_solver.geometry import outline
from tryon_solver.geometry.constrained import Faces, Points, TriangulationError, constrain
from tryon_solver.geometry.delaunay_flips import KeptDelaunay

# In edge lengths. Lattice points this near to the outline would make flat triangles with it; a row of equilateral
# triangles is 0.87 high, and smoothing draws the points between 0.55 and 1.4 there.
OUTLINE_MARGIN = 0.55
# A circumscribed circle larger than this is a hole that the lattice and the outline left between them (0.58 is ideal).
HOLE_RADIUS = 0.85
SMOOTHING_ROUNDS = 18
FILLING_ROUNDS = (4, 8, 12)
# A triangle of this share of the squared edge length is flat: three points of one straight edge of the outline.
FLAT = 1e-9
# A triangle of less than this share of the mean area may have its middle on the outline, within rounding.
PLAIN = 1e-3
# Inner points around an angle below this [degrees] are moved one by one at the end.
POLISH_BELOW = 32.0
POLISH_ROUNDS = 12


def triangulate(boundary: Points, edge_length: float) -> tuple[Points, Faces]:
    """Points (V, 2) m, the boundary first and unchanged, and counter-clockwise faces (F, 3) that fill it exactly.

    boundary: (n, 2) m, a counter-clockwise outline that does not touch itself, n >= 3, in steps of about edge_length.
    Raises TriangulationError when no triangulation contains the outline (it touches itself within rounding).
    """
    points = np.vstack([boundary, _lattice(boundary, edge_length)])
    kept = KeptDelaunay(_delaunay_inside(points, len(boundary), edge_length))
    for round_ in range(SMOOTHING_ROUNDS):
        if round_ in FILLING_ROUNDS:
            before = len(points)
            points = _fill_holes(points, kept.faces, boundary, edge_length)
            kept.add(points, range(before, len(points)))
        points = _smoothed(points, kept.faces, len(boundary))
        kept.restore(points)
    return polish(points, kept.faces, len(boundary), edge_length), kept.faces


def polish(points: Points, faces: Faces, fixed: int, edge_length: float) -> Points:
    """The points with inner ones around small angles moved so that the smallest angle there grows; faces stay valid.

    points: (V, 2) m, of which the first `fixed` stay. A pattern search around one vertex at a time, in index order.
    """
    points = points.copy()
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    corner = np.argsort(faces, axis=None, kind="stable")
    first = np.searchsorted(faces.ravel()[corner], np.arange(len(points) + 1))
    smallest = corner_angles(points, faces).min(axis=1)
    for round_ in range(POLISH_ROUNDS):
        step = 0.15 * edge_length * 0.8**round_
        bad = faces[smallest < POLISH_BELOW]
        for vertex in np.unique(bad[bad >= fixed]):
            around = corner[first[vertex] : first[vertex + 1]] // 3
            candidates = points[vertex] + np.vstack([[[0.0, 0.0]], step * directions, 0.3 * step * directions])
            points[vertex] = candidates[np.argmax(_worst_angles(points, faces[around], vertex, candidates))]
            smallest[around] = corner_angles(points, faces[around]).min(axis=1)
    return points


def split_edges(points: Points, faces: Faces, edges: NDArray[np.int32], fixed: int) -> tuple[Points, Faces]:
    """Points and faces with a new vertex in the middle of each given inner edge (K, 2), at the centroid of its quad."""
    for u, v in edges.tolist():
        around = np.flatnonzero((faces == u).any(axis=1) & (faces == v).any(axis=1))
        if len(around) != 2:
            continue  # the edge went when a neighbouring one was split
        new = len(points)
        points = np.vstack([points, points[np.unique(faces[around])].mean(axis=0)])
        halves = [np.where(faces[around] == end, new, faces[around]) for end in (u, v)]
        faces = np.vstack([np.delete(faces, around, axis=0), *halves]).astype(np.int32)
    scale = float(np.linalg.norm(np.diff(points[:fixed], axis=0), axis=1).mean())
    return polish(points, faces, fixed, scale), faces


def signed_areas(points: Points, faces: Faces) -> Points:
    """Areas [m^2] of the triangles (F,), positive counter-clockwise."""
    x, y = np.ascontiguousarray(points.T)
    a, b, c = np.ascontiguousarray(faces.T)
    (ax, ay), (bx, by), (cx, cy) = ((x[k], y[k]) for k in (a, b, c))
    return 0.5 * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))


def corner_angles(points: Points, faces: Faces) -> Points:
    """Angles [degrees] at the triangles' corners, shape (F, 3); negative in a clockwise triangle."""
    p = points[faces]
    to_next, to_previous = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    cross = to_next[..., 0] * to_previous[..., 1] - to_next[..., 1] * to_previous[..., 0]
    return np.degrees(np.arctan2(cross, np.sum(to_next * to_previous, axis=2)))


def _worst_angles(points: Points, star: Faces, vertex: int, places: Points) -> Points:
    """Smallest angle [degrees] in the faces (S, 3) around a vertex were it at each of the places (K, 2) m, (K,)."""
    corners = np.where((star == vertex)[..., None], places[:, None, None], points[star])
    separate = np.arange(len(places) * star.size, dtype=np.int32).reshape(-1, 3)
    return corner_angles(corners.reshape(-1, 2), separate).reshape(len(places), -1).min(axis=1)


def _lattice(boundary: Points, edge_length: float) -> Points:
    """Points of a hexagonal lattice, rows along x, centred in the outline's box, that keep the margin to it."""
    low, high = boundary.min(axis=0), boundary.max(axis=0)
    row_height = edge_length * np.sqrt(3) / 2
    columns, rows = np.ceil((high - low) / (2 * edge_length, 2 * row_height)).astype(int) + 1
    i, j = np.meshgrid(np.arange(-columns, columns + 1), np.arange(-rows, rows + 1))
    offsets = np.stack([(i + 0.5 * (j % 2)) * edge_length, j * row_height], axis=-1).reshape(-1, 2)
    points = (low + high) / 2 + offsets
    points = points[outline.contains(boundary, points)]
    return points[_farther(boundary, points, OUTLINE_MARGIN * edge_length)]


def _farther(boundary: Points, points: Points, than: float) -> NDArray[np.bool_]:
    """Whether each point (K, 2) m is farther from the outline than that [m], shape (K,): as `outline.distance` tells.

    A segment that is nearer has an end no farther than that and its own length: only those are asked.
    """
    ends = np.roll(boundary, -1, axis=0)
    longest = np.linalg.norm(ends - boundary, axis=1).max()
    near = cKDTree(points).sparse_distance_matrix(cKDTree(boundary), 1.001 * (than + longest), output_type="ndarray")
    point, corner = np.tile(near["i"], 2), np.concatenate([near["j"], near["j"] - 1])  # begins there, or ends there
    result = np.ones(len(points), dtype=bool)
    result[point[outline.segment_distances(points[point], boundary[corner], ends[corner]) <= than]] = False
    return result


def _delaunay_inside(points: Points, boundary_count: int, edge_length: float) -> Faces:
    """The triangles of the constrained Delaunay triangulation inside the outline, the loop of the first points."""
    # SciPy orients the triangles by their connection, so that flat ones between points of a straight edge agree too.
    faces = Delaunay(points).simplices.astype(np.int32)
    ids = np.arange(boundary_count, dtype=np.int32)
    loop = np.stack([ids, np.roll(ids, -1)], axis=1)
    sides = _sides_of_loop(faces, boundary_count)
    if not sides.whole:
        faces = constrain(points, faces, loop)
        sides = _sides_of_loop(faces, boundary_count)
    inside = _inside_at_a_glance(points, faces, boundary_count, sides)
    faces = faces[_inside(points, faces, loop) if inside is None else inside]
    flat = np.flatnonzero(signed_areas(points, faces) < FLAT * edge_length**2)
    return _unflattened(points, faces, flat) if len(flat) else faces


@dataclass(frozen=True)
class _LoopSides:
    """Which faces (F,) have an edge of the outline as a side and lie left of it, which right of it, and whether there
    is a face at every such edge."""

    left: NDArray[np.bool_]
    right: NDArray[np.bool_]
    whole: bool


def _sides_of_loop(faces: Faces, count: int) -> _LoopSides:
    """For the outline that is the loop of the first `count` points."""
    near = np.flatnonzero((faces < count).sum(axis=1) >= 2)
    start, end = faces[near], np.roll(faces[near], -1, axis=1)
    on_loop = (start < count) & (end < count)
    along, back = on_loop & (end == (start + 1) % count), on_loop & (start == (end + 1) % count)
    left, right = np.zeros(len(faces), bool), np.zeros(len(faces), bool)
    left[near], right[near] = along.any(axis=1), back.any(axis=1)
    there = np.zeros(count, bool)
    there[start[along]] = there[end[back]] = True
    return _LoopSides(left, right, bool(there.all()))


def _inside_at_a_glance(
    points: Points, faces: Faces, count: int, sides: _LoopSides
) -> NDArray[np.bool_] | None:
    """Which faces lie inside the loop of the first `count` points, where that is plain; None where it is not.

    Plain it is of faces with a point off the outline, all of which are inside, of those at one of its edges, and of
    those whose middle tells; and if the area inside comes out right.
    """
    inside = sides.left | (faces >= count).any(axis=1)
    if (inside & sides.right).any():
        return None
    areas = signed_areas(points, faces)
    open_ = np.flatnonzero(~inside & ~sides.right)
    polygon = points[:count]
    wanted = outline.signed_area(polygon)
    if (areas[open_] < PLAIN * wanted / len(faces)).any():
        return None
    inside[open_] = outline.contains(polygon, points[faces[open_]].mean(axis=1))
    return inside if abs(areas[inside].sum() - wanted) <= 1e-9 * wanted else None


def _inside(points: Points, faces: Faces, loop: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Which faces lie inside the loop of edges (n, 2): those reached from one inside without crossing the loop.

    Flat triangles between three points of a straight edge have no side of their own; their connection decides.
    """
    count = len(points)
    ends = np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1).astype(np.int64)
    sides = ends @ np.array([count, 1])
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.argsort(sides, kind="stable")
    sides, owner = sides[order], owner[order]
    shared = np.flatnonzero(sides[1:] == sides[:-1])
    shared = shared[~np.isin(sides[shared], np.sort(loop, axis=1).astype(np.int64) @ [count, 1])]
    pairs = (np.ones(len(shared)), (owner[shared], owner[shared + 1]))
    parts, part = connected_components(coo_array(pairs, shape=(len(faces), len(faces))), directed=False)
    areas = signed_areas(points, faces)
    largest = np.array([np.flatnonzero(part == k)[np.argmax(areas[part == k])] for k in range(parts)])
    polygon = points[loop[:, 0]]
    inside = outline.contains(polygon, points[faces[largest]].mean(axis=1))
    # The inside of a simple outline is connected: among parts that seem inside only one has the outline's area.
    wanted = outline.signed_area(polygon)
    total = np.bincount(part, weights=areas, minlength=parts)
    best = int(np.argmin(np.where(inside, np.abs(total - wanted), np.inf)))
    if not inside[best] or abs(total[best] - wanted) > 1e-9 * wanted:
        raise TriangulationError("the outline touches itself")
    return part == best


def _unflattened(points: Points, faces: Faces, flat: NDArray[np.intp]) -> Faces:
    """The faces with each flat one merged away by flipping its longest side."""
    faces = faces.copy()
    for face in flat:
        a, b, c = faces[face]
        lengths = [np.hypot(*(points[q] - points[p])) for p, q in ((b, c), (c, a), (a, b))]
        top = int(np.argmax(lengths))
        tip, u, v = faces[face][[top, (top + 1) % 3, (top + 2) % 3]]
        other = np.flatnonzero((faces == u).any(axis=1) & (faces == v).any(axis=1) & (np.arange(len(faces)) != face))
        if len(other) != 1:
            raise TriangulationError("the outline encloses a flat triangle")
        far = int(faces[other[0]].sum() - u - v)
        faces[face], faces[other[0]] = (tip, u, far), (tip, far, v)
    return faces


def _smoothed(points: Points, faces: Faces, fixed: int) -> Points:
    """Points with each inner one at the area-weighted centroid of its triangles; the first `fixed` stay.

    A point whose move would turn a triangle over stays too, so that none can leave the outline.
    """
    areas = signed_areas(points, faces)
    corner = faces.ravel()
    total = np.bincount(corner, weights=np.repeat(areas, 3), minlength=len(points))
    smoothed = points.copy()
    for k in (0, 1):
        at = points[:, k]
        weighted = areas * ((at[faces[:, 0]] + at[faces[:, 1]] + at[faces[:, 2]]) / 3)
        moved = np.bincount(corner, weights=np.repeat(weighted, 3), minlength=len(points))
        smoothed[fixed:, k] = moved[fixed:] / total[fixed:]
    while True:
        turned = faces[signed_areas(smoothed, faces) <= 0]
        held = turned[(smoothed[turned] != points[turned]).any(axis=2)]
        if len(held) == 0:
            return smoothed
        smoothed[held] = points[held]


def _fill_holes(points: Points, faces: Faces, boundary: Points, edge_length: float) -> Points:
    """Points with one added at the centre of each too large circumscribed circle, largest first, well apart."""
    centres, radii = _circumscribed(points, faces)
    order = np.argsort(-radii, kind="stable")
    centres = centres[order][radii[order] > HOLE_RADIUS * edge_length]
    centres = centres[outline.contains(boundary, centres)]
    centres = centres[_farther(boundary, centres, OUTLINE_MARGIN * edge_length)]
    if len(centres) == 0:
        return points
    apart = cKDTree(points).query(centres)[0] > HOLE_RADIUS * edge_length
    chosen: list[Points] = []
    for centre in centres[apart]:
        if all(np.hypot(*(centre - other)) > HOLE_RADIUS * edge_length for other in chosen):
            chosen.append(centre)
    return np.vstack([points, *chosen])


def _circumscribed(points: Points, faces: Faces) -> tuple[Points, Points]:
    """Centres (F, 2) m and radii (F,) m of the triangles' circumscribed circles."""
    p = points[faces]
    ab, ac = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    b_sq, c_sq = np.sum(ab**2, axis=1), np.sum(ac**2, axis=1)
    offset = np.stack([ac[:, 1] * b_sq - ab[:, 1] * c_sq, ab[:, 0] * c_sq - ac[:, 0] * b_sq], axis=1)
    offset /= 4 * signed_areas(points, faces)[:, None]
    return p[:, 0] + offset, np.linalg.norm(offset, axis=1)
