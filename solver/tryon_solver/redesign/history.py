"""The edits of a garment in their order, each undoable.

Applying an edit leaves the specification it was applied to as it is, so undoing is going back to that one. A history is
a value: every change of it is another history. What an edit left as it was is held once, by all that have it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import Edit
from tryon_solver.redesign.parsed import keep_also_for

UNDO_MAX = 1000  # edits that can be undone: all of them are told to clients with every change, 31 bytes each


@dataclass(frozen=True)
class Entry:
    """One edit, and the specification it made."""

    id: int
    edit: Edit
    specification: Mapping[str, Any]


@dataclass(frozen=True)
class History:
    """A garment's specification and the edits that made it of the one it began with.

    The last UNDO_MAX edits can be undone; those before are part of what it begins with. Ids are counted from 1 and
    never given twice, also not after an undo.
    """

    beginning: Mapping[str, Any]
    done: tuple[Entry, ...] = ()
    undone: tuple[Entry, ...] = ()  # the next to redo last
    next_id: int = 1

    @property
    def specification(self) -> Mapping[str, Any]:
        """The specification as it is now."""
        return self.done[-1].specification if self.done else self.beginning

    @property
    def before(self) -> tuple[Mapping[str, Any], ...]:
        """The specifications that led to the one that is now, oldest first; () of one that was never edited."""
        return (self.beginning, *(entry.specification for entry in self.done[:-1])) if self.done else ()

    def append(self, edit: Edit, specification: Mapping[str, Any]) -> History:
        """With one edit more, and what it made. What was undone before can't be redone any more."""
        held = _held_once(specification, self.specification)
        keep_also_for(held, specification)
        done = (*self.done, Entry(self.next_id, edit, held))
        forgotten = done[: max(0, len(done) - UNDO_MAX)]
        beginning = forgotten[-1].specification if forgotten else self.beginning
        return History(beginning, done[len(forgotten) :], (), self.next_id + 1)

    def undo(self) -> History:
        """Without the last edit. Raises EditError when there is none."""
        if not self.done:
            message = "there is no edit to undo"
            raise EditError(message, "history", f"The last {UNDO_MAX} edits of a garment can be undone")
        return replace(self, done=self.done[:-1], undone=(*self.undone, self.done[-1]))

    def redo(self) -> History:
        """With the edit that was undone last. Raises EditError when there is none."""
        if not self.undone:
            raise EditError("there is no edit to redo", "history", "Undo one first; a new edit forgets those undone")
        return replace(self, done=(*self.done, self.undone[-1]), undone=self.undone[:-1])


def _held_once(after: Any, before: Any) -> Any:
    """`after` with what it has in common with `before` being that: of a T-shirt's 40 kB an edit of the hem leaves all
    but 8. Nobody writes to either."""
    if after == before:
        return before
    if isinstance(after, Mapping) and isinstance(before, Mapping):
        return {name: _held_once(value, before.get(name)) for name, value in after.items()}
    if isinstance(after, list) and isinstance(before, list) and len(after) == len(before):
        return [_held_once(*pair) for pair in zip(after, before)]
    return after
