"""A piece fanned out from its far side, so that one of its edges gets another length: what cutting it into strips
across that edge, and spreading these there, comes to where the strips are narrow ("slash and spread").

The strips stand on the line through the piece's farthest point parallel to the edge's chord. With u along that line and
v away from it, towards the edge, a strip at u is turned by k u: the line becomes an arc of radius 1/k and keeps its
length, strips stay as long as they are, and an edge from t = 0 to 1 comes to have the length

    integral of sqrt((1 + k v)^2 u'^2 + v'^2) dt,

that of a straight edge of length w at the height h along it: w (1 + k h). An area grows by the integral of k v.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy  # loads its optimize, which takes 0.2 s, when that is first asked for

from tryon_solver.geometry import curves
from tryon_solver.geometry.curves import Points
from tryon_solver.redesign.draft import Draft, Edge, Piece, Vertex
from tryon_solver.redesign.edge_shapes import arc_curvature, as_bezier, bezier_curvature
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.moving import note_followers

WIDEST = np.pi  # radians by which the outermost strips turn against each other; farther they would meet behind it
SAME = 1e-9  # m
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)  # on an edge that is straight or one curve: to rounding
SHARES, WEIGHTS = (NODES + 1) / 2, WEIGHTS / 2
LESS = "Gather or ease it less, or make the whole piece wider with scale_piece"


@dataclass(frozen=True)
class Fan:
    """The map. `origin` (2,) m is on the far line, below the middle of the edge; `along` and `up` (2,) are unit
    vectors; `k` in 1/m, 0 of a piece that stays as it is."""

    origin: Points
    along: Points
    up: Points
    k: float = 0.0

    def local(self, points: Points) -> Points:
        """(u, v) (n, 2) m of points (n, 2) m."""
        return (points - self.origin) @ np.stack([self.along, self.up], axis=1)

    def moved(self, points: Points) -> Points:
        """Where points (n, 2) m come to (n, 2) m."""
        u, v = self.local(points).T
        turn = self.k * u
        far = np.sinc(turn / np.pi) * u, -self.k * u**2 / 2 * np.sinc(turn / 2 / np.pi) ** 2  # sound down to k = 0
        x, y = far[0] + v * np.sin(turn), far[1] + v * np.cos(turn)
        return self.origin + np.outer(x, self.along) + np.outer(y, self.up)

    def carried(self, points: Points, vectors: Points) -> Points:
        """What vectors (n, 2) at points (n, 2) m become (n, 2): the map's differential."""
        u, v = self.local(points).T
        du, dv = (vectors @ np.stack([self.along, self.up], axis=1)).T
        turn, du = self.k * u, (1 + self.k * v) * du
        x, y = np.cos(turn) * du + np.sin(turn) * dv, -np.sin(turn) * du + np.cos(turn) * dv
        return np.outer(x, self.along) + np.outer(y, self.up)

    def length(self, curve: curves.Bezier) -> float:
        """Of the edge that the curve becomes [m]."""
        slopes = derivative(curve.controls, SHARES)
        return float(WEIGHTS @ np.linalg.norm(self.carried(curve.points(SHARES), slopes), axis=1))


def fan_out(draft: Draft, edge: Edge, length: float) -> None:
    """Give the edge this length [m] by fanning its piece out, or in, from its far side; what is sewn to the piece's
    other edges follows where these change. Raises EditError where that can't be."""
    piece = draft.piece_of(edge)
    before = {each: _bezier(draft, each) for each in piece.edges}
    fan = _fitted(draft, piece, edge, before, length)
    moves = {vertex: fan.moved(vertex.position[None])[0] - vertex.position for vertex in piece.vertices}
    _carry_what_lies_on(draft, piece, fan)
    for vertex, by in moves.items():
        vertex.position = vertex.position + by
    for each, curve in before.items():
        each.fields = each.curved(_curvature(draft, each, curve, fan))
    seam = draft.seam_at(edge)
    if seam is not None:
        seam.ratio = draft.length(seam.first) / draft.length(seam.second)
    note_followers(draft, _far(moves))


def _bezier(draft: Draft, edge: Edge) -> curves.Bezier:
    controls = as_bezier(draft, edge)
    if controls is None:
        raise EditError(f"{draft.said(edge)} is an arc of more than a quarter circle, no curve is read", "edge", LESS)
    return curves.Bezier(controls)


def _fitted(draft: Draft, piece: Piece, edge: Edge, curve: dict[Edge, curves.Bezier], length: float) -> Fan:
    """The fan by which the edge gets its length [m]."""
    outline = draft.outline(piece)
    start, end = edge.start.position, edge.end.position
    along = (end - start) / np.hypot(*(end - start))
    up = draft.turns(piece) * np.array([along[1], -along[0]])
    far = float(((outline - start) @ up).min())
    fan = Fan((start + end) / 2 + far * up, along, up)
    u, v = fan.local(outline).T

    def missing(k: float) -> float:
        return Fan(fan.origin, along, up, k).length(curve[edge]) - length

    widest, closed = WIDEST / float(np.ptp(u)), -(1 - SAME) / float(v.max())
    if missing(widest) < 0 or missing(closed) > 0:
        apart, own = 100 * -far, 100 * fan.length(curve[edge])
        where = f"{draft.said(edge)}, {own:.1f} cm long and {apart:.1f} cm from the far side of its piece,"
        why = f"can't be fanned to {100 * length:.1f} cm: the piece would turn back on itself"
        raise EditError(f"{where} {why}", "edge", LESS)
    return Fan(fan.origin, along, up, float(scipy.optimize.brentq(missing, closed, widest, xtol=1e-15, rtol=1e-15)))


def _curvature(draft: Draft, edge: Edge, curve: curves.Bezier, fan: Fan) -> object:
    """Of the edge that the curve becomes, whose ends are where they come to: an arc or a line where that is one, else a
    cubic that leaves and meets them in the same directions and has the same length."""
    u, v = fan.local(curve.controls).T
    ends = np.array([edge.start.position, edge.end.position])
    chord = float(np.hypot(*(ends[1] - ends[0])))
    straight = curves.is_straight(curve)
    if straight and float(np.ptp(u)) < SAME:
        return None
    if straight and float(np.ptp(v)) < SAME:
        middle = fan.moved((curve.controls[:1] + curve.controls[-1:]) / 2)[0]
        left = np.array([-(ends[1] - ends[0])[1], (ends[1] - ends[0])[0]]) / chord
        return arc_curvature(draft, chord, float((middle - ends[0]) @ left))
    slopes = fan.carried(curve.controls[[0, -1]], derivative(curve.controls, np.array([0.0, 1.0])))
    wanted = fan.length(curve)

    def controls(reach: float) -> Points:
        return np.array([ends[0], ends[0] + reach * slopes[0], ends[1] - reach * slopes[1], ends[1]])

    def missing(reach: float) -> float:
        return curves.length(curves.Bezier(controls(reach))) - wanted

    if abs(missing(1 / 3)) < SAME:
        return bezier_curvature(controls(1 / 3))
    reach = float(scipy.optimize.brentq(missing, 0.0, 1.0, xtol=1e-15, rtol=1e-15))
    return bezier_curvature(controls(reach))


def derivative(controls: Points, t: Points) -> Points:
    """Of the Bezier curve with these control points (k, 2) m by its parameter, at t (n,): (n, 2) m."""
    points = [np.tile(step, (len(t), 1)) for step in (len(controls) - 1) * np.diff(controls, axis=0)]
    while len(points) > 1:  # de Casteljau
        points = [(1 - t)[:, None] * one + t[:, None] * other for one, other in pairwise(points)]
    return points[0]


def _carry_what_lies_on(draft: Draft, piece: Piece, fan: Fan) -> None:
    """What lies on the piece lies where the fabric below its middle does, and turns with it."""
    for other in draft.pieces.values():
        on = other.fields.get("on")
        if on is None or on["panel"] != piece.name:
            continue
        at = np.array(on["at"], dtype=np.float64)[None] / draft.units_in_meter
        (x, y) = fan.carried(at, fan.up[None])[0]
        turn = float(np.degrees(np.arctan2(fan.up[0] * y - fan.up[1] * x, fan.up[0] * x + fan.up[1] * y)))
        place = (fan.moved(at)[0] * draft.units_in_meter).tolist()
        other.fields = {**other.fields, "on": {**on, "at": place, "turn": on.get("turn", 0.0) + turn}}


def _far(moves: dict[Vertex, Points]) -> dict[Vertex, Points]:
    return {vertex: by for vertex, by in moves.items() if np.hypot(*by) > SAME}
