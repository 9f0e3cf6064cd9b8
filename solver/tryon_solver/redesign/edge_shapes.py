"""Shapes of edges as the file has them, changed: divided, bent, stretched.

Curvature is written relative to the edge: control points (u, v) in lengths of the chord, along it and to its left, or
[radius, large arc, counter-clockwise] of a circle, the radius in the file's unit.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tryon_solver.geometry import curves
from tryon_solver.geometry.curves import Points
from tryon_solver.redesign.draft import Draft, Edge

ARC_AS_CUBIC_MAX = np.radians(91)  # one cubic curve follows an arc up to here to 0.03 % of its radius
FLAT_SAGITTA = 1e-5  # chords; an arc that rises less is a straight line


def relative(start: Points, end: Points, points: Points) -> list[list[float]]:
    """Points (k, 2) m in the frame of the chord from start to end, each (2,) m: what relative_bezier undoes."""
    along = end - start
    offset = (np.asarray(points) - start) / (along @ along)
    return np.stack([offset @ along, offset @ [-along[1], along[0]]], axis=1).tolist()


def bezier_curvature(controls: Points) -> Any:
    """The curvature of the Bezier curve with these control points (k + 2, 2) m."""
    if len(controls) == 2:
        return None
    kind = {3: "quadratic", 4: "cubic"}[len(controls)]
    return {"type": kind, "params": relative(controls[0], controls[-1], controls[1:-1])}


def halves(draft: Draft, edge: Edge, t: float) -> tuple[Points, Any, Any]:
    """The point (2,) m at the parameter t of the edge, and the curvature of what lies before it and after it."""
    curve = draft.curve(edge)
    middle = curve.points([t])[0]
    if isinstance(curve, curves.Arc):
        radius = curve.radius * draft.units_in_meter
        turns = [t * curve.sweep_angle, (1 - t) * curve.sweep_angle]
        one, other = ([radius, int(abs(turn) > np.pi), int(turn > 0)] for turn in turns)
        return middle, {"type": "circle", "params": one}, {"type": "circle", "params": other}
    assert isinstance(curve, curves.Bezier)
    rows = [curve.controls]
    while len(rows[-1]) > 1:  # de Casteljau
        rows.append((1 - t) * rows[-1][:-1] + t * rows[-1][1:])
    first = np.array([row[0] for row in rows])
    second = np.array([row[-1] for row in rows[::-1]])
    return middle, bezier_curvature(first), bezier_curvature(second)


def as_bezier(draft: Draft, edge: Edge) -> Points | None:
    """Control points (k, 2) m of the edge; an arc's up to a quarter circle, beyond that None."""
    curve = draft.curve(edge)
    if isinstance(curve, curves.Bezier):
        return curve.controls
    assert isinstance(curve, curves.Arc)
    if abs(curve.sweep_angle) > ARC_AS_CUBIC_MAX:
        return None
    # The cubic that touches the arc at its ends and in its middle.
    reach = 4 / 3 * np.tan(abs(curve.sweep_angle) / 4) * curve.radius
    ends, along = curve.points([0.0, 1.0]), curves.end_tangents(curve)
    return np.array([ends[0], ends[0] + reach * along[0], ends[1] - reach * along[1], ends[1]])


def sagitta(arc: curves.Arc) -> float:
    """How far the arc rises to the left of its chord [m]."""
    return -float(np.sign(arc.sweep_angle)) * arc.radius * (1 - np.cos(arc.sweep_angle / 2))


def arc_curvature(draft: Draft, chord: float, rise: float) -> Any:
    """The curvature of an arc over the chord [m] that rises so far [m] to its left."""
    if abs(rise) < FLAT_SAGITTA * chord:
        return None
    radius = (chord**2 / 4 + rise**2) / (2 * abs(rise))
    # An arc to the left of its chord turns clockwise.
    return {"type": "circle", "params": [radius * draft.units_in_meter, int(abs(rise) > chord / 2), int(rise < 0)]}


def stretch_arcs(edge: Edge, factor: float) -> None:
    """Scale the radius of an arc whose chord became longer by the factor, so that it keeps its shape."""
    curvature = edge.curvature
    if isinstance(curvature, dict) and curvature.get("type") == "circle":
        radius, *flags = curvature["params"]
        edge.fields = edge.curved({**curvature, "params": [radius * factor, *flags]})


def chord(edge: Edge) -> float:
    """The distance of the edge's ends [m]."""
    return float(np.hypot(*(edge.end.position - edge.start.position)))
