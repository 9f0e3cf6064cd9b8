"""A polygon of a mesh file cut into triangles that fill it, also where it is not convex.

A quadrilateral is cut along its shorter diagonal, or along the other where that lies outside of it. What has more
corners loses one ear after another (Meisters, "Polygons have ears", Amer. Math. Monthly 82 (1975) 648), the roundest
first; a corner on a straight side is no ear, and those beside one go first. Text is rounded, so straight sides are bent
a little, and a triangle on three corners of one can be left: its longest edge is flipped then (Lawson, "Transforming
triangulations", Discrete Math. 3 (1972) 365), so that none without area remains where the polygon can do without.
Both copies of a polygon that is there double-sided, in whichever sense and from whichever corner on, are cut alike.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from itertools import product

Point = tuple[float, float, float]
Triangle = tuple[int, int, int]

EQUAL = 1e-6  # diagonals whose lengths differ by less than this share are equally long
FLAT = 1e-6  # twice a triangle's area over its longest side squared, or over its polygon's: with less it has none
STRAIGHT = (1e-2, 1e-4, FLAT)  # the same of corners that are no ears, and go to none as long as there are others


def cut(points: Sequence[Point], names: Sequence[int]) -> tuple[list[Triangle], bool]:
    """Triangles of corner numbers, turned as the polygon is, and whether they fill it without overlapping.

    `points` of its n >= 3 corners, `names` their numbers in the file. What crosses itself, seen from where it has most
    area, or has none can't be filled: it is cut all the same.
    """
    first = min(range(len(names)), key=names.__getitem__)
    ring = [(first + k) % len(names) for k in range(len(names))]
    if len(ring) == 3:
        return [(ring[0], ring[1], ring[2])], True
    if len(ring) == 4:
        found, sound = _halves([points[k] for k in ring])
        return [(ring[a], ring[b], ring[c]) for a, b, c in found], sound
    if backwards := names[ring[1]] > names[ring[-1]]:
        ring = ring[:1] + ring[:0:-1]
    found, sound = _Ears([points[k] for k in ring]).clip()
    found = [(a, c, b) for a, b, c in found] if backwards else found
    return [(ring[a], ring[b], ring[c]) for a, b, c in found], sound


def _halves(points: Sequence[Point]) -> tuple[list[Triangle], bool]:
    """A quadrilateral's two triangles: each is turned as the whole is."""
    ways: list[list[Triangle]] = [[(0, 1, 2), (0, 2, 3)], [(1, 2, 3), (1, 3, 0)]]
    if math.dist(points[1], points[3]) < (1.0 - EQUAL) * math.dist(points[0], points[2]):
        ways.reverse()
    for least, way in product(STRAIGHT, ways):
        (x, y, z), (u, v, w) = (_normal(points[a], points[b], points[c]) for a, b, c in way)
        i, j, k = x + u, y + v, z + w
        if min(x * i + y * j + z * k, u * i + v * j + w * k) > least * (i * i + j * j + k * k):
            return way, True
    return ways[0], False


def _normal(p: Point, q: Point, r: Point) -> Point:
    """Of a triangle, as long as twice its area."""
    a, b, c = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    d, e, f = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    return b * f - c * e, c * d - a * f, a * e - b * d


def _seen(points: Sequence[Point]) -> tuple[list[tuple[float, float]], float]:
    """The corners seen along the axis along which the polygon has most area, and twice that, signed (Newell)."""
    middle = [sum(point[k] for point in points) / len(points) for k in range(3)]
    relative = [tuple(point[k] - middle[k] for k in range(3)) for point in points]
    views = [[(p[(k + 1) % 3], p[(k + 2) % 3]) for p in relative] for k in range(3)]
    areas = [math.fsum(a[0] * b[1] - a[1] * b[0] for a, b in zip(v, v[1:] + v[:1])) for v in views]
    most = max(range(3), key=lambda k: abs(areas[k]))
    return views[most], areas[most]


def _side(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Twice the area of the triangle, positive when it is counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _bulge(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """The same over its longest side squared."""
    longest = max(math.dist(a, b), math.dist(b, c), math.dist(c, a))
    return _side(a, b, c) / longest**2 if longest > 0 else 0.0


class _Ears:
    """The corners that are left of a polygon, numbered around it, and which of them are its ears."""

    def __init__(self, points: Sequence[Point]) -> None:
        count = len(points)
        self.points = points
        self.view, area = _seen(points)
        self.sign = math.copysign(1.0, area)
        self.after = [(k + 1) % count for k in range(count)]
        self.before = [(k - 1) % count for k in range(count)]
        self.turn = [0.0] * count  # bulge of a corner with its neighbours; negative where it points inwards
        self.queue: list[tuple[bool, float, int, int, int]] = []
        self.held_by: dict[int, list[int]] = {}  # corners that are no ears as long as this one is in their triangle
        for k in range(count):
            self.turn[k] = self.turned(k)
        self.flat = STRAIGHT[0]

    def turned(self, k: int) -> float:
        return self.sign * _bulge(self.view[self.before[k]], self.view[k], self.view[self.after[k]])

    def offer(self, k: int) -> None:
        """Put a corner among those that may be ears."""
        if self.turn[k] <= self.flat:
            return
        a, b = self.before[k], self.after[k]
        beside_flat = abs(self.turn[a]) <= self.flat or abs(self.turn[b]) <= self.flat
        heapq.heappush(self.queue, (not beside_flat, -self.roundness(a, k, b), k, a, b))

    def roundness(self, a: int, b: int, c: int) -> float:
        """1 for an equilateral triangle, 0 for three corners on a line."""
        p, q, r = (self.points[k] for k in (a, b, c))
        short, middle, long = sorted((math.dist(p, q), math.dist(q, r), math.dist(r, p)))
        return (short + middle - long) / long

    def holder(self, k: int) -> int | None:
        """A corner within the triangle of this one and its neighbours, or so near that what is left would be flat."""
        a, b, c = (self.view[j] for j in (self.before[k], k, self.after[k]))
        near = -self.flat * max(math.dist(a, b), math.dist(b, c), math.dist(c, a)) ** 2
        j = self.after[self.after[k]]
        while j != self.before[k]:
            p = self.view[j]
            if self.turn[j] <= self.flat and p not in (a, b, c):
                sides = self.sign * _side(a, b, p), self.sign * _side(b, c, p), self.sign * _side(c, a, p)
                if min(sides) >= near:
                    return j
            j = self.after[j]
        return None

    def clip(self) -> tuple[list[Triangle], bool]:
        found: list[Triangle] = []
        left = len(self.points)
        here = 0
        levels = iter(STRAIGHT)
        while left > 3:
            if not self.queue:
                if (flat := next(levels, None)) is None:
                    break
                self.flat = flat
                for k, after in enumerate(self.after):
                    if after >= 0:
                        self.offer(k)
                continue
            _, _, k, a, b = heapq.heappop(self.queue)
            if (self.before[k], self.after[k]) != (a, b) or self.turn[k] <= self.flat:
                continue
            if (holder := self.holder(k)) is not None:
                self.held_by.setdefault(holder, []).append(k)
                continue
            found.append((a, k, b))
            self.after[a], self.before[b] = b, a
            self.before[k] = self.after[k] = -1
            left, here = left - 1, a
            again = set(self.held_by.pop(k, ()))
            for j in (a, b):
                self.turn[j] = self.turned(j)
                again |= {j, *self.held_by.pop(j, ())}
            for j in sorted(again | {self.before[a], self.after[b]}):  # a neighbour's may be flat now, or no longer
                if self.after[j] >= 0:
                    self.offer(j)
        filled = left == 3
        k = self.after[here]
        while left >= 3:
            found.append((here, k, self.after[k]))
            k, left = self.after[k], left - 1
        if filled:
            self.unflatten(found)
        return found, filled and min(map(self.bulge, found)) > FLAT

    def bulge(self, triangle: Triangle) -> float:
        return self.sign * _bulge(*(self.view[j] for j in triangle))

    def unflatten(self, found: list[Triangle]) -> None:
        """Flip the longest edge of each triangle that is as good as flat, where that leaves none so flat."""
        owner = {(t[i], t[i - 2]): n for n, t in enumerate(found) for i in range(3)}
        waiting = [n for n, t in enumerate(found) if self.bulge(t) <= STRAIGHT[0]]
        while waiting:
            n = waiting.pop()
            i = max(range(3), key=lambda j: math.dist(self.points[found[n][j]], self.points[found[n][j - 2]]))
            a, b, k = found[n][i], found[n][i - 2], found[n][i - 1]
            if (m := owner.get((b, a))) is None:
                continue
            (c,) = set(found[m]) - {a, b}
            halves: tuple[Triangle, Triangle] = ((a, c, k), (c, b, k))
            if min(map(self.bulge, halves)) <= max(0.0, min(self.bulge(found[n]), self.bulge(found[m]))):
                continue
            del owner[a, b], owner[b, a]
            for where, half in zip((n, m), halves):
                found[where] = half
                owner |= {(half[j], half[j - 2]): where for j in range(3)}
            waiting = [n for n, t in enumerate(found) if self.bulge(t) <= STRAIGHT[0]]
