"""What is asked of a session's effects, by whom, and what there is to say of them.

What is asked for before the garment is worn is kept, and ordered once it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from msgspec import structs

from tryon_protocol import (
    AUTO,
    EffectsMessage,
    KeptEffect,
    MeasureEffectsMessage,
    ProtocolError,
    RemoveEffectMessage,
    SetEffectMessage,
    encode,
    error_message,
)
from tryon_server.sessions.actions import Action, AnswerEffects, KeepEffects, KeepWaiting, Order, Send
from tryon_server.sessions.commands import ChangeEffect, MeasureEffects
from tryon_server.sessions.events import EffectRefused, EffectsTold
from tryon_server.sessions.pattern_changes import NOBODY, Asker

MOST_WAITING = 32  # that are not answered yet; each may take the simulation seconds of compiling
LONGEST_NAME = 80  # of an effect that there is none of, as it is told

NOBODY_ASKS = Asker(NOBODY)
EffectQuestion = SetEffectMessage | RemoveEffectMessage | MeasureEffectsMessage


class EffectTalk:
    """Numbers what is asked, remembers who waits for which, and what was told last.

    Args:
        names: of all effects that there are.
        new_ticket: gives a number that nothing else that is asked of the session has.
        tell_all: what is to be done for all clients to be told.
    """

    def __init__(
        self,
        names: Sequence[str],
        new_ticket: Callable[[], int],
        tell_all: Callable[[EffectsMessage], list[Action]],
    ) -> None:
        self.newest: EffectsMessage | None = None
        self.dressed = False
        self._names = (*names, AUTO)
        self._new_ticket, self._tell_all = new_ticket, tell_all
        self._wishes: Mapping[str, Any] = {}
        self._waiting: dict[int, Asker] = {}
        self._kept: dict[str, ChangeEffect] = {}  # asked for before the garment was worn and not answered yet, by name
        self._earlier: dict[str, list[ChangeEffect]] = {}  # what was asked before these, should they be refused
        self._refused: dict[str, KeptEffect] = {}  # of these, what the garment can't have

    def obey(self, client: int, message: EffectQuestion) -> list[Action]:
        """A client asks. Raises ProtocolError where that can't be, as `change` does."""
        asker = Asker(client, message.request)
        match message:
            case SetEffectMessage():
                _, actions = self.change(message.name, message.state, message.parameters, asker)
            case RemoveEffectMessage():
                _, actions = self.change(message.name, "absent", None, asker)
            case MeasureEffectsMessage():
                _, actions = self.measure(asker)
        return actions

    def change(
        self,
        name: str,
        state: Literal["absent", "armed", "active"],
        parameters: Mapping[str, Any] | None,
        asker: Asker = NOBODY_ASKS,
    ) -> tuple[int, list[Action]]:
        """Somebody asks for an effect in this state; the ticket of the answer, and what is to be done: at once, or,
        where nothing is dressed yet, once that is. That it is kept for then is the answer.

        Raises:
            ProtocolError: too much is asked, or with what is no number whatever is worn, or, of what is to be kept,
                there is no such effect.
        """
        _check_finite(parameters, "$.parameters")
        if not self.dressed:
            return self._keep(ChangeEffect(0, name, state, parameters), asker)
        ticket = self._ticket(asker)
        self._refused.pop(name, None)
        return ticket, [Order(ChangeEffect(ticket, name, state, parameters))]

    def begin_with(self, commands: Sequence[ChangeEffect]) -> list[Action]:
        """What was kept in an earlier session is asked for in this one, once its garment is worn."""
        return [action for command in commands for action in self._keep(command, NOBODY_ASKS)[1]]

    def _keep(self, asked: ChangeEffect, asker: Asker) -> tuple[int, list[Action]]:
        """Keep what is asked until the garment is worn, in the place of what was asked of the same effect before: that
        is asked for again should the garment refuse it, since what is refused changes nothing."""
        if asked.name not in self._names:
            what, remedy = f"There is no effect {asked.name[:LONGEST_NAME]!r}.", f"Use one of {', '.join(self._names)}."
            raise ProtocolError("effect_refused", "$.name", what, remedy)
        before = self._kept.get(asked.name)
        if len(self._kept) + sum(map(len, self._earlier.values())) >= MOST_WAITING:
            raise _too_many()
        if before is not None:
            self._earlier.setdefault(asked.name, []).append(before)
        actions = [] if before is None else self._forget(before)
        parameters = before.parameters if before is not None and asked.parameters is None else asked.parameters
        command = replace(asked, ticket=self._new_ticket(), parameters=parameters)
        self._kept[command.name] = command
        self._waiting[command.ticket] = asker
        told, actions = self._tell_kept(), [*actions, KeepWaiting(command.ticket, command)]
        assert self.newest is not None
        answer = [AnswerEffects(command.ticket, self.newest)] if asker.client == NOBODY else []
        return command.ticket, [*actions, *told, *answer]

    def _forget(self, command: ChangeEffect) -> list[Action]:
        """This is kept no longer."""
        del self._kept[command.name]
        self._waiting.pop(command.ticket, None)
        return [KeepWaiting(command.ticket, None)]

    def _tell_kept(self) -> list[Action]:
        """All are told what is kept."""
        waiting = (KeptEffect(name=one.name, state=one.state, parameters=_plain(one)) for one in self._kept.values())
        kept = (*waiting, *self._refused.values())
        self.newest = structs.replace(self.newest or EffectsMessage(effects=()), kept=kept)
        return self._tell_all(self.newest)

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
        for command in [one for one in self._kept.values() if one.ticket in event.answers]:
            actions += self._forget(command)
            self._earlier.pop(command.name, None)
        actions += self._tell_kept()
        askers = [(ticket, self._waiting.pop(ticket, None)) for ticket in event.answers]
        answers = [AnswerEffects(ticket, self.newest) for ticket, asker in askers if asker and asker.client == NOBODY]
        ordered = [] if self.dressed else [Order(command) for command in self._kept.values()]
        self.dressed = True
        return [*actions, *answers, *ordered]

    def refused(self, event: EffectRefused) -> list[Action]:
        """The simulation refuses what somebody asked."""
        asker = self._waiting.pop(event.ticket, None)
        place = f"$.{event.place}" if event.place else "$"
        fault = ProtocolError("effect_refused", place, f"{event.message.rstrip('.')}.", f"{event.remedy.rstrip('.')}.")
        actions: list[Action] = []
        kept = next((one for one in self._kept.values() if one.ticket == event.ticket), None)
        if kept is not None:  # who asked may not have waited
            said = f"{fault.message} {fault.remedy}"
            refused = KeptEffect(name=kept.name, state=kept.state, parameters=_plain(kept), refused=said)
            self._refused[kept.name] = refused
            actions += self._forget(kept)
            if earlier := self._earlier.get(kept.name):
                command = self._kept[kept.name] = replace(earlier.pop(), ticket=self._new_ticket())
                actions += [KeepWaiting(command.ticket, command), Order(command)]
            actions += self._tell_kept()
        if asker is None:
            return actions
        if asker.client == NOBODY:
            return [*actions, AnswerEffects(event.ticket, fault)]
        return [*actions, Send(asker.client, encode(error_message(fault, request=asker.request)))]

    def _ticket(self, asker: Asker) -> int:
        if not self.dressed:
            what = "The garment is still being dressed, so what its effects take can't be measured yet."
            raise ProtocolError("unexpected_message", "$", what, "Wait for `effects` that are not `kept`.")
        if len(self._waiting) >= MOST_WAITING:
            raise _too_many()
        ticket = self._new_ticket()
        self._waiting[ticket] = asker
        return ticket


def _check_finite(value: Any, place: str) -> None:
    """Raises ProtocolError for the first number of plain JSON that is not finite, at this place or below it."""
    if isinstance(value, Mapping):
        for name, below in value.items():
            _check_finite(below, f"{place}.{name[:LONGEST_NAME]}")
    elif isinstance(value, Sequence) and not isinstance(value, str | bytes):
        for k, below in enumerate(value):
            _check_finite(below, f"{place}[{k}]")
    elif isinstance(value, float) and not math.isfinite(value):
        raise ProtocolError("effect_refused", place, f"It is {value}, not a finite number.", "Send a finite one.")


def _too_many() -> ProtocolError:
    what = f"{MOST_WAITING} changes of effects wait to be made; this one was not used."
    return ProtocolError("rate_limited", "$", what, "Wait for `effects`.")


def _plain(command: ChangeEffect) -> dict[str, Any] | None:
    """Its parameters as they are told."""
    return None if command.parameters is None else dict(command.parameters)
