"""A drag's edits worked out beside the simulation: sixty of them a second may come, and each takes Python as long as a
frame takes a GPU. The process that does so has to be there, which a busy machine takes seconds for, and to be told of
the garment; until then they are left to be worked out between frames, where the garment is known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from tryon_protocol import DesignMessage
from tryon_server.runtime.beside import Beside, Made
from tryon_server.runtime.design import design_of
from tryon_server.runtime.drape import Drape
from tryon_server.runtime.redesign import Wanted, wanted
from tryon_server.runtime.worn_pattern import NotKnownError, Shapes
from tryon_server.sessions.commands import ChangePattern
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.history import History


@dataclass(frozen=True, eq=False)
class WorkedOut:
    """What a held edit makes: the pattern, plain JSON, and what happened besides; shape and drawing as in Wanted."""

    specification: Mapping[str, Any]
    notes: tuple[str, ...]
    shape: Any
    drawn: DesignMessage

    def wanted(self, history: History) -> Wanted:
        """What it asks for of the pattern with this history."""
        return Wanted(history, self.specification, self.notes, shape=self.shape, drawn=self.drawn)


@dataclass(frozen=True)
class Refused:
    """Why a held edit can't be made."""

    message: str
    place: str
    remedy: str

    def wanted(self, _history: History) -> Wanted:
        """Raises EditError."""
        raise EditError(self.message, self.place, self.remedy)


Outcome = WorkedOut | Refused


@dataclass(frozen=True)
class NotKnown:
    """The process has never been told of the garment, or was started since: it has to be told."""


@dataclass(frozen=True, eq=False)
class WorkingOut:
    """Works a held edit of this pattern out. Call it in any process."""

    specification: Mapping[str, Any]
    command: ChangePattern
    shape_of: Callable[[Mapping[str, Any]], Any]

    def __call__(self) -> Outcome | NotKnown:
        nothing_done = History(self.specification)
        try:
            asked = wanted(nothing_done, self.command)
        except EditError as error:
            return Refused(error.message, error.place, error.remedy)
        try:
            shape = self.shape_of(asked.specification)
        except NotKnownError:
            return NotKnown()
        drawn = design_of(asked.specification, nothing_done, held=True)
        return WorkedOut(asked.specification, asked.notes, shape, drawn)


@dataclass(frozen=True, eq=False)
class MakingReady:
    """Makes a process ready to find shapes in what is worn. Call it there."""

    shapes: Shapes

    def __call__(self) -> None:
        self.shapes.make_ready()


class HeldEdits:
    """At most one edit that is being worked out `beside`, which serves others, too: they go first."""

    def __init__(self, beside: Beside) -> None:
        self._beside = beside
        self._task: WorkingOut | None = None
        self._drape: Drape | None = None  # whose shape is to be found
        self._making_ready: MakingReady | None = None
        self._told: Shapes | None = None  # what the other process has been told of last, and is ready for

    @property
    def under_way(self) -> bool:
        """Is one being worked out?"""
        return self._task is not None and self._beside.doing is self._task

    def take(self, command: ChangePattern, history: History, drape: Drape) -> bool:
        """Have it worked out, if it is an edit that is held, nothing else is being done beside, and the process there
        is ready for what is worn, which it is made otherwise; any other command ends the drag, and what is being worked
        out is given up."""
        if not command.hold or command.edit is None:
            self.give_up()
            return False
        if self._beside.doing is not None:
            return False
        shapes = drape.shape_of
        if isinstance(shapes, Shapes):
            if shapes is not self._told:
                self._making_ready = MakingReady(shapes)
                self._beside.begin(self._making_ready, short=True)
                return False
            shapes = shapes.by_number()
        self._task, self._drape = WorkingOut(history.specification, command, shapes), drape
        self._beside.begin(self._task, short=True)
        return True

    def give_up(self) -> None:
        """Nobody waits for it any more."""
        if self.under_way:
            self._beside.give_up()
        self._task = self._drape = None

    def outcome(self, worn: Drape | None) -> tuple[ChangePattern, Outcome | None] | None:
        """The edit, once it is worked out, and what it came to; None where another garment is worn by now, where it was
        given up for something else, or where the process was started since and knows nothing of what is worn. Then no
        more; returns at once."""
        self._look_whether_ready()
        task, under_way = self._task, self.under_way
        ended = self._beside.outcome() if under_way else None
        if task is None or (under_way and ended is None):
            return None
        drape, self._task, self._drape = self._drape, None, None
        if ended is None or drape is None or drape is not worn:
            return task.command, None
        if isinstance(ended, Made) and isinstance(ended.value, NotKnown):
            self._told = None
            return task.command, None
        if isinstance(ended, Made):
            return task.command, ended.value
        return task.command, Refused(ended.problem.message, ended.problem.place, ended.problem.remedy)

    def _look_whether_ready(self) -> None:
        making = self._making_ready
        if making is None:
            return
        ended = self._beside.outcome() if self._beside.doing is making else None
        if isinstance(ended, Made):
            self._told = making.shapes
        if self._beside.doing is not making:  # ended, or given up for something else
            self._making_ready = None
