"""Isotropic remeshing of a closed surface with a size field, in numpy: used when the body is made.

Botsch & Kobbelt, "A remeshing approach to multiresolution modeling" (SGP 2004), section 4: rounds of
split long edges, collapse short edges, flip towards valence 6, relax tangentially and project back onto the original
surface. Every operation keeps the surface closed, oriented, manifold and of the same genus: a collapse must fulfil the
link condition (the end points share exactly two neighbours), a flip must not make an edge that exists, and neither may
turn a triangle over.
"""

from __future__ import annotations

import math

import numpy as np

from tryon_solver.body.making.closest import closest_points
from tryon_solver.geometry.normals import vertex_normals

Point = tuple[float, float, float]
SPLIT_ABOVE = 4 / 3  # times the wanted length: splitting brings both halves nearer to it (Botsch & Kobbelt)
COLLAPSE_BELOW = 4 / 5
LARGEST_TURN_COSINE = 0.5  # a triangle may turn by 60 degrees in one operation


def remesh(
    vertices: np.ndarray, faces: np.ndarray, sizes: np.ndarray, rounds: int = 6
) -> tuple[np.ndarray, np.ndarray]:
    """Remesh a closed surface (vertices (V, 3) m, faces (F, 3)) to edges of about `sizes` (V,) m.

    Returns new vertices (W, 3) m, all on the original surface, and faces (G, 3) int32 with the original orientation.
    """
    mesh = _Mesh(vertices, faces, sizes)
    surface = np.asarray(faces)
    for _ in range(rounds):
        mesh.split_long_edges()
        mesh.collapse_short_edges()
        mesh.flip_to_regular_valence()
        mesh.relax(vertices, surface, sizes)
    return mesh.arrays()


class _Mesh:
    """A triangle mesh open to local surgery: ids never change while a pass runs, dead faces are None."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, sizes: np.ndarray) -> None:
        self.points: list[Point] = [tuple(p) for p in np.asarray(vertices, dtype=float).tolist()]
        self.sizes: list[float] = np.asarray(sizes, dtype=float).tolist()
        self.faces: list[tuple[int, int, int] | None] = [tuple(f) for f in np.asarray(faces).tolist()]
        self.around: list[set[int]] = [set() for _ in self.points]
        for index, face in enumerate(self.faces):
            for vertex in face or ():
                self.around[vertex].add(index)

    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (V, 3) and faces (F, 3) int32, without the dead."""
        faces = np.array([face for face in self.faces if face], dtype=np.int64)
        used = np.unique(faces)
        renumbered = np.full(len(self.points), -1)
        renumbered[used] = np.arange(len(used))
        return np.array(self.points)[used], renumbered[faces].astype(np.int32)

    def edges(self) -> list[tuple[int, int]]:
        """Every edge once, smaller id first, sorted."""
        found = {tuple(sorted(pair)) for face in self.faces if face for pair in zip(face, face[1:] + face[:1])}
        return sorted(found)  # type: ignore[arg-type]

    def neighbours(self, vertex: int) -> set[int]:
        found: set[int] = set()
        for index in self.around[vertex]:
            found.update(self.faces[index] or ())
        found.discard(vertex)
        return found

    def split_long_edges(self) -> None:
        edges = [(a, b) for a, b in self.edges() if self._relative_length(a, b) > SPLIT_ABOVE]
        for a, b in sorted(edges, key=lambda edge: -self._relative_length(*edge)):
            middle = len(self.points)
            self.points.append(_middle(self.points[a], self.points[b]))
            self.sizes.append(0.5 * (self.sizes[a] + self.sizes[b]))
            self.around.append(set())
            for index in self.around[a] & self.around[b]:
                face = self.faces[index]
                assert face is not None
                self._replace(index, tuple(middle if v == b else v for v in face))
                self._add(tuple(middle if v == a else v for v in face))

    def collapse_short_edges(self) -> None:
        edges = [(a, b) for a, b in self.edges() if self._relative_length(a, b) < COLLAPSE_BELOW]
        for a, b in sorted(edges, key=lambda edge: self._relative_length(*edge)):
            still_there = self.around[a] & self.around[b]
            if still_there and self._relative_length(a, b) < COLLAPSE_BELOW:
                self._collapse(a, b)

    def _collapse(self, a: int, b: int) -> None:
        """Merge b into a at their middle, unless topology, length or orientation forbid it."""
        around_a, around_b = self.neighbours(a), self.neighbours(b)
        shared = around_a & around_b
        if len(shared) != 2 or any(len(self.around[v]) <= 3 for v in shared):
            return
        middle = _middle(self.points[a], self.points[b])
        size = 0.5 * (self.sizes[a] + self.sizes[b])
        for v in around_a | around_b:
            if v not in (a, b) and math.dist(middle, self.points[v]) > SPLIT_ABOVE * 0.5 * (size + self.sizes[v]):
                return
        dying = self.around[a] & self.around[b]
        moved = {a: middle, b: middle}
        for index in (self.around[a] | self.around[b]) - dying:
            if self._turns_over(self.faces[index], moved):
                return
        for index in dying:
            self._remove(index)
        self.points[a], self.sizes[a] = middle, size
        for index in list(self.around[b]):
            face = self.faces[index]
            assert face is not None
            self._replace(index, tuple(a if v == b else v for v in face))

    def flip_to_regular_valence(self) -> None:
        for a, b in self.edges():
            pair = sorted(self.around[a] & self.around[b])
            if len(pair) != 2:
                continue
            (c,) = set(self.faces[pair[0]] or ()) - {a, b}
            (d,) = set(self.faces[pair[1]] or ()) - {a, b}
            valence = [len(self.around[v]) for v in (a, b, c, d)]
            before = sum(abs(n - 6) for n in valence)
            after = sum(abs(n + change - 6) for n, change in zip(valence, (-1, -1, 1, 1)))
            if after >= before or valence[0] <= 3 or valence[1] <= 3 or d in self.neighbours(c):
                continue
            first, second = self.faces[pair[0]], self.faces[pair[1]]
            assert first is not None
            assert second is not None
            flipped = (tuple(d if v == b else v for v in first), tuple(c if v == a else v for v in second))
            old = [_normal(*(self.points[v] for v in face)) for face in (first, second)]
            new = [_normal(*(self.points[v] for v in face)) for face in flipped]
            if all(_cosine(n, o) > LARGEST_TURN_COSINE for n in new for o in old):
                self._replace(pair[0], flipped[0])
                self._replace(pair[1], flipped[1])

    def relax(self, vertices: np.ndarray, surface: np.ndarray, sizes: np.ndarray) -> None:
        """Move every vertex to the size-weighted centre of its neighbours within the tangent plane, then project."""
        points = np.array(self.points)
        pairs = np.array(self.edges())
        rows, columns = np.concatenate([pairs, pairs[:, ::-1]]).T
        weights = 1.0 / np.array(self.sizes)[columns]
        total = np.bincount(rows, weights, minlength=len(points))
        live = total > 0
        centre = np.stack(
            [np.bincount(rows, weights * points[columns, k], minlength=len(points)) for k in range(3)], axis=1
        )
        step = centre[live] / total[live, None] - points[live]
        faces = np.array([face for face in self.faces if face])
        normals = vertex_normals(points, faces)[live]
        step -= normals * (step * normals).sum(axis=1, keepdims=True)
        hit = closest_points(points[live] + step, vertices, surface)
        for vertex, point, size in zip(
            np.flatnonzero(live).tolist(),
            hit.points.tolist(),
            (hit.barycentric * sizes[surface[hit.faces]]).sum(axis=1).tolist(),
        ):
            self.points[vertex], self.sizes[vertex] = tuple(point), size

    def _relative_length(self, a: int, b: int) -> float:
        return math.dist(self.points[a], self.points[b]) / (0.5 * (self.sizes[a] + self.sizes[b]))

    def _turns_over(self, face: tuple[int, int, int] | None, moved: dict[int, Point]) -> bool:
        assert face is not None
        old = _normal(*(self.points[v] for v in face))
        new = _normal(*(moved.get(v, self.points[v]) for v in face))
        return _cosine(old, new) < LARGEST_TURN_COSINE

    def _add(self, face: tuple[int, ...]) -> None:
        a, b, c = face
        for vertex in face:
            self.around[vertex].add(len(self.faces))
        self.faces.append((a, b, c))

    def _remove(self, index: int) -> None:
        for vertex in self.faces[index] or ():
            self.around[vertex].discard(index)
        self.faces[index] = None

    def _replace(self, index: int, face: tuple[int, ...]) -> None:
        self._remove(index)
        a, b, c = face
        self.faces[index] = (a, b, c)
        for vertex in face:
            self.around[vertex].add(index)


def _middle(p: Point, q: Point) -> Point:
    return (0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]), 0.5 * (p[2] + q[2]))


def _normal(a: Point, b: Point, c: Point) -> Point:
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)


def _cosine(u: Point, v: Point) -> float:
    lengths = math.hypot(*u) * math.hypot(*v)
    return (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) / lengths if lengths > 0.0 else -1.0
