"""Making one piece, or all, wider and higher."""

from __future__ import annotations

import numpy as np

from tryon_solver.geometry.curves import Points
from tryon_solver.geometry.pattern import rotation_from_euler
from tryon_solver.redesign.draft import Draft, Piece, Vertex
from tryon_solver.redesign.edge_shapes import as_bezier, bezier_curvature
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import ScaleGarment, ScalePiece
from tryon_solver.redesign.measures import told
from tryon_solver.redesign.moving import move, note_followers


def scale_piece(draft: Draft, edit: ScalePiece) -> None:
    """Edits ScalePiece."""
    piece = draft.piece(edit.panel)
    polygon = draft.outline(piece)
    middle = (polygon.min(axis=0) + polygon.max(axis=0)) / 2
    note_followers(draft, _scale(draft, piece, np.array(edit.factors), middle))


def scale_garment(draft: Draft, edit: ScaleGarment) -> None:
    """Edits ScaleGarment."""
    top = _highest(draft)
    factors = width, height = edit.scale
    if edit.made_for is not None and edit.wanted is not None:
        draft.notes.append(told(edit.made_for, edit.wanted, factors))
    for piece in draft.pieces.values():
        _scale(draft, piece, np.array(factors), np.zeros(2))
        if on := piece.fields.get("on"):
            at = (np.array(on["at"], dtype=np.float64) * factors).tolist()
            piece.fields = {**piece.fields, "on": {**on, "at": at}}
        else:
            _place(draft, piece, _translation(draft, piece) * [width, height, width])
    shift = np.array([0.0, top - _highest(draft), 0.0])
    for piece in _free(draft):
        _place(draft, piece, _translation(draft, piece) + shift)


def _scale(draft: Draft, piece: Piece, factors: Points, centre: Points) -> dict[Vertex, Points]:
    """Scale the piece by the factors (2,) about the centre (2,) m of its plane. How each vertex moved, (2,) m."""
    moves = {vertex: (factors - 1) * (vertex.position - centre) for vertex in piece.vertices}
    controls = {}
    if factors[0] != factors[1]:  # an arc becomes part of an ellipse, a control point moves against its chord
        for i, edge in enumerate(piece.edges):
            points = as_bezier(draft, edge)
            if points is None:
                message = f"edge {i} of {piece.name!r} is an arc of more than a quarter circle, no ellipse is read"
                raise EditError(message, "factors", "Use the same factor for width and height")
            controls[edge] = centre + factors * (points - centre)
    move(draft, moves)
    for edge, points in controls.items():
        edge.fields = edge.curved(bezier_curvature(points))
    return moves


def _translation(draft: Draft, piece: Piece) -> Points:
    return np.array(piece.fields.get("translation", [0, 0, 0]), dtype=np.float64) / draft.units_in_meter


def _place(draft: Draft, piece: Piece, translation: Points) -> None:
    piece.fields = {**piece.fields, "translation": (translation * draft.units_in_meter).tolist()}


def _free(draft: Draft) -> list[Piece]:
    """The pieces that lie on none: they have places of their own."""
    return [piece for piece in draft.pieces.values() if piece.fields.get("on") is None]


def _highest(draft: Draft) -> float:
    """Height [m] of the garment's highest point where the pattern places it."""
    heights = []
    for piece in _free(draft):
        rotation = rotation_from_euler(np.radians(piece.fields.get("rotation", [0, 0, 0])))
        heights.append((draft.outline(piece) @ rotation[1, :2]).max() + _translation(draft, piece)[1])
    return float(max(heights))
