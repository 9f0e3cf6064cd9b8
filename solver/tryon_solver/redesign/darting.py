"""Sewing a dart: a wedge taken out of a piece at an edge, its legs sewn together."""

from __future__ import annotations

import numpy as np

from tryon_solver.redesign.dividing import divide_side, sew_parts
from tryon_solver.redesign.draft import Draft, Edge, Vertex
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import Dart
from tryon_solver.redesign.patching import refuse_patch

BESIDE_MIN = 5e-3  # m of the edge that stay on either side of a dart


def dart(draft: Draft, edit: Dart) -> None:
    """Edits Dart."""
    edge = draft.edge(edit.panel, edit.edge)
    piece = draft.piece(edit.panel)
    refuse_patch(piece, "it can have no dart")
    length = draft.length(edge)
    start, end = edit.position * length - edit.width / 2, edit.position * length + edit.width / 2
    if start < BESIDE_MIN or end > length - BESIDE_MIN:
        message = f"the dart's mouth, {edit.width * 100:.1f} cm, does not fit on an edge of {length * 100:.1f} cm there"
        remedy = f"Make it less wide, or place it so that {BESIDE_MIN * 1000:g} mm of the edge stay on either side"
        raise EditError(message, "position", remedy)
    seam = draft.seam_at(edge)
    turns = draft.turns(piece)
    first, rest = divide_side(draft, edge, start / length)
    mouth, last = divide_side(draft, rest, edit.width / (length - start))
    one, two = mouth.start.position, mouth.end.position
    along = (two - one) / np.hypot(*(two - one))
    point = Vertex((one + two) / 2 + edit.depth * turns * np.array([-along[1], along[0]]))
    legs = Edge(mouth.start, point, {}), Edge(point, mouth.end, {})
    place = piece.edges.index(mouth)
    piece.edges[place : place + 1] = legs
    piece.vertices.append(point)
    if seam is not None:
        sew_parts(draft, seam, edge, (first, last), start / (length - edit.width))
    draft.sew(*legs)
