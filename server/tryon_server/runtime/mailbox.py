"""Commands on their way to a simulation that may be too busy to read: of each kind only the newest is kept, but all
edits that are to be kept, all that are given up and all that is asked of effects, of which a session lets only so many
wait."""

from __future__ import annotations

import threading
from collections.abc import Hashable

from tryon_server.sessions.commands import ChangeEffect, ChangePattern, Command, GiveUp, MeasureEffects


class Mailbox:
    """Never blocks who puts and never grows: an unread command gives way to the next of its kind."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._waiting: dict[Hashable, Command] = {}
        self._closed = False

    def put(self, command: Command) -> None:
        """Leave a command. An untaken one of the same kind is replaced; the order is that of last arrival."""
        with self._changed:
            kind = kind_of(command)
            self._waiting.pop(kind, None)
            self._waiting[kind] = command
            self._changed.notify()

    def take(self) -> list[Command]:
        """Wait for commands and take all of them; an empty list once the box is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closed)
            if self._closed:
                return []
            commands = list(self._waiting.values())
            self._waiting.clear()
            return commands

    def close(self) -> None:
        """Let whoever waits go."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()


def kind_of(command: Command) -> Hashable:
    """Commands of one kind give way to each other."""
    if isinstance(command, ChangePattern) and not command.hold:
        return command.ticket
    if isinstance(command, ChangeEffect | MeasureEffects):
        return "effects", command.ticket
    if isinstance(command, GiveUp):
        return "give up", command.ticket
    return type(command).__name__
