"""Edges of pattern pieces: straight lines, Bezier curves and circular arcs in the plane.

The curve types are those of the GarmentCode pattern specification (https://github.com/maria-korosteleva/GarmentCode):
a line, a quadratic or cubic Bezier curve whose control points are given relative to the edge, and a circular arc with
the two flags of an SVG path (https://www.w3.org/TR/SVG2/paths.html#PathDataEllipticalArcCommands), the y axis up.
All coordinates and lengths here are in metres; a curve is a function of t in [0, 1].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import comb
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

Points = NDArray[np.float64]

# Lengths are integrals of the speed by 4-point Gauss-Legendre quadrature on this many equal pieces of [0, 1];
# positions by arc length interpolate that table linearly: off by about length / TABLE_PIECES^2, 0.2 micrometres on 1 m.
TABLE_PIECES = 2048
TABLES_KEPT = 256
SAMPLES_KEPT = 1024  # of some tens of points each
GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(4)

# SVG enlarges an arc's radius that cannot span its chord. Rounding of exported numbers explains this much of it.
RADIUS_SLACK = 1e-4


class Curve(Protocol):
    """A parametric plane curve over t in [0, 1]."""

    def points(self, t: ArrayLike) -> Points:
        """Positions [m] at the parameters t (K,), shape (K, 2)."""

    def speeds(self, t: ArrayLike) -> Points:
        """Magnitudes of the derivative [m] at the parameters t (K,), shape (K,)."""


@dataclass(frozen=True)
class Bezier:
    """Bezier curve of degree D >= 1; degree 1 is a straight line."""

    controls: Points  # (D + 1, 2) m, control points; the first and last are the end points

    def points(self, t: ArrayLike) -> Points:
        return _bernstein(np.asarray(t, dtype=np.float64), len(self.controls) - 1) @ self.controls

    def speeds(self, t: ArrayLike) -> Points:
        return self._speeds(_bernstein(np.asarray(t, dtype=np.float64), len(self.controls) - 2))

    def table_speeds(self) -> Points:
        """Those at the nodes of a table's pieces, (TABLE_PIECES * nodes,)."""
        return self._speeds(_table_bernstein(len(self.controls) - 2))

    def _speeds(self, bernstein: Points) -> Points:
        hodograph = (len(self.controls) - 1) * np.diff(self.controls, axis=0)
        x, y = (bernstein @ hodograph).T
        return np.sqrt(x * x + y * y)


@dataclass(frozen=True)
class Arc:
    """Circular arc: centre + radius (cos a, sin a), the angle a running from start_angle by sweep_angle."""

    centre: Points  # (2,) m
    radius: float  # m
    start_angle: float  # rad
    sweep_angle: float  # rad, positive counter-clockwise

    def points(self, t: ArrayLike) -> Points:
        angle = self.start_angle + self.sweep_angle * np.asarray(t, dtype=np.float64)
        return self.centre + self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def speeds(self, t: ArrayLike) -> Points:
        return np.full(np.asarray(t).shape, self.radius * abs(self.sweep_angle))


def line(start: ArrayLike, end: ArrayLike) -> Bezier:
    """The straight line from start to end, each (2,) m."""
    return Bezier(np.array([start, end], dtype=np.float64))


def relative_bezier(start: ArrayLike, end: ArrayLike, relative_controls: ArrayLike) -> Bezier:
    """Bezier curve from start to end, each (2,) m, with inner control points (u, v) relative to the edge, (D - 1, 2).

    A relative point (u, v) means start + u (end - start) + v perp, where perp is end - start turned by +90 degrees.
    """
    first, last = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    along = last - first
    frame = np.array([along, [-along[1], along[0]]])
    inner = first + np.asarray(relative_controls, dtype=np.float64).reshape(-1, 2) @ frame
    return Bezier(np.vstack([first, inner, last]))


def arc_by_flags(start: ArrayLike, end: ArrayLike, radius: float, large_arc: bool, counter_clockwise: bool) -> Arc:
    """Circular arc of the radius [m] from start to end, each (2,) m, chosen among four by SVG's two flags.

    large_arc: the arc of more than half a circle. counter_clockwise: SVG's sweep flag, the y axis pointing up.
    Raises ValueError when no circle of that radius passes through both points.
    """
    first, last = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    chord = last - first
    half = float(np.hypot(*chord)) / 2
    if half == 0.0 or radius < half * (1 - RADIUS_SLACK):
        raise ValueError(f"a circle of radius {radius:.6g} m cannot pass through points {2 * half:.6g} m apart")
    radius = max(radius, half)
    # The centre lies left of the chord for the small counter-clockwise arc and for the large clockwise one.
    side = 1.0 if counter_clockwise != large_arc else -1.0
    left = np.array([-chord[1], chord[0]]) / (2 * half)
    centre = (first + last) / 2 + side * np.sqrt(radius**2 - half**2) * left
    start_angle = float(np.arctan2(*(first - centre)[::-1]))
    end_angle = float(np.arctan2(*(last - centre)[::-1]))
    sweep = (end_angle - start_angle) % (2 * np.pi)
    return Arc(centre, radius, start_angle, sweep if counter_clockwise else sweep - 2 * np.pi)


def length(curve: Curve) -> float:
    """Length of the curve [m]."""
    return float(_length_table(curve)[1][-1])


def sample_by_arc_length(curve: Curve, segments: int) -> Points:
    """Points (segments + 1, 2) m that cut the curve into pieces of equal arc length, both ends included."""
    if isinstance(curve, Bezier):
        return _samples_of_bezier(_key(curve), segments).copy()
    return _samples_of(curve, segments)


def parameter_at(curve: Curve, share: float) -> float:
    """The parameter t up to which the curve has this share, 0 to 1, of its length."""
    parameters, lengths = _length_table(curve)
    return float(np.interp(share * lengths[-1], lengths, parameters))


def share_at(curve: Curve, t: float) -> float:
    """The share of its length, 0 to 1, that the curve has up to the parameter t."""
    parameters, lengths = _length_table(curve)
    return float(np.interp(t, parameters, lengths) / lengths[-1])


def end_tangents(curve: Curve) -> Points:
    """Unit vectors (2, 2) in which the curve runs where it starts and where it ends."""
    if isinstance(curve, Arc):
        radial = (curve.points([0.0, 1.0]) - curve.centre) / curve.radius
        return np.sign(curve.sweep_angle) * np.stack([-radial[:, 1], radial[:, 0]], axis=1)
    assert isinstance(curve, Bezier)
    legs = np.diff(curve.controls, axis=0)
    long = np.flatnonzero(np.hypot(legs[:, 0], legs[:, 1]) > 0)  # a control point on an end has no direction
    ends = legs[long[[0, -1]]]
    return ends / np.hypot(ends[:, 0], ends[:, 1])[:, None]


def same(one: Curve, other: Curve) -> bool:
    """Whether the two are the same curve, to the last bit and in the same direction."""
    if isinstance(one, Bezier) and isinstance(other, Bezier):
        return np.array_equal(one.controls, other.controls)
    if isinstance(one, Arc) and isinstance(other, Arc):
        parts = [(*arc.centre, arc.radius, arc.start_angle, arc.sweep_angle) for arc in (one, other)]
        return parts[0] == parts[1]
    return False


def is_straight(curve: Curve) -> bool:
    """Whether the curve was given as a straight line."""
    return isinstance(curve, Bezier) and len(curve.controls) == 2


def _bernstein(t: Points, degree: int) -> Points:
    """Bernstein polynomials of the degree at t (K,), shape (K, degree + 1); rows sum to 1."""
    columns = [comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1)]
    return np.stack(columns, axis=1)


def _length_table(curve: Curve) -> tuple[Points, Points]:
    """Parameters (TABLE_PIECES + 1,) and the curve's length [m] up to each of them, same shape; not to be changed."""
    return _table_of_bezier(_key(curve)) if isinstance(curve, Bezier) else _table_of(curve)


# An edit asks for the lengths and the samples of a pattern's edges several times each.


def _key(curve: Bezier) -> bytes:
    """The control points (D + 1, 2) float64 m, to look up by."""
    return np.asarray(curve.controls, dtype=np.float64).tobytes()


def _of_key(controls: bytes) -> Bezier:
    return Bezier(np.frombuffer(controls).reshape(-1, 2))


@lru_cache(maxsize=TABLES_KEPT)
def _table_of_bezier(controls: bytes) -> tuple[Points, Points]:
    return _table_of(_of_key(controls))


@lru_cache(maxsize=SAMPLES_KEPT)
def _samples_of_bezier(controls: bytes, segments: int) -> Points:
    return _samples_of(_of_key(controls), segments)


def _samples_of(curve: Curve, segments: int) -> Points:
    parameters, lengths = _length_table(curve)
    wanted = np.linspace(0.0, lengths[-1], segments + 1)
    t = np.interp(wanted, lengths, parameters)
    t[0], t[-1] = 0.0, 1.0
    return curve.points(t)


def _table_of(curve: Curve) -> tuple[Points, Points]:
    speeds = curve.table_speeds() if isinstance(curve, Bezier) else curve.speeds(_table_nodes())
    pieces = speeds.reshape(TABLE_PIECES, -1) @ GAUSS_WEIGHTS / (2 * TABLE_PIECES)
    return _table_ends(), np.concatenate([[0.0], np.cumsum(pieces)])


@lru_cache(maxsize=1)
def _table_ends() -> Points:
    """Where the pieces of a table end (TABLE_PIECES + 1,); not to be changed."""
    return np.linspace(0.0, 1.0, TABLE_PIECES + 1)


def _table_nodes() -> Points:
    """The nodes of all its pieces."""
    return (_table_ends()[:-1, None] + (GAUSS_NODES[None, :] + 1) / (2 * TABLE_PIECES)).ravel()


@lru_cache(maxsize=4)
def _table_bernstein(degree: int) -> Points:
    """Bernstein polynomials of the degree at the nodes; not to be changed."""
    return _bernstein(_table_nodes(), degree)
