"""Changes of the pattern that are not answered yet, since the garment that they make is still being made."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from tryon_server.runtime.redesign import Wanted, wanted
from tryon_server.sessions.commands import HELD, ChangePattern, Command
from tryon_server.sessions.events import ChangeUnderWay, Doing, EditRefused
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.history import History

HELD_SHARE = 0.25  # of the time, that a drag's edits may take from the frames
PATIENCE = 1.0  # s, after which a change that waits is shown before newer ones, if its garment is being put on
LOOK_SECONDS = 0.002  # between looks at an edit that is being worked out, while there is nothing else to do


@dataclass
class _Change:
    """A command, and what it makes of the pattern, or why it is refused."""

    command: ChangePattern
    outcome: Wanted | EditRefused
    since: float  # s


@dataclass
class WaitingChanges:
    """In the order of the commands, in which they are answered. Each is one of the pattern that those before it make;
    one that is refused makes nothing of it."""

    _changes: list[_Change] = field(default_factory=list)
    _first_since: float = 0.0  # s, when the first one that is not refused became that

    def __bool__(self) -> bool:
        return bool(self._changes)

    @property
    def newest(self) -> Wanted | None:
        """What the last one that is not refused makes of the pattern; None without such."""
        every = [change.outcome for change in self._changes if isinstance(change.outcome, Wanted)]
        return every[-1] if every else None

    def add(self, command: ChangePattern, outcome: Wanted | EditRefused, now: float) -> None:
        """Answer this one, asked `now` [s], after those that wait."""
        self._first_since = now if self.first is None else self._first_since
        self._changes.append(_Change(command, outcome, now))

    def long_since(self, now: float) -> bool:
        """Has the first of them waited for more than PATIENCE?"""
        return bool(self._changes) and now - self._changes[0].since > PATIENCE

    @property
    def first(self) -> Wanted | None:
        """What the first one that is not refused makes of the pattern; None without such."""
        return next((one.outcome for one in self._changes if isinstance(one.outcome, Wanted)), None)

    def late(self, now: float, limit: float) -> bool:
        """Has there been nothing to be made before the first of them for more than this [s]?"""
        return self.first is not None and now - self._first_since > limit

    def place_of(self, specification: Mapping[str, Any]) -> int | None:
        """How many of those that are not refused are before the first that makes this pattern; None where none does."""
        every = [one for one in self._changes if isinstance(one.outcome, Wanted)]
        return next((k for k, one in enumerate(every) if _makes(one, specification)), None)

    def refuse_first(self, error: EditError, history: History, now: float) -> None:
        """What the first of them makes of the pattern, which has this history, can't be worn; those behind it are made
        of the pattern without it, or refused where they can't be. An undo is not refused as long as there is something
        further back: what a newer edit took the place of before it was worn may never have been wearable."""
        self._refuse_from(0, error, history, further=True)
        self._first_since = now

    def refuse(self, ticket: int, error: EditError, history: History, now: float) -> bool:
        """The same of the one whose command has this ticket, wherever it stands; False where it does not wait."""
        place = next((k for k, one in enumerate(self._changes) if _waits_as(one, ticket)), None)
        if place is None:
            return False
        before = [one.outcome for one in self._changes[:place] if isinstance(one.outcome, Wanted)]
        self._refuse_from(place, error, before[-1].history if before else history)
        self._first_since = self._first_since if before else now
        return True

    def _refuse_from(self, place: int, error: EditError, history: History, further: bool = False) -> None:
        """Refuse the first that is not refused of those from this place on, which the pattern of this history stands
        before, and make those behind it of the pattern without it; or have it, an undo, go `further`."""
        refused: Mapping[str, Any] | None = None
        for change in self._changes[place:]:
            if isinstance(change.outcome, EditRefused):
                continue
            try:
                if refused is None:
                    refused = change.outcome.specification
                    outcome = _further_back(change.command, change.outcome, error) if further else None
                    if outcome is None:
                        raise error
                else:
                    outcome = wanted(history, change.command)
                    if outcome.specification == refused:
                        raise error
                change.outcome, history = outcome, outcome.history
            except EditError as fault:
                change.outcome = refusal(change.command, fault)

    def refuse_all(self, error: EditError) -> None:
        """None of them can be worn."""
        for change in self._changes:
            if isinstance(change.outcome, Wanted):
                change.outcome = refusal(change.command, error)

    def under_way(
        self, made: Mapping[str, Any], doing: tuple[Doing, str, float | None]
    ) -> tuple[ChangeUnderWay, ...]:
        """What is done for each: this, for those up to the last that makes the pattern which is `made`."""
        last = max((k for k, one in enumerate(self._changes) if _makes(one, made)), default=-1)
        return tuple(
            ChangeUnderWay(one.command.ticket, *(doing if k <= last else ("waiting",)))
            for k, one in enumerate(self._changes)
            if isinstance(one.outcome, Wanted) and one.command.ticket > HELD
        )

    def take_refused(self) -> list[EditRefused]:
        """The refusals that wait for nothing before them, to be told now."""
        return [outcome for _command, outcome in self._take_refused()]

    def _take_refused(self) -> list[tuple[ChangePattern, EditRefused]]:
        refused = []
        while self._changes and isinstance(outcome := self._changes[0].outcome, EditRefused):
            refused.append((self._changes[0].command, outcome))
            del self._changes[0]
        return refused

    def take_up_to(self, worn: Mapping[str, Any], now: float) -> list[tuple[ChangePattern, Wanted | EditRefused]]:
        """Those up to the last that makes the pattern that is worn `now` [s], and refusals behind it."""
        last = max((k for k, one in enumerate(self._changes) if _makes(one, worn)), default=-1) + 1
        taken, self._changes = self._changes[:last], self._changes[last:]
        self._first_since = now if taken else self._first_since
        return [*((change.command, change.outcome) for change in taken), *self._take_refused()]


def _further_back(command: ChangePattern, outcome: Wanted, error: EditError) -> Wanted | None:
    """Of an undo that leads to what can't be worn the one that takes back what made that, too; None without."""
    if command.step != "undo" or not outcome.history.done:
        return None
    after, made = outcome.history.undo(), outcome.history.done[-1]
    note = f"edit {made.id} is taken back with it, for what it made can't be worn: {error.message}"
    return Wanted(after, after.specification, (*outcome.notes, note), id=outcome.id)


def _waits_as(change: _Change, ticket: int) -> bool:
    return change.command.ticket == ticket and isinstance(change.outcome, Wanted)


def _makes(change: _Change, worn: Mapping[str, Any]) -> bool:
    return isinstance(change.outcome, Wanted) and change.outcome.specification is worn


def sooner(one: float | None, other: float | None) -> float | None:
    """The shorter of two pauses [s]; None is none, and waits for ever."""
    return min((pause for pause in (one, other) if pause is not None), default=None)


def refusal(command: ChangePattern, error: EditError) -> EditRefused:
    """The event that says why a change can't be made."""
    return EditRefused(command.ticket, error.place, error.message, error.remedy)


class HeldBack:
    """A drag's edits, which are only to be shown: more of them come than frames can show, and each takes time to work
    out. The newest one waits until those before it have taken no more than HELD_SHARE of the time, and while one is
    being worked out beside the simulation; others are dropped.
    """

    def __init__(self) -> None:
        self._waits: ChangePattern | None = None
        self._due = -math.inf  # s

    def take(
        self, commands: Sequence[Command], take: Callable[[Command], None], clock: Callable[[], float], busy: bool
    ) -> None:
        """Take these commands in their order, and then the drag's newest edit, if it is time and not `busy` with
        another. Before an edit that is to be kept, which ends the drag, it is not shown any more."""
        for command in commands:
            held = isinstance(command, ChangePattern) and command.hold
            if isinstance(command, ChangePattern):
                self._waits = command if held else None
            if not held:
                take(command)
        begun = clock()
        if self._waits is not None and begun >= self._due and not busy:
            newest, self._waits = self._waits, None
            take(newest)
            self._due = begun + (clock() - begun) / HELD_SHARE

    def wait(self, longest: float | None, now: float, busy: bool) -> float | None:
        """For how long nothing is to be done here, if not for longer than this [s]; None: for ever."""
        if self._waits is None and not busy:
            return longest
        left = LOOK_SECONDS if busy else max(self._due - now, 0.0)
        return left if longest is None else min(longest, left)
