"""Moving a curve's handle; the curve that is sewn to it is bent until it fits again."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy  # loads its optimize, which takes 0.2 s, when that is first asked for

from tryon_solver.geometry import curves
from tryon_solver.geometry.curves import Points
from tryon_solver.redesign.draft import Draft, Edge, Seam
from tryon_solver.redesign.edge_shapes import (
    arc_curvature,
    bezier_curvature,
    chord,
    relative,
    sagitta,
)
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import MoveHandle

CONGRUENT = 1e-3  # chords, between control points of two edges that are drawn alike
BULGE_MAX = 4.0  # times as deep as it was; who would have to bend more is not meant to follow


def move_handle(draft: Draft, edit: MoveHandle) -> None:
    """Edits MoveHandle."""
    edge = draft.edge(edit.panel, edit.edge)
    by = np.array(edit.by)
    curve = draft.curve(edge)
    count = handle_count(curve)
    if edit.handle >= count:
        message = f"edge {edit.edge} of {edit.panel!r} has no handle {edit.handle}"
        raise EditError(message, "handle", f"Use 0 to {count - 1}")
    seam = draft.seam_at(edge)
    side = None if seam is None else _same_side(draft, seam)
    if isinstance(curve, curves.Arc):
        along = (edge.end.position - edge.start.position) / chord(edge)
        rise = sagitta(curve) + float(by @ [-along[1], along[0]])
        edge.fields = edge.curved(arc_curvature(draft, chord(edge), rise))
    else:
        handles = _handles(curve)
        handles[edit.handle] += by
        edge.fields = edge.curved(bezier_curvature(np.vstack([edge.start.position, handles, edge.end.position])))
    if seam is not None and np.any(by):
        _bend_partner(draft, seam, edge, side)


def handle_count(curve: curves.Curve) -> int:
    """How many handles MoveHandle can move."""
    return len(handle_places(curve))


def handle_places(curve: curves.Curve) -> Points:
    """Where the handles (k, 2) m are that MoveHandle moves, in its order."""
    return curve.points([0.5]) if isinstance(curve, curves.Arc) else _handles(curve)


def _handles(curve: curves.Curve) -> Points:
    """The inner control points (k, 2) m; a straight line's are at its thirds, by which it is a cubic curve."""
    assert isinstance(curve, curves.Bezier)
    if len(curve.controls) == 2:
        return np.array([[2, 1], [1, 2]]) / 3 @ curve.controls
    return curve.controls[1:-1].copy()


def _frame(draft: Draft, edge: Edge) -> Points | None:
    """The edge's handles (k, 2) relative to it; None for an arc."""
    curve = draft.curve(edge)
    if isinstance(curve, curves.Arc):
        return None
    return np.array(relative(edge.start.position, edge.end.position, _handles(curve)))


def _as_partner(handles: Points, seam: Seam, side: float) -> Points:
    """Relative handles (k, 2) of one edge as the edge sewn to it has them; side -1 lies on the other side."""
    turned = (handles[::-1] * [-1, 1] + [1, 0]) if seam.reversed else handles
    return turned * [1, side]


def _same_side(draft: Draft, seam: Seam) -> float | None:
    """1 or -1 when the two edges are drawn alike: folded onto each other along the seam, or side by side; else None."""
    one, other = _frame(draft, seam.first), _frame(draft, seam.second)
    if one is None or other is None or one.shape != other.shape:
        return None
    folded = draft.turns(draft.piece_of(seam.first)) * draft.turns(draft.piece_of(seam.second))
    for side in (folded, -folded):
        if np.abs(_as_partner(one, seam, side) - other).max() < CONGRUENT:
            return side
    return None


def _bend_partner(draft: Draft, seam: Seam, edge: Edge, side: float | None) -> None:
    """Bend the edge sewn to the one that was bent: likewise when they were drawn alike, else deeper or flatter."""
    other = seam.other(edge)
    frame = _frame(draft, edge)
    if side is not None and frame is not None:
        kind = {1: "quadratic", 2: "cubic"}[len(frame)]
        curvature: Any = {"type": kind, "params": _as_partner(frame, seam, side).tolist()}
    else:
        wanted = draft.length(edge) / seam.ratio if edge is seam.first else draft.length(edge) * seam.ratio
        curvature = _bulged_to(draft, other, wanted)
    if curvature is not None:
        other.fields = other.curved(curvature)
        draft.notes.append(f"{draft.said(other)} is bent with it")


def _bulged_to(draft: Draft, edge: Edge, length: float) -> Any:
    """The curvature by which the edge, as much deeper or flatter as needed, has the length [m]; None when none has."""
    curve = draft.curve(edge)
    if curves.is_straight(curve):
        return None
    as_it_was = edge.fields

    def bulged(factor: float) -> Any:
        if isinstance(curve, curves.Arc):
            return arc_curvature(draft, chord(edge), factor * sagitta(curve))
        frame = np.array(relative(edge.start.position, edge.end.position, _handles(curve))) * [1, factor]
        return {"type": {1: "quadratic", 2: "cubic"}[len(frame)], "params": frame.tolist()}

    def excess(factor: float) -> float:
        edge.fields = edge.curved(bulged(factor))
        try:
            return draft.length(edge) - length
        finally:
            edge.fields = as_it_was

    if excess(0.0) > 0 or excess(BULGE_MAX) < 0:
        return None
    return bulged(scipy.optimize.brentq(excess, 0.0, BULGE_MAX, xtol=1e-12))
