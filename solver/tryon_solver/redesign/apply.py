"""Applying an edit: another specification that the parser passes, or EditError and nothing changed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from tryon_solver.geometry.pattern import Pattern, PatternError
from tryon_solver.geometry.wearable import check_wearable
from tryon_solver.redesign import edits
from tryon_solver.redesign.bending import move_handle
from tryon_solver.redesign.cutting import cut
from tryon_solver.redesign.darting import dart
from tryon_solver.redesign.draft import Draft, read_draft
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.fabrics import change_fabric
from tryon_solver.redesign.moving import lengthen, move_vertex, take_in
from tryon_solver.redesign.parsed import parsed
from tryon_solver.redesign.patching import patch, pocket
from tryon_solver.redesign.scaling import scale_garment, scale_piece
from tryon_solver.redesign.sewing import close_seam, ease, gather, open_seam, remove_piece
from tryon_solver.redesign.structure import difference

MISFIT = 1e-3  # m that a seam's sides may miss the lengths they had to each other, untold

CHANGES: dict[type[edits.Edit], Callable[[Draft, Any], None]] = {
    edits.MoveVertex: move_vertex,
    edits.MoveHandle: move_handle,
    edits.Lengthen: lengthen,
    edits.TakeIn: take_in,
    edits.ScalePiece: scale_piece,
    edits.ScaleGarment: scale_garment,
    edits.Gather: gather,
    edits.Ease: ease,
    edits.OpenSeam: open_seam,
    edits.CloseSeam: close_seam,
    edits.Cut: cut,
    edits.Dart: dart,
    edits.Patch: patch,
    edits.Pocket: pocket,
    edits.RemovePiece: remove_piece,
    edits.ChangeFabric: change_fabric,
}


@dataclass(frozen=True)
class Edited:
    """What an edit made."""

    specification: dict[str, Any]  # JSON that parse_pattern passes
    change: Literal["value", "topology"]  # value: the same fabric, pieces, vertices, edges and seams, in other shapes
    notes: tuple[str, ...]  # which partners followed, which seams fit no longer as they did


def apply(specification: Mapping[str, Any], edit: edits.Edit) -> Edited:
    """Apply the edit to a specification that parse_pattern passes, which stays as it is: nobody writes to it later.

    Raises EditError, which says why, when the garment has nothing of the kind or would not be one any more: by the
    checks of parse_pattern and, for a garment that could be worn, of check_wearable. Raises PatternError when the
    specification is none.
    """
    return changed(specification, lambda draft: change(draft, edit), edit.remedy)


def change(draft: Draft, edit: edits.Edit) -> None:
    """Make the edit's change of the draft. Raises EditError when the garment has nothing of the kind."""
    CHANGES[type(edit)](draft, edit)


def changed(specification: Mapping[str, Any], make: Callable[[Draft], None], smaller: str) -> Edited:
    """What `make` makes of the specification, checked as apply says. smaller: the remedy for a result that is none."""
    before = parsed(specification)
    draft = read_draft(specification)
    make(draft)
    edited = draft.written()
    try:
        after = parsed(edited)
        if _wearable(before):
            check_wearable(after)
        _check_not_turned_over(before, after)
    except PatternError as error:
        remedy = smaller + (", or gather the seam" if error.place.startswith("stitches[") else "")
        raise EditError(f"it would make an invalid garment: {error.message}", error.place, remedy) from error
    kind: Literal["value", "topology"] = "value" if difference(before, after) is None else "topology"
    return Edited(edited, kind, (*dict.fromkeys(draft.notes), *_misfits(draft)))


def _wearable(pattern: Pattern) -> bool:
    try:
        check_wearable(pattern)
    except PatternError:
        return False
    return True


def _check_not_turned_over(before: Pattern, after: Pattern) -> None:
    """Raise PatternError for a piece that has its other side out: an edge went through the opposite one and beyond.

    Its outline crosses itself on the way there and at the end does not; what is sewn to it would have to turn, too.
    """
    was_clockwise = {panel.name: panel.clockwise for panel in before.panels}
    for panel in after.panels:
        if was_clockwise.get(panel.name, panel.clockwise) != panel.clockwise:
            message = f"the panel {panel.name!r} is turned over: its outline runs the other way around"
            raise PatternError(message, f"panels.{panel.name}", "Draw its edges around it as they were")


def _misfits(draft: Draft) -> list[str]:
    """The seams whose sides have no longer the lengths that they had to each other, in words."""
    told = []
    for seam in draft.seams:
        first, second = draft.length(seam.first), draft.length(seam.second)
        if abs(first - seam.ratio * second) > MISFIT:
            told.append(
                f"{draft.said(seam.first)} is now {first * 100:.1f} cm long and {draft.said(seam.second)}, sewn to it, "
                f"{second * 100:.1f} cm"
            )
    return told
