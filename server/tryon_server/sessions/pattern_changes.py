"""Changes of the pattern that are under way: who asked for which, what is done for it, and who holds the pattern.

What is asked for before the garment is worn waits here, and is ordered once it is.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import msgspec

from tryon_protocol import ChangeStatus, EditMessage, ProtocolError, RedoMessage, UndoMessage
from tryon_server.sessions.actions import Action, KeepWaiting, Order
from tryon_server.sessions.commands import HELD, ChangePattern
from tryon_server.sessions.events import ChangeUnderWay

NOBODY = 0  # in place of a client's number, for who asks without a connection
MOST_WAITING = 32  # changes that are to be kept and are not answered yet; each takes the simulation some 0.1 s
MOST_REFUSED = 8  # refusals that nobody was told of, the last ones
LONGEST_NAME = 80  # of what an edit names, as it is told to all: nobody has looked into it yet
TO_BE_WORN = "Until the garment is worn"
OTHERS_FIRST = "Others are made first"


@dataclass(frozen=True)
class Asker:
    """Who asked for a change: a client, or `NOBODY`, and its number for the command."""

    client: int
    request: int | None = None


@dataclass(frozen=True)
class _Waiting:
    """A change that is not answered; `since` when it was asked for [s]; `ordered` of the simulation, or not yet;
    `held_by` who held an edit then, which is held on if this one is refused."""

    asker: Asker
    command: ChangePattern
    since: float
    ordered: bool
    held_by: Asker | None
    doing: ChangeUnderWay | None = None

    def status(self) -> ChangeStatus:
        edit = self.command.edit or {}
        doing = self.doing or ChangeUnderWay(0, "waiting", OTHERS_FIRST if self.ordered else TO_BE_WORN)
        return ChangeStatus(
            step=self.command.step,
            kind=str(edit.get("kind", ""))[:LONGEST_NAME],
            panel=str(edit.get("panel", ""))[:LONGEST_NAME],
            garment=self.command.garment,
            since=round(self.since, 3),
            doing=doing.doing,
            detail=doing.detail or OTHERS_FIRST,
            progress=doing.progress,
        )


class PatternChanges:
    """Numbers the changes, and remembers who waits for which."""

    def __init__(self) -> None:
        self._tickets = itertools.count(HELD + 1)
        self._waiting: dict[int, _Waiting] = {}
        self._refused: deque[ChangeStatus] = deque(maxlen=MOST_REFUSED)
        self._holder: Asker | None = None

    @property
    def under_way(self) -> bool:
        """Is a change that is to be kept not answered yet?"""
        return bool(self._waiting)

    @property
    def statuses(self) -> tuple[ChangeStatus, ...]:
        """What is done for each of them, in their order; after those that were refused and nobody was told."""
        return (*self._refused, *(one.status() for one in self._waiting.values()))

    def asked(
        self, client: int, message: EditMessage | UndoMessage | RedoMessage, dressed: bool, now: float
    ) -> list[Action]:
        """What is to be done for what a client asks. Raises ProtocolError as `ask`."""
        asker = Asker(client, message.request)
        match message:
            case EditMessage(hold=True):
                refuse_before(dressed)
                return [Order(self._hold(asker, message.edit, message.mirror, message.garment))]
            case EditMessage():
                command = ChangePattern("edit", HELD, message.edit, message.mirror, garment=message.garment)
            case UndoMessage():
                command = ChangePattern("undo", garment=message.garment)
            case RedoMessage():
                command = ChangePattern("redo", garment=message.garment)
        return self.ask(asker, command, dressed, now)[1]

    def ask(self, asker: Asker, command: ChangePattern, dressed: bool, now: float) -> tuple[int, list[Action]]:
        """The ticket that a change which is to be kept has, and what is to be done: at once, or, where nothing is
        ``dressed`` yet, once that is. What is held is shown no longer once it is made.

        Raises:
            ProtocolError: too many changes wait already, or there is no edit.
        """
        if command.step == "edit" and command.edit is None:
            what = "There is no edit to keep."
            raise ProtocolError("invalid_field", "$.edit", what, "Send an edit, or `hold` to show what is kept.")
        if len(self._waiting) >= MOST_WAITING:
            what = f"{MOST_WAITING} edits wait to be made; this one was not used."
            raise ProtocolError("rate_limited", "$", what, "Wait for `edited`; send `hold` during a drag.")
        numbered = replace(command, ticket=next(self._tickets))
        self._waiting[numbered.ticket] = _Waiting(asker, numbered, now, dressed, self._holder)
        self._holder = None
        kept = KeepWaiting(numbered.ticket, numbered)
        return numbered.ticket, [kept, Order(numbered)] if dressed else [kept]

    def dressed(self) -> list[Action]:
        """The garment is worn: what waited for that is ordered."""
        orders: list[Action] = []
        for ticket, one in self._waiting.items():
            if not one.ordered:
                self._waiting[ticket] = replace(one, ordered=True)
                orders.append(Order(one.command))
        return orders

    def is_ordered(self, ticket: int) -> bool:
        """Does the simulation know of the change with this ticket, or did it? Else it waits for the garment."""
        return ticket not in self._waiting or self._waiting[ticket].ordered

    def status_of(self, ticket: int) -> ChangeStatus | None:
        """What is done for the change with this ticket; None of one that is answered."""
        one = self._waiting.get(ticket)
        return None if one is None else one.status()

    def worked_at(self, changes: Sequence[ChangeUnderWay]) -> None:
        """The simulation told what it does for which."""
        doing = {change.ticket: change for change in changes}
        self._waiting = {ticket: replace(one, doing=doing.get(ticket)) for ticket, one in self._waiting.items()}

    def _hold(
        self, asker: Asker, edit: Mapping[str, Any] | None, mirror: bool, garment: str = ""
    ) -> ChangePattern:
        self._holder = None if edit is None else asker
        return ChangePattern("edit", HELD, edit, mirror, hold=True, garment=garment)

    def new_ticket(self) -> int:
        """A number that no change has had, for one of another kind."""
        return next(self._tickets)

    def left(self, client: int) -> ChangePattern | None:
        """A client has left: the command that drops what it held, if it did."""
        holders = (self._holder, *(one.held_by for one in self._waiting.values()))
        held = any(holder is not None and holder.client == client for holder in holders)
        return self._hold(Asker(client), None, mirror=False) if held else None

    def answered(self, ticket: int, refused: ProtocolError | None = None) -> Asker | None:
        """Who waits for the change of this ticket, and then no more; for `HELD`, who asked for the newest one. What was
        refused and asked for without a connection is listed on: who asked may not have waited for the answer."""
        if ticket == HELD:
            return self._holder
        one = self._waiting.pop(ticket, None)
        if one is None:
            return None
        if refused is not None and self._holder is None:
            self._holder = one.held_by
        if refused is not None and one.asker.client == NOBODY:
            said = f"{refused.message.rstrip('.')}. {refused.remedy.rstrip('.')}."
            self._refused.append(msgspec.structs.replace(one.status(), doing="refused", detail=said, progress=None))
        return one.asker


def refuse_before(dressed: bool) -> None:
    """Raises ProtocolError where nothing is dressed yet."""
    if not dressed:
        what = "The garment is still being dressed, so nothing can be held or changed of it yet."
        raise ProtocolError("unexpected_message", "$", what, "Wait for `design`.")
