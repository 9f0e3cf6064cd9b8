"""What is asked of a session's effects, by whom, and what there is to say of them."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any, Literal

from tryon_protocol import (
    EffectsMessage,
    MeasureEffectsMessage,
    ProtocolError,
    RemoveEffectMessage,
    SetEffectMessage,
    encode,
    error_message,
)
from tryon_server.sessions.actions import Action, AnswerEffects, KeepEffects, Order, Send
from tryon_server.sessions.commands import ChangeEffect, MeasureEffects
from tryon_server.sessions.events import EffectRefused, EffectsTold
from tryon_server.sessions.pattern_changes import NOBODY, Asker

MOST_WAITING = 32  # that are not answered yet; each may take the simulation seconds of compiling

NOBODY_ASKS = Asker(NOBODY)
EffectQuestion = SetEffectMessage | RemoveEffectMessage | MeasureEffectsMessage


class EffectTalk:
    """Numbers what is asked, remembers who waits for which, and what was told last."""

    def __init__(self) -> None:
        self.newest: EffectsMessage | None = None
        self._wishes: Mapping[str, Any] = {}
        self._tickets = itertools.count(1)
        self._waiting: dict[int, Asker] = {}

    def obey(self, client: int, message: EffectQuestion) -> list[Action]:
        """A client asks."""
        asker = Asker(client, message.request)
        try:
            match message:
                case SetEffectMessage():
                    _, actions = self.change(message.name, message.state, message.parameters, asker)
                case RemoveEffectMessage():
                    _, actions = self.change(message.name, "absent", None, asker)
                case MeasureEffectsMessage():
                    _, actions = self.measure(asker)
        except ProtocolError as fault:
            return [Send(client, encode(error_message(fault, request=message.request)))]
        return actions

    def change(
        self,
        name: str,
        state: Literal["absent", "armed", "active"],
        parameters: Mapping[str, Any] | None,
        asker: Asker = NOBODY_ASKS,
    ) -> tuple[int, list[Action]]:
        """Somebody asks for an effect in this state; the ticket of the answer, and what is to be done.

        Raises:
            ProtocolError: nothing is dressed yet, or too much is asked.
        """
        ticket = self._ticket(asker)
        return ticket, [Order(ChangeEffect(ticket, name, state, parameters))]

    def measure(self, asker: Asker = NOBODY_ASKS) -> tuple[int, list[Action]]:
        """Somebody asks what each effect takes; as `change`."""
        ticket = self._ticket(asker)
        return ticket, [Order(MeasureEffects(ticket))]

    def told(self, event: EffectsTold) -> list[Action]:
        """The simulation tells of its effects: who waits for that is answered, and what is new of it kept."""
        actions: list[Action] = []
        if event.wishes != self._wishes:
            actions.append(KeepEffects(event.wishes))
        self.newest, self._wishes = event.effects, event.wishes
        askers = [(ticket, self._waiting.pop(ticket, None)) for ticket in event.answers]
        answers = [AnswerEffects(ticket, event.effects) for ticket, asker in askers if asker and asker.client == NOBODY]
        return [*actions, *answers]

    def refused(self, event: EffectRefused) -> list[Action]:
        """The simulation refuses what somebody asked."""
        asker = self._waiting.pop(event.ticket, None)
        place = f"$.{event.place}" if event.place else "$"
        fault = ProtocolError("effect_refused", place, f"{event.message.rstrip('.')}.", f"{event.remedy.rstrip('.')}.")
        if asker is None:
            return []
        if asker.client == NOBODY:
            return [AnswerEffects(event.ticket, fault)]
        return [Send(asker.client, encode(error_message(fault, request=asker.request)))]

    def _ticket(self, asker: Asker) -> int:
        if self.newest is None:
            what = "The garment is still being dressed, so its effects can't be asked for yet."
            raise ProtocolError("unexpected_message", "$", what, "Wait for `effects`.")
        if len(self._waiting) >= MOST_WAITING:
            what = f"{MOST_WAITING} changes of effects wait to be made; this one was not used."
            raise ProtocolError("rate_limited", "$", what, "Wait for `effects`.")
        ticket = next(self._tickets)
        self._waiting[ticket] = asker
        return ticket
