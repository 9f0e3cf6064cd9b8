"""The part of a session that has to do with changes of the pattern: takes them, and answers who asked."""

from __future__ import annotations

from collections.abc import Sequence, Set

from tryon_protocol import ChangeStatus, EditedMessage, EditMessage, ProtocolError, RedoMessage, UndoMessage, encode
from tryon_server.sessions.actions import Action, Answer, Keep, KeepWaiting, Order, Send
from tryon_server.sessions.commands import ChangeEffect, ChangePattern, GiveUp
from tryon_server.sessions.effect_talk import EffectTalk
from tryon_server.sessions.events import EditMade
from tryon_server.sessions.pattern_changes import NOBODY, Asker, PatternChanges
from tryon_server.sessions.rules import check_fabric
from tryon_server.sessions.turns import Turns
from tryon_server.sessions.viewer import Viewer


class PatternTalk(Turns):
    """What a session does with changes of the pattern; the session has these."""

    effects: EffectTalk
    _changes: PatternChanges
    _ended: bool
    _on_the_way: dict[str, set[int]]  # numbers of edits, by garment

    @property
    def dressed(self) -> bool:
        """Is anything worn, or was?"""
        raise NotImplementedError

    def change_pattern(self, command: ChangePattern, now: float) -> tuple[int, list[Action]]:
        """Somebody without a connection asks for a change; the ticket that `Answer` will have, and what is to be done.

        Raises ProtocolError: too many wait, or there is no such fabric."""
        check_fabric(command.edit, self._rules.fabrics)
        return self._changes.ask(Asker(NOBODY), command, self.dressed, now)

    def give_up(self, ticket: int, now: float) -> list[Action]:
        """The change with this ticket, of the pattern or of what is worn, is wanted no more; `Answer` tells whether
        that came in time."""
        if self._changes.is_ordered(ticket):
            return [Order(GiveUp(ticket))]
        fault = ProtocolError("edit_refused", "$", "It was given up before it was worn.", "Ask for it again.")
        return self._refuse_edit(ticket, fault, now)

    def status_of_change(self, ticket: int) -> ChangeStatus | None:
        """What is done for the change of the pattern with this ticket; None of one that is answered."""
        return self._changes.status_of(ticket)

    def begin_with_changes(self, commands: Sequence[ChangePattern | ChangeEffect], now: float) -> list[Action]:
        """Changes that waited in an earlier session are to be made in this one, once its garment is worn."""
        effects = [command for command in commands if isinstance(command, ChangeEffect)]
        edits = [command for command in commands if isinstance(command, ChangePattern)]
        asked = (self._changes.ask(Asker(NOBODY), command, False, now)[1] for command in edits)
        return [*(action for actions in asked for action in actions), *self.effects.begin_with(effects)]

    def kept(self, made: EditMade, fault: ProtocolError | None, now: float) -> list[Action]:
        """A change of the pattern has been stored, or why it could not be."""
        return self._answer_edit(made.ticket, fault or made, now)

    def on_the_way(self, garment: str) -> Set[int]:
        """Numbers of the edits that were made, taken back or made again, and that the garment of this name, which is
        worn, has not taken on yet."""
        return self._on_the_way.get(garment, set())

    def _made(self, made: EditMade) -> list[Action]:
        """A change of the pattern is worn, and is to be stored."""
        self._on_the_way.setdefault(made.garment, set()).add(made.id)
        return [Keep(made)]

    def _edit(
        self, client: int, viewer: Viewer, message: EditMessage | UndoMessage | RedoMessage, now: float
    ) -> list[Action]:
        try:
            if isinstance(message, EditMessage):
                check_fabric(message.edit, self._rules.fabrics)
            return self._changes.asked(client, message, self.dressed, now)
        except ProtocolError as fault:
            return self._answer_fault(client, viewer, fault, message.request, now)

    def _refuse_edit(self, ticket: int, fault: ProtocolError, now: float) -> list[Action]:
        """A change can't be made: it waits no more."""
        return [*([KeepWaiting(ticket, None)] if ticket > 0 else []), *self._answer_edit(ticket, fault, now)]

    def _answer_edit(self, ticket: int, outcome: EditMade | ProtocolError, now: float) -> list[Action]:
        """Tell whoever asked for a change of the pattern how it ended."""
        asker = self._changes.answered(ticket, outcome if isinstance(outcome, ProtocolError) else None)
        if asker is None or self._ended:
            return []
        if asker.client == NOBODY:
            return [Answer(ticket, outcome)]
        viewer = self._viewers.get(asker.client)
        if viewer is None:
            return []
        if isinstance(outcome, ProtocolError):
            return self._answer_fault(asker.client, viewer, outcome, asker.request, now)
        edited = EditedMessage(id=outcome.last, change=outcome.change, request=asker.request)
        return [Send(asker.client, encode(edited))]
