"""Which change comes next: an edit, the last one taken back, or made again. The same seed asks for the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from any_edit import Seeded, any_edit, unsewn

from tryon_server.sessions.commands import ChangePattern
from tryon_server.sessions.events import EditMade
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import KINDS, CloseSeam, OpenSeam
from tryon_solver.redesign.history import History
from tryon_solver.redesign.plain import parse_edit, plain

MIRRORED = 0.3  # of the edits are made on both sides
AGAIN = 0.15  # of what could be made again is
CLOSED = 0.2  # of edits while a seam is open close it


class EditSteps:
    """Steps of a session whose pattern is `specification`."""

    def __init__(self, specification: Mapping[str, Any], kind: str, deepest: int, seed: int) -> None:
        """`kind`: a name of KINDS, each edit of which is taken back before the next, or any other word for all. Of a
        garment that is sewn little can be closed and worn but what was opened: of all kinds one now and then closes the
        seam that was opened last, and of CloseSeam alone each closes one that an edit before it opens, and both are
        taken back."""
        self.history = History(specification)
        self.kinds = [KINDS[kind]] if kind in KINDS else list(KINDS.values())
        self.closes = kind == CloseSeam.kind
        self.deepest = 2 if self.closes else 1 if kind in KINDS else deepest
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
        closing = self._closing() if CloseSeam in self.kinds else None
        if closing is not None and (self.closes or self.chance.real(0, 1) < CLOSED):
            return ChangePattern("edit", self.ticket, plain(closing))
        kind = OpenSeam if self.closes else self.chance.one_of(self.kinds)
        edit = any_edit(self.chance, self.history.specification, kind)
        return ChangePattern("edit", self.ticket, plain(edit), mirror=self.chance.real(0, 1) < MIRRORED)

    def _closing(self) -> CloseSeam | None:
        """The seam closed that was opened last, of those that nothing has been sewn to since; None: there is none."""
        free = set(unsewn(self.history.specification))
        for entry, before in zip(reversed(self.history.done), reversed(self.history.before)):
            if not isinstance(entry.edit, OpenSeam):
                continue
            for first, second, *flags in before["pattern"]["stitches"]:
                ends = [(side["panel"], side["edge"]) for side in (first, second)]
                if (entry.edit.panel, entry.edit.edge) in ends and free.issuperset(ends):
                    return CloseSeam(*ends[0], *ends[1], right_wrong="right_wrong" in flags)
        return None

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
