"""Edits of seams: gathered or plain, opened, closed; and taking a piece away."""

from __future__ import annotations

from tryon_solver.redesign.draft import Draft, Edge, Seam
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import CloseSeam, Ease, Gather, OpenSeam, RemovePiece
from tryon_solver.redesign.fanning import fan_out
from tryon_solver.redesign.patching import hosts_no_more, refuse_patch

AS_LONG = 1e-9  # m: an edge that misses its length by less has it


def gather(draft: Draft, edit: Gather) -> None:
    """Edits Gather."""
    seam = draft.seam(edit.panel, edit.edge)
    seam.flags = [*(flag for flag in seam.flags if flag != "gather"), "gather"]
    if edit.to is not None:
        edge = draft.edge(edit.panel, edit.edge)
        _lengthen_to(draft, seam, edge, draft.length(seam.other(edge)) / edit.to, f"gathered to {100 * edit.to:g} %")


def ease(draft: Draft, edit: Ease) -> None:
    """Edits Ease."""
    seam = draft.seam(edit.panel, edit.edge)
    seam.flags = [flag for flag in seam.flags if flag != "gather"]
    edge = draft.edge(edit.panel, edit.edge)
    other = draft.length(seam.other(edge))
    if edit.by is not None and edit.percent is not None:
        raise EditError("the ease is told twice, in metres and per cent", "percent", "Tell one of them")
    if edit.by is not None:
        if other + edit.by <= 0:
            remedy = f"Take less than {other:.3f} m off"
            raise EditError(f"{draft.said(seam.other(edge))} is only {other:.3f} m long", "by", remedy)
        _lengthen_to(draft, seam, edge, other + edit.by, f"with {1000 * edit.by:g} mm of ease")
    elif edit.percent is not None:
        _lengthen_to(draft, seam, edge, other * (1 + edit.percent / 100), f"with {edit.percent:g} % of ease")


def _lengthen_to(draft: Draft, seam: Seam, edge: Edge, length: float, how: str) -> None:
    """Give the edge, one side of the seam, this length [m]; `how` it is sewn then, in words."""
    piece, other = draft.piece_of(edge), draft.piece_of(seam.other(edge))
    if piece is other:
        message = f"both sides of the seam are of {piece.name!r}, which would fan out with both"
        raise EditError(message, "edge", "Leave the amount out, or move its corners")
    refuse_patch(piece, "it can't be fanned out")
    if abs(draft.length(edge) - length) > AS_LONG:
        fan_out(draft, edge, length)
    draft.notes.append(f"{draft.said(edge)} is {100 * length:.1f} cm long, {how} on {draft.said(seam.other(edge))}")


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
    draft.sew(first, second, flags)


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
