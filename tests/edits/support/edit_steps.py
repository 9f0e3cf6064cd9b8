"""Which change comes next: an edit, the last one taken back, or made again. The same seed asks for the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from any_edit import Seeded, any_edit

from tryon_server.sessions.commands import ChangePattern
from tryon_server.sessions.events import EditMade
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import KINDS
from tryon_solver.redesign.history import History
from tryon_solver.redesign.plain import parse_edit, plain

MIRRORED = 0.3  # of the edits are made on both sides
AGAIN = 0.15  # of what could be made again is


class EditSteps:
    """Steps of a session whose pattern is `specification`."""

    def __init__(self, specification: Mapping[str, Any], kind: str, deepest: int, seed: int) -> None:
        """`kind`: a name of KINDS, each edit of which is taken back before the next, or any other word for all."""
        self.history = History(specification)
        self.kinds = [KINDS[kind]] if kind in KINDS else list(KINDS.values())
        self.deepest = 1 if kind in KINDS else deepest
        self.chance = Seeded(seed)
        self.ticket = 0

    def next(self) -> ChangePattern:
        """A change to ask for: the deeper it is in edits, the likelier one is taken back."""
        self.ticket += 1
        depth = len(self.history.done)
        if self.history.undone and self.chance.real(0, 1) < AGAIN:
            return ChangePattern("redo", self.ticket)
        if depth and self.chance.real(0, self.deepest) < depth:
            return ChangePattern("undo", self.ticket)
        edit = any_edit(self.chance, self.history.specification, self.chance.one_of(self.kinds))
        return ChangePattern("edit", self.ticket, plain(edit), mirror=self.chance.real(0, 1) < MIRRORED)

    def undo(self) -> ChangePattern:
        """Take the last edit back."""
        self.ticket += 1
        return ChangePattern("undo", self.ticket)

    def made(self, event: EditMade) -> None:
        """Take down what was made. Raises EditError where it could not have been."""
        if event.step == "undo":
            self.history = self.history.undo()
        elif event.step == "redo":
            self.history = self.history.redo()
        elif event.edit is None or event.specification is None:
            raise EditError("it is not told what was made", "edit", "Tell it")
        else:
            self.history = self.history.append(parse_edit(event.edit), event.specification)
