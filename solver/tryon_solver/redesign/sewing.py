"""Edits of seams: gathered or plain, opened, closed; and taking a piece away."""

from __future__ import annotations

from tryon_solver.redesign.draft import Draft, Seam
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import CloseSeam, Ease, Gather, OpenSeam, RemovePiece
from tryon_solver.redesign.patching import hosts_no_more


def gather(draft: Draft, edit: Gather) -> None:
    """Edits Gather."""
    seam = draft.seam(edit.panel, edit.edge)
    seam.flags = [*(flag for flag in seam.flags if flag != "gather"), "gather"]


def ease(draft: Draft, edit: Ease) -> None:
    """Edits Ease."""
    seam = draft.seam(edit.panel, edit.edge)
    seam.flags = [flag for flag in seam.flags if flag != "gather"]


def open_seam(draft: Draft, edit: OpenSeam) -> None:
    """Edits OpenSeam."""
    draft.seams.remove(draft.seam(edit.panel, edit.edge))


def close_seam(draft: Draft, edit: CloseSeam) -> None:
    """Edits CloseSeam."""
    first = draft.edge(edit.panel, edit.edge)
    second = draft.edge(edit.to_panel, edit.to_edge, "to_panel", "to_edge")
    if first is second:
        raise EditError("an edge can't be sewn to itself", "to_edge", "Choose another edge")
    for edge, place in ((first, "edge"), (second, "to_edge")):
        seam = draft.seam_at(edge)
        if seam is not None:
            message = f"{draft.said(edge)} is sewn already, to {draft.said(seam.other(edge))}"
            raise EditError(message, place, "Open that seam first, or choose another edge")
    flags = ["right_wrong"] * edit.right_wrong + ["gather"] * edit.gather
    draft.seams.append(Seam(first, second, flags, 1.0))


def remove_piece(draft: Draft, edit: RemovePiece) -> None:
    """Edits RemovePiece."""
    piece = draft.piece(edit.panel)
    if len(draft.pieces) == 1:
        raise EditError(f"{edit.panel!r} is the only piece", "panel", "Keep it, or remove the garment")
    opened = [seam for seam in draft.seams if seam.first in piece.edges or seam.second in piece.edges]
    for seam in opened:
        draft.seams.remove(seam)
        draft.notes += [
            f"{draft.said(edge)} is open now" for edge in (seam.first, seam.second) if edge not in piece.edges
        ]
    del draft.pieces[edit.panel]
    hosts_no_more(draft, piece, ())
