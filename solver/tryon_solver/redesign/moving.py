"""Edits that move vertices: one vertex, an edge across itself, both sides of a seam."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tryon_solver.geometry import curves
from tryon_solver.geometry.curves import Points
from tryon_solver.redesign.draft import Draft, Edge, Vertex
from tryon_solver.redesign.edge_shapes import chord, stretch_arcs
from tryon_solver.redesign.edits import Lengthen, MoveVertex, TakeIn
from tryon_solver.redesign.following import follow

Moves = Mapping[Vertex, Points]

# A neighbour that runs within 17 degrees of an edge gives it no direction to move in: its end would go far along.
SLIDE_MIN = 0.3
TOLD_FROM = 5e-4  # m that a partner moves


def move_vertex(draft: Draft, edit: MoveVertex) -> None:
    """Edits MoveVertex."""
    _move_and_follow(draft, {draft.vertex(edit.panel, edit.vertex): np.array(edit.by)})


def lengthen(draft: Draft, edit: Lengthen) -> None:
    """Edits Lengthen."""
    _move_and_follow(draft, offset(draft, draft.edge(edit.panel, edit.edge), edit.by))


def take_in(draft: Draft, edit: TakeIn) -> None:
    """Edits TakeIn."""
    seam = draft.seam(edit.panel, edit.edge)
    one, other = (offset(draft, edge, -edit.by) for edge in (seam.first, seam.second))
    shared = one.keys() & other.keys()
    _move_and_follow(draft, {vertex: by for vertex, by in (one | other).items() if vertex not in shared})


def offset(draft: Draft, edge: Edge, distance: float) -> dict[Vertex, Points]:
    """Moves (2,) m of the edge's ends that bring it outwards by the distance [m], each along the edge beside it."""
    piece = draft.piece_of(edge)
    turns = draft.turns(piece)
    before = curves.end_tangents(draft.curve(piece.before(edge)))[1]
    after = curves.end_tangents(draft.curve(piece.after(edge)))[0]
    moves = {}
    for vertex, along, beside in zip((edge.start, edge.end), curves.end_tangents(draft.curve(edge)), (before, after)):
        outward = turns * np.array([along[1], -along[0]])
        slope = float(outward @ beside)
        moves[vertex] = distance * (beside / slope if abs(slope) >= SLIDE_MIN else outward)
    return moves


def move(draft: Draft, moves: Moves) -> None:
    """Move each of the vertices by (2,) m. Control points, relative to the edge, follow; arcs keep their shape."""
    touched = [edge for piece in draft.pieces.values() for edge in piece.edges if {edge.start, edge.end} & set(moves)]
    before = {edge: chord(edge) for edge in touched}
    for vertex, by in moves.items():
        vertex.position = vertex.position + by
    for edge, length in before.items():
        if chord(edge) != length:
            stretch_arcs(edge, chord(edge) / length)


def _move_and_follow(draft: Draft, moves: Moves) -> None:
    move(draft, moves)
    note_followers(draft, moves)


def note_followers(draft: Draft, moves: Moves) -> None:
    """Move what is sewn at the vertices that were moved, and say of which pieces."""
    followers = follow(draft, moves)
    move(draft, followers)
    for piece in draft.pieces.values():
        moved = {i: np.hypot(*followers[v]) for i, v in enumerate(piece.vertices) if v in followers}
        told = [f"{i}" for i, distance in moved.items() if distance >= TOLD_FROM]
        if told:
            where = f"{'vertices' if len(told) > 1 else 'vertex'} {', '.join(told)}"
            most = f"{'up to ' if len(told) > 1 else ''}{max(moved.values()) * 100:.1f} cm"
            draft.notes.append(f"{piece.name!r} follows so that its seams fit: {where} by {most}")
