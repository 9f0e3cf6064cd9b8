"""The same edit on the other side of the body."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.redesign import edits
from tryon_solver.redesign.bending import handle_count
from tryon_solver.redesign.draft import Draft, read_draft
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.symmetry import TOLERANCE, Image, find_image

ON_ITSELF = 2e-3  # m; a line or dart nearer than this to its own mirror image is that
AXES_AGREE = 1e-3  # of a unit axis
SeamEdit = edits.TakeIn | edits.Gather | edits.Ease | edits.OpenSeam


@dataclass(frozen=True)
class Mirrored:
    """The mirrored edit, or why there is none."""

    edit: edits.Edit | None
    reason: str = ""


class _NoImageError(Exception):
    """Why an edit has no mirror image."""


def mirrored(specification: Mapping[str, Any], edit: edits.Edit) -> Mirrored:
    """The edit on the symmetric piece, for the specification as it is before the edit.

    Pieces are symmetric where the pattern places them across x = 0 within TOLERANCE. Raises EditError when the garment
    has nothing that the edit names, and PatternError when the specification is none.
    """
    parse_pattern(specification)
    draft = read_draft(specification)
    if isinstance(edit, edits.ScaleGarment | edits.ChangeFabric):
        return Mirrored(None, "it is of the whole garment")
    try:
        image = _image(draft, edit.panel)
        other, itself = IMAGES[type(edit)](draft, edit, image)
    except _NoImageError as none:
        return Mirrored(None, str(none))
    return Mirrored(None, "it is its own mirror image") if itself else Mirrored(other)


def _image(draft: Draft, name: str, place: str = "panel") -> Image:
    image = find_image(draft, draft.piece(name, place))
    if image is None:
        raise _NoImageError(f"no piece is the mirror image of {name!r} to within {TOLERANCE * 100:g} cm")
    return image


Found = tuple[edits.Edit, bool]  # the image, and whether that is the edit over again


def _move_vertex(draft: Draft, edit: edits.MoveVertex, image: Image) -> Found:
    draft.vertex(edit.panel, edit.vertex)
    vertex = image.vertex[edit.vertex]
    other = edits.MoveVertex(image.piece.name, vertex, image.direction(edit.by))
    return other, (other.panel, vertex) == (edit.panel, edit.vertex)


def _move_handle(draft: Draft, edit: edits.MoveHandle, image: Image) -> Found:
    edge = _edge(draft, edit, image)
    count = handle_count(draft.curve(draft.edge(edit.panel, edit.edge)))
    if edit.handle >= count:
        message = f"edge {edit.edge} of {edit.panel!r} has no handle {edit.handle}"
        raise EditError(message, "handle", f"Use 0 to {count - 1}")
    handle = count - 1 - edit.handle if image.turned else edit.handle
    other = edits.MoveHandle(image.piece.name, edge, handle, image.direction(edit.by))
    return other, (other.panel, edge, handle) == (edit.panel, edit.edge, edit.handle)


def _lengthen(draft: Draft, edit: edits.Lengthen, image: Image) -> Found:
    other = replace(edit, panel=image.piece.name, edge=_edge(draft, edit, image))
    return other, (other.panel, other.edge) == (edit.panel, edit.edge)


def _of_a_seam(draft: Draft, edit: SeamEdit, image: Image) -> Found:
    seam = draft.seam(edit.panel, edit.edge)
    other = replace(edit, panel=image.piece.name, edge=_edge(draft, edit, image))
    return other, draft.edge(other.panel, other.edge) in (seam.first, seam.second)


def _close_seam(draft: Draft, edit: edits.CloseSeam, image: Image) -> Found:
    draft.edge(edit.to_panel, edit.to_edge, "to_panel", "to_edge")
    to = _image(draft, edit.to_panel, "to_panel")
    sides = (image.piece.name, _edge(draft, edit, image)), (to.piece.name, to.edge[edit.to_edge])
    other = replace(edit, panel=sides[0][0], edge=sides[0][1], to_panel=sides[1][0], to_edge=sides[1][1])
    return other, set(sides) == {(edit.panel, edit.edge), (edit.to_panel, edit.to_edge)}


def _cut(_draft: Draft, edit: edits.Cut, image: Image) -> Found:
    other = replace(edit, panel=image.piece.name, line=(image.point(edit.line[0]), image.point(edit.line[1])))
    start, end = np.array(edit.line)
    along = (end - start) / max(np.hypot(*(end - start)), ON_ITSELF)
    across = (np.array(other.line) - start) @ [-along[1], along[0]]
    return other, other.panel == edit.panel and bool(np.abs(across).max() < ON_ITSELF)


def _dart(draft: Draft, edit: edits.Dart, image: Image) -> Found:
    edge = _edge(draft, edit, image)
    position = 1 - edit.position if image.turned else edit.position
    other = replace(edit, panel=image.piece.name, edge=edge, position=position)
    apart = abs(position - edit.position) * draft.length(draft.edge(edit.panel, edit.edge))
    return other, (other.panel, edge) == (edit.panel, edit.edge) and apart < ON_ITSELF


def _sewn_on(_draft: Draft, edit: edits.Patch | edits.Pocket, image: Image) -> Found:
    turn = np.radians(edit.turn)
    up = image.direction((-np.sin(turn), np.cos(turn)))
    other = replace(
        edit, panel=image.piece.name, at=image.point(edit.at), turn=float(np.degrees(np.arctan2(-up[0], up[1])))
    )
    apart = np.hypot(*np.subtract(other.at, edit.at))
    return other, other.panel == edit.panel and bool(apart < ON_ITSELF)


def _scale_piece(_draft: Draft, edit: edits.ScalePiece, image: Image) -> Found:
    axes = np.abs(image.linear)
    factors = edit.factors
    if np.abs(axes - np.eye(2)[::-1]).max() < AXES_AGREE:
        factors = factors[::-1]
    elif factors[0] != factors[1] and np.abs(axes - np.eye(2)).max() > AXES_AGREE:
        name = image.piece.name
        raise _NoImageError(f"its mirror image {name!r} is drawn at another angle: width and height are not its own")
    return edits.ScalePiece(image.piece.name, factors), image.piece.name == edit.panel


def _remove_piece(_draft: Draft, edit: edits.RemovePiece, image: Image) -> Found:
    return edits.RemovePiece(image.piece.name), image.piece.name == edit.panel


def _edge(draft: Draft, edit: Any, image: Image) -> int:
    draft.edge(edit.panel, edit.edge)
    return image.edge[edit.edge]


IMAGES: dict[type[edits.Edit], Callable[[Draft, Any, Image], Found]] = {
    edits.MoveVertex: _move_vertex,
    edits.MoveHandle: _move_handle,
    edits.Lengthen: _lengthen,
    edits.TakeIn: _of_a_seam,
    edits.Gather: _of_a_seam,
    edits.Ease: _of_a_seam,
    edits.OpenSeam: _of_a_seam,
    edits.CloseSeam: _close_seam,
    edits.Cut: _cut,
    edits.Dart: _dart,
    edits.Patch: _sewn_on,
    edits.Pocket: _sewn_on,
    edits.ScalePiece: _scale_piece,
    edits.RemovePiece: _remove_piece,
}
