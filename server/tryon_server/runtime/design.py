"""A garment's sewing pattern as clients draw it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import msgspec
import numpy as np

from tryon_protocol import DesignEdge, DesignEdit, DesignMessage, DesignPanel, DesignPatch, DesignSeam
from tryon_solver.geometry import curves
from tryon_solver.geometry.curves import Curve, Points
from tryon_solver.geometry.pattern import Pattern
from tryon_solver.redesign.bending import handle_places
from tryon_solver.redesign.draft import Draft, Piece, read_draft
from tryon_solver.redesign.history import History
from tryon_solver.redesign.parsed import parsed

CURVE_SEGMENTS = 24  # straight pieces by which a curved edge is drawn
DIGITS = 6  # behind the point, of metres
SHAPES: dict[int, Literal["line", "quadratic", "cubic"]] = {2: "line", 3: "quadratic", 4: "cubic"}


def design_of(
    specification: Mapping[str, Any],
    history: History,
    held: bool = False,
    notes: Sequence[str] = (),
    drawn: DesignMessage | None = None,
    garment: str = "",
) -> DesignMessage:
    """The pattern of a specification that parse_pattern passes, and what can be undone and redone. `drawn` is that of
    another history, if it has been made; `garment` the name under which it is worn."""
    if drawn is not None:
        return msgspec.structs.replace(drawn, held=held, notes=tuple(notes), garment=garment, **_history(history))
    draft = read_draft(specification)
    number = {
        edge: (k, e) for k, piece in enumerate(draft.pieces.values()) for e, edge in enumerate(piece.edges)
    }
    return DesignMessage(
        held=held,
        panels=tuple(_panel(draft, piece) for piece in draft.pieces.values()),
        seams=tuple(
            DesignSeam(first=number[seam.first], second=number[seam.second], number=seam.number) for seam in draft.seams
        ),
        patches=_patches(parsed(specification)),
        notes=tuple(notes),
        garment=garment,
        **_history(history),
    )


def _history(history: History) -> dict[str, Any]:
    done = (
        DesignEdit(id=entry.id, kind=entry.edit.kind, panel=str(getattr(entry.edit, "panel", "")))
        for entry in history.done
    )
    return {"done": tuple(done), "undone": len(history.undone)}


def _patches(pattern: Pattern) -> tuple[DesignPatch, ...]:
    found = []
    for patch in pattern.patches:
        outline = [
            curves.sample_by_arc_length(edge.curve, 1 if curves.is_straight(edge.curve) else CURVE_SEGMENTS)[:-1]
            for edge in pattern.panels[patch.panel].edges
        ]
        points = _plain(patch.on_host(np.vstack(outline)))
        found.append(DesignPatch(panel=patch.panel, host=patch.host, points=points))
    return tuple(found)


def _panel(draft: Draft, piece: Piece) -> DesignPanel:
    index = {vertex: k for k, vertex in enumerate(piece.vertices)}
    return DesignPanel(
        name=piece.name,
        label=str(piece.fields.get("label") or ""),
        vertices=_plain(np.array([vertex.position for vertex in piece.vertices])),
        edges=tuple(_edge(draft.curve(edge), index[edge.start], index[edge.end]) for edge in piece.edges),
    )


def _edge(curve: Curve, start: int, end: int) -> DesignEdge:
    segments = 1 if curves.is_straight(curve) else CURVE_SEGMENTS
    return DesignEdge(
        ends=(start, end),
        shape=SHAPES[len(curve.controls)] if isinstance(curve, curves.Bezier) else "arc",
        handles=_plain(handle_places(curve)),
        points=_plain(curves.sample_by_arc_length(curve, segments)),
    )


def _plain(points: Points) -> tuple[tuple[float, float], ...]:
    return tuple((round(float(x), DIGITS), round(float(y), DIGITS)) for x, y in points)
