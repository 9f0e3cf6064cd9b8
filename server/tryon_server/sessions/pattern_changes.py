"""Changes of the pattern that are under way: who asked for which, and whose hand is on the pattern."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tryon_protocol import EditMessage, ProtocolError, RedoMessage, UndoMessage
from tryon_server.sessions.commands import HELD, ChangePattern, EditStep

NOBODY = 0  # in place of a client's number, for who asks without a connection
MOST_WAITING = 32  # changes that are to be kept and are not answered yet; each takes the simulation some 0.1 s


@dataclass(frozen=True)
class Asker:
    """Who asked for a change: a client, or `NOBODY`, and its number for the command."""

    client: int
    request: int | None = None


class PatternChanges:
    """Numbers the changes, and remembers who waits for which."""

    def __init__(self) -> None:
        self._tickets = itertools.count(HELD + 1)
        self._waiting: dict[int, Asker] = {}
        self._holder: int | None = None

    @property
    def under_way(self) -> bool:
        """Is a change that is to be kept not answered yet?"""
        return bool(self._waiting)

    def asked(self, client: int, message: EditMessage | UndoMessage | RedoMessage, dressed: bool) -> ChangePattern:
        """The command for what a client asks. Raises ProtocolError as `ask`."""
        asker = Asker(client, message.request)
        match message:
            case EditMessage(hold=True):
                refuse_before(dressed)
                return self._hold(client, message.edit, message.mirror, message.garment)
            case EditMessage():
                return self.ask(asker, "edit", message.edit, message.mirror, dressed, message.garment)
            case UndoMessage():
                return self.ask(asker, "undo", None, False, dressed, message.garment)
            case RedoMessage():
                return self.ask(asker, "redo", None, False, dressed, message.garment)

    def ask(
        self,
        asker: Asker,
        step: EditStep,
        edit: Mapping[str, Any] | None,
        mirror: bool,
        dressed: bool,
        garment: str = "",
    ) -> ChangePattern:
        """The command for a change that is to be kept. What is held is shown no longer then.

        Raises:
            ProtocolError: nothing is ``dressed`` yet, too many changes wait already, or there is no edit.
        """
        refuse_before(dressed)
        if step == "edit" and edit is None:
            what = "There is no edit to keep."
            raise ProtocolError("invalid_field", "$.edit", what, "Send an edit, or `hold` to show what is kept.")
        if len(self._waiting) >= MOST_WAITING:
            what = f"{MOST_WAITING} edits wait to be made; this one was not used."
            raise ProtocolError("rate_limited", "$", what, "Wait for `edited`; send `hold` during a drag.")
        self._holder = None
        ticket = next(self._tickets)
        self._waiting[ticket] = asker
        return ChangePattern(step, ticket, edit, mirror, garment=garment)

    def _hold(
        self, client: int, edit: Mapping[str, Any] | None, mirror: bool, garment: str = ""
    ) -> ChangePattern:
        self._holder = None if edit is None else client
        return ChangePattern("edit", HELD, edit, mirror, hold=True, garment=garment)

    def new_ticket(self) -> int:
        """A number that no change has had, for one of another kind."""
        return next(self._tickets)

    def left(self, client: int) -> ChangePattern | None:
        """A client has left: the command that drops what it held, if it did."""
        return self._hold(client, None, mirror=False) if client == self._holder else None

    def answered(self, ticket: int) -> Asker | None:
        """Who waits for the change of this ticket, and then no more; who holds, for `HELD`."""
        if ticket == HELD:
            return None if self._holder is None else Asker(self._holder)
        return self._waiting.pop(ticket, None)


def refuse_before(dressed: bool) -> None:
    """Raises ProtocolError where nothing is dressed yet."""
    if not dressed:
        what = "The garment is still being dressed, so it can't be edited yet."
        raise ProtocolError("unexpected_message", "$", what, "Wait for `design`.")
