"""An edit and its mirror image at once, as one edit of the garment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import scipy  # loads its optimize, which takes 0.2 s, when that is first asked for

from tryon_solver.geometry import curves
from tryon_solver.geometry.curves import Points
from tryon_solver.redesign import edits
from tryon_solver.redesign.apply import Edited, apply, change, changed
from tryon_solver.redesign.cutting import crosses
from tryon_solver.redesign.draft import Draft
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.mirroring import mirrored

SAMPLES = 256  # points of an edge from which the nearest to a place is refined


def apply_to_both(specification: Mapping[str, Any], edit: edits.Edit) -> Edited:
    """Apply the edit here and on the symmetric piece; where there is none, here alone, and a note says why.

    Raises what apply raises, and then nothing is changed on either side.
    """
    image = mirrored(specification, edit)
    other = image.edit
    if other is None:
        here = apply(specification, edit)
        return replace(here, notes=(*here.notes, f"done once: {image.reason}"))

    def make(draft: Draft) -> None:
        place = _mouth(draft, other) if isinstance(other, edits.Dart) else None
        pieces = set(draft.pieces)
        change(draft, edit)
        if isinstance(other, edits.Dart) and place is not None:
            change(draft, _relocated(draft, other, place))
        elif isinstance(other, edits.Cut):
            _cut_parts(draft, other, pieces)
        else:
            change(draft, other)

    try:
        return changed(specification, make, edit.remedy)
    except EditError as error:
        apply(specification, edit)  # raises what is wrong here; else it is what the image comes to
        remedy = f"{error.remedy}, or on one side alone"
        raise EditError(f"on both sides {error.message}", error.place, remedy) from None


def _mouth(draft: Draft, dart: edits.Dart) -> Points:
    """The middle (2,) m of the dart's mouth."""
    curve = draft.curve(draft.edge(dart.panel, dart.edge))
    return curve.points([curves.parameter_at(curve, dart.position)])[0]


def _relocated(draft: Draft, dart: edits.Dart, place: Points) -> edits.Dart:
    """The dart on the edge that now runs through the place (2,) m: its own may have been divided meanwhile."""
    t = np.linspace(0, 1, SAMPLES + 1)
    found = []
    for index, edge in enumerate(draft.piece(dart.panel).edges):
        curve = draft.curve(edge)

        def distance(at: float, curve: curves.Curve = curve) -> float:
            return float(np.hypot(*(curve.points([at])[0] - place)))

        nearest = float(t[np.argmin(np.hypot(*(curve.points(t) - place).T))])
        bounds = (max(0.0, nearest - 1 / SAMPLES), min(1.0, nearest + 1 / SAMPLES))
        best = scipy.optimize.minimize_scalar(distance, bounds=bounds, method="bounded", options={"xatol": 1e-10})
        found.append((float(best.fun), index, curves.share_at(curve, float(best.x))))
    _, index, share = min(found)
    return replace(dart, edge=index, position=share)


def _cut_parts(draft: Draft, cut: edits.Cut, before: set[str]) -> None:
    """Cut whichever parts the line crosses of a piece that may have been cut meanwhile; `before` are older ones."""
    parts = [replace(cut, panel=name) for name in (cut.panel, *(each for each in draft.pieces if each not in before))]
    for part in [each for each in parts if crosses(draft, each)] or [cut]:
        change(draft, part)
