"""The pattern of a session's garment under change: the edits that were made of it, and what a command makes of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from tryon_protocol import DesignMessage
from tryon_server.runtime.order import DrapeOrder, KeptEdit
from tryon_server.sessions.commands import ChangePattern
from tryon_server.sessions.events import EditMade
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.both_sides import apply_to_both
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import Edit
from tryon_solver.redesign.fabrics import named_fabric
from tryon_solver.redesign.history import Entry, History
from tryon_solver.redesign.plain import parse_edit, plain

ROUNDING = 1e-9  # of a number of a pattern, which is in centimetres as a rule: less than an atom
ITS_OWN = "all edits are taken back: the garment is worn in the mesh that it began with"


@dataclass(frozen=True)
class Wanted:
    """What a command asks for.

    Attributes:
        history: the edits as they are then; those that are kept, where the command only shows something.
        specification: the pattern to wear, plain JSON.
        notes: what happened besides, for people.
        id: of the edit that is made, taken back or made again; 0 of one that is only shown.
        edit: a new edit.
        shape: the pattern's in the mesh of the garment that is worn, where that was worked out, as its ``shape_of``
            finds it.
        drawn: the pattern as clients draw it, of another history, where that was worked out.
    """

    history: History
    specification: Mapping[str, Any]
    notes: tuple[str, ...] = ()
    id: int = 0
    edit: Edit | None = None
    shape: Any = None
    drawn: DesignMessage | None = None

    @property
    def worn_by_way_of(self) -> tuple[Mapping[str, Any], ...]:
        """The patterns by way of which it has been worn; () of a new edit's, which never was."""
        return () if self.edit is not None else self.history.before

    def mesh_of_its_own(self, worn: Mapping[str, Any] | None) -> str:
        """Why it needs another mesh, though that of the `worn` pattern may take on its shape, or "": with all edits
        taken back the garment is what it began as, whichever edits a mesh was made for on the way."""
        back = not self.history.done and self.specification == self.history.beginning
        return ITS_OWN if back and worn != self.specification else ""

    def made(self, command: ChangePattern, change: Literal["value", "topology"]) -> EditMade:
        """The event that tells that it is done."""
        last = self.history.done[-1].id if self.history.done else 0
        made = EditMade(command.ticket, command.step, self.id, last, change, garment=command.garment, notes=self.notes)
        if self.edit is None:
            return made
        return replace(made, edit=plain(self.edit), mirror=command.mirror, specification=self.specification)


def wanted(history: History, command: ChangePattern) -> Wanted:
    """What the command makes of a pattern with this history. Raises EditError, and then nothing is to be changed."""
    if command.step == "undo":
        after = history.undo()
        return Wanted(after, after.specification, id=history.done[-1].id)
    if command.step == "redo":
        after = history.redo()
        return Wanted(after, after.specification, id=after.done[-1].id)
    if command.edit is None and command.hold:
        return Wanted(history, history.specification)
    edit = parse_edit(command.edit)
    edited = (apply_to_both if command.mirror else apply)(history.specification, edit)
    if command.hold:
        return Wanted(history, edited.specification, edited.notes)
    if _the_same(edited.specification, history.specification):
        raise EditError("it leaves the pattern as it is", "edit", "Change something by more, or make no edit")
    after = history.append(edit, edited.specification)
    return Wanted(after, after.specification, edited.notes, after.done[-1].id, edit)


def _the_same(one: Any, other: Any) -> bool:
    """Are these patterns, or parts of them, one but for rounding?"""
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(_the_same(value, other[name]) for name, value in one.items())
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_the_same, one, other))
    if isinstance(one, float) and isinstance(other, int | float):
        return abs(one - other) <= ROUNDING
    return bool(one == other)


def history_of(kept: Sequence[KeptEdit]) -> History:
    """The history that an earlier session began, of one garment, with edits that were taken back last first."""
    beginning, *edits = kept
    entries = [(Entry(edit.id, parse_edit(edit.edit), edit.specification), edit.undone) for edit in edits]
    history = History(beginning.specification)
    for entry, undone in entries:
        if not undone:
            history = replace(history, next_id=entry.id).append(entry.edit, entry.specification)
    taken_back = tuple(entry for entry, undone in reversed(entries) if undone)
    return replace(history, undone=taken_back, next_id=max((entry.id for entry, _ in entries), default=0) + 1)


def of_pattern(
    order: DrapeOrder, specification: Mapping[str, Any], edited_from: tuple[Mapping[str, Any], ...] = ()
) -> DrapeOrder:
    """The garment of this pattern in place of the order's that is edited, of the fabric that it names; edited from
    these patterns, where it has been worn by way of them."""
    return order.with_pattern(specification, named_fabric(specification) or order.of_edited.fabric, edited_from)
