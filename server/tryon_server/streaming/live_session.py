"""One live session: carries out what its state machine asks for, between clients and simulation."""

from __future__ import annotations

import asyncio
import itertools
import logging
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from typing import Any, TypeVar

from tryon_protocol import EffectsMessage, OutfitWish, ProtocolError
from tryon_server.runtime.interface import Simulation
from tryon_server.sessions import Action, Close, End, Order, Send, SendFrame, WardrobeSession
from tryon_server.sessions.actions import (
    POLICY_VIOLATION,
    Answer,
    AnswerEffects,
    ChangeWorn,
    Keep,
    KeepEffects,
    KeepWaiting,
)
from tryon_server.sessions.commands import BuyAccuracy, ChangeEffect, ChangePattern, Command, WornItem
from tryon_server.sessions.effect_talk import EffectTalk
from tryon_server.sessions.events import EditMade, Event, OutfitWorn, PhaseChanged, Troubled
from tryon_server.streaming.outbox import Outbox, OutboxFullError

logger = logging.getLogger(__name__)

MOST_IN_LINE = 8  # changes of what is worn that wait for their turn: each takes seconds

TICK_SECONDS = 0.1

Answered = TypeVar("Answered")


class LiveSession:
    """A session machine with its connections and its simulation. All methods belong to the event loop's thread.

    Args:
        machine: the session.
        start_simulation: starts it; is given the function that takes its events, which may be called from any thread.
        on_end: called once, with the reason, when the session has ended.
        complete: adds to a command for the simulation what the machine does not know, such as where a file is.
        keep: stores a change of the pattern, of the garment of this number, if it has one; blocking. Raises what the
            store raises.
        keep_effects: stores what is asked of the effects, likewise.
        keep_waiting: stores that the change of this ticket waits to be made; for None, that it does no more; likewise.
        wear: has what a client wants to wear worn and kept, and tells it by `tell_outfit`. Raises ProtocolError.
    """

    def __init__(
        self,
        machine: WardrobeSession,
        start_simulation: Callable[[Callable[[Event], None]], Simulation],
        on_end: Callable[[LiveSession, str], None],
        complete: Callable[[Command], Command] = lambda command: command,
        keep: Callable[[EditMade, int | None], None] = lambda _made, _number: None,
        keep_effects: Callable[[Mapping[str, Any]], None] = lambda _wishes: None,
        keep_waiting: Callable[[int, ChangePattern | ChangeEffect | None], None] = lambda _ticket, _change: None,
        wear: Callable[[int, OutfitWish], Awaitable[None]] | None = None,
    ) -> None:
        self.machine = machine
        self._complete = complete
        self._keep = keep
        self._keep_effects = keep_effects
        self._keep_waiting = keep_waiting
        self._wear = wear
        self._wearing: set[asyncio.Task[None]] = set()
        self._turn, self._in_line = asyncio.Lock(), 0  # of who changes what is worn, and how many wait for theirs
        self._first: asyncio.Future[None] | None = None  # who has the turn waits for something to be worn
        self._keeping: asyncio.Task[None] | None = None
        self._not_kept: ProtocolError | None = None  # why the last change that waits could not be stored
        self._asked: dict[int, asyncio.Future[Any]] = {}  # of what was made, by ticket
        self._asked_effects: dict[int, asyncio.Future[EffectsMessage]] = {}
        self._on_end = on_end
        self._outboxes: dict[int, Outbox] = {}
        self._numbers = itertools.count(1)
        self._last_detail = ""
        self._loop = asyncio.get_running_loop()
        self._simulation = start_simulation(self._event_from_thread)
        self._ticking = self._loop.create_task(self._tick())

    @property
    def now(self) -> float:
        """The steady clock of the session [s]."""
        return time.monotonic()  # the simulations' clock too: frames say when they were published on it

    def connect(self) -> tuple[int, Outbox]:
        """A new connection; its number and what is to be sent to it."""
        client, outbox = next(self._numbers), Outbox()
        self._outboxes[client] = outbox
        self._carry_out(self.machine.connect(client, self.now))
        return client, outbox

    def receive(self, client: int, data: bytes) -> None:
        """A binary message arrived."""
        self._carry_out(self.machine.receive(client, data, self.now))

    def receive_text(self, client: int) -> None:
        """A text message arrived."""
        self._carry_out(self.machine.receive_text(client, self.now))

    def change_pattern(self, command: ChangePattern) -> tuple[int, asyncio.Future[EditMade]]:
        """Change the pattern for somebody without a connection: the ticket of that, and what was made, once it is kept.
        Where nothing is worn yet it waits for that. That it waits is kept (`stored`).

        Raises:
            ProtocolError: it was refused, or not now; of the future, too.
        """
        ticket, actions = self.machine.change_pattern(command, self.now)
        asked: asyncio.Future[EditMade] = self._loop.create_future()
        self._asked[ticket] = asked
        self._carry_out(actions)
        return ticket, asked

    def give_up(self, ticket: int) -> None:
        """The change of the pattern, or of what is worn, with this ticket is wanted no more; who waits for it is told
        whether that came in time."""
        self._carry_out(self.machine.give_up(ticket, self.now))

    def begin_with_changes(self, commands: Sequence[ChangePattern | ChangeEffect]) -> None:
        """Make these, which waited in an earlier session, once the garment is worn."""
        self._carry_out(self.machine.begin_with_changes(commands, self.now))

    async def stored(self) -> None:
        """Returns once all is stored that was to be. Raises ProtocolError where a change that waits could not be."""
        if self._keeping is not None:
            await self._keeping
        if self._not_kept is not None:
            raise self._not_kept

    async def ask_effects(self, ask: Callable[[EffectTalk], tuple[int, list[Action]]]) -> EffectsMessage:
        """Ask something of the effects for somebody without a connection; the effects once that is done. Where nothing
        is worn yet it waits for that, and that it does is kept.

        Raises:
            ProtocolError: it was refused, or not now.
        """
        dressed = self.machine.effects.dressed
        ticket, actions = ask(self.machine.effects)
        asked = self._asked_effects[ticket] = self._loop.create_future()
        self._carry_out(actions)
        if not dressed:
            await self.stored()
        return await asked

    @asynccontextmanager
    async def in_turn(self) -> AsyncIterator[None]:
        """Who changes what is worn does it in here: one after the other in the order in which they ask, once anything
        is worn.

        Raises ProtocolError where nothing comes to be worn, or too much waits.
        """
        if self._in_line >= MOST_IN_LINE:
            what = f"{MOST_IN_LINE} changes of what is worn wait to be made; this one was not used."
            raise ProtocolError("rate_limited", "$", what, "Wait until one of them is worn.")
        self._in_line += 1
        try:
            await self._turn.acquire()
        finally:
            self._in_line -= 1
        try:
            if not self.machine.dressed:
                self._first = self._loop.create_future()
                await self._first
            yield
        finally:
            self._turn.release()

    def _something_is_worn(self, event: Event) -> None:
        """Let go on who waits for that; or tell why it is not."""
        if self.machine.dressed:
            _answer(self._first, None)
        elif isinstance(event, PhaseChanged) and event.phase == "failed":
            what = f"Nothing is worn that it could be worn with: {event.detail}"
            _answer(self._first, ProtocolError("outfit_refused", "$", what, "Open a session with another garment."))

    async def change_outfit(
        self, items: Sequence[WornItem], edited: str, order: Any, ticket: int | None = None
    ) -> tuple[str, ...]:
        """Wear these garments, and edit the one of this name; returns once they are worn, with the names of those that
        were taken off for it and put on again. It is given up by its ``ticket``, if it is told one.

        Raises:
            ProtocolError: they can't be worn so, or not now; what was worn is worn on.
        """
        ticket, actions = self.machine.change_outfit(items, edited, order, ticket)
        asked: asyncio.Future[OutfitWorn] = self._loop.create_future()
        self._asked[ticket] = asked
        self._carry_out(actions)
        return (await asked).again

    def tell_outfit(
        self,
        items: Sequence[WornItem],
        edited: str,
        again: Sequence[str],
        client: int | None = None,
        request: int | None = None,
    ) -> None:
        """These garments are worn and kept, those of the names ``again`` were put on again for it; that client asked
        for them, if one did."""
        self._carry_out(self.machine.outfit_changed(items, edited, again, client, request))

    async def _wear_for(self, client: int, wish: OutfitWish) -> None:
        """Wear what a client asks for; it is told how that ended."""
        assert self._wear is not None
        try:
            async with self.in_turn():
                await self._wear(client, wish)
        except ProtocolError as fault:
            self._carry_out(self.machine.outfit_refused(client, wish.request, fault, self.now))
        except Exception as error:
            logger.exception("session %s: an outfit could not be changed", self.machine.id)
            what = f"What is worn could not be changed or stored: {error!r:.200}."
            failed = ProtocolError("outfit_refused", "$", what, "Ask what is worn, then try it again.")
            self._carry_out(self.machine.outfit_refused(client, wish.request, failed, self.now))

    def buy(self, wanted: BuyAccuracy) -> None:
        """Have frames solved so from now on, for somebody without a connection. Raises ProtocolError where there is no
        such preset."""
        self._carry_out(self.machine.buy(wanted, self.now))

    def disconnect(self, client: int, left: bool = False) -> None:
        """A connection has ended; ``left``: the client closed it in good order."""
        self._outboxes.pop(client, None)
        self._carry_out(self.machine.disconnect(client, self.now, left))

    def end(self, reason: str, retry_after: float | None = None) -> None:
        """End the session; clients are told why, and after how long [s] to come back if at all."""
        self._carry_out(self.machine.end(reason, retry_after))

    def _event_from_thread(self, event: Event) -> None:
        try:
            self._loop.call_soon_threadsafe(self._simulated, event)
        except RuntimeError:  # the loop has closed: the server is gone, and nobody is left to tell
            logger.debug("an event of session %s came after the server's end", self.machine.id)

    def _simulated(self, event: Event) -> None:
        if isinstance(event, PhaseChanged) and event.detail != self._last_detail:
            self._last_detail = event.detail
            logger.info("session %s: %s", self.machine.id, event.detail)
        elif isinstance(event, Troubled):
            logger.warning("session %s: %s %s", self.machine.id, event.message, event.remedy)
        self._carry_out(self.machine.simulated(event, self.now))
        self._something_is_worn(event)

    async def _tick(self) -> None:
        while not self.machine.ended:
            await asyncio.sleep(TICK_SECONDS)
            if self._first is not None and not self._first.done():
                self.machine.asked_for(self.now)  # who waits for it may have no connection
            self._carry_out(self.machine.tick(self.now))

    def _carry_out(self, actions: list[Action]) -> None:
        overflowed: list[int] = []
        for action in actions:
            match action:
                case Send(client, payload, replaces):
                    if client in self._outboxes and client not in overflowed:
                        try:
                            self._outboxes[client].put_control(payload, replaces)
                        except OutboxFullError as error:
                            logger.warning("session %s: client %d reads nothing: %s", self.machine.id, client, error)
                            overflowed.append(client)
                case SendFrame(client, payload, stands_alone):
                    if client in self._outboxes:
                        self._outboxes[client].put_frame(payload, stands_alone)
                case Close(client, code, reason):
                    if client in self._outboxes:
                        self._outboxes[client].close(code, reason)
                case Order(command):
                    self._simulation.order(self._complete(command))
                case Keep(made):
                    number = self.machine.number_of(made.garment)  # now: the name may be another's once it is stored
                    self._keeping = self._loop.create_task(self._keep_after(self._keeping, made, number))
                case KeepWaiting():
                    self._keeping = self._loop.create_task(self._keep_waiting_after(self._keeping, action))
                case ChangeWorn(client, wish):
                    wearing = self._loop.create_task(self._wear_for(client, wish))
                    self._wearing.add(wearing)
                    wearing.add_done_callback(self._wearing.discard)
                case KeepEffects(wishes):
                    self._keeping = self._loop.create_task(self._keep_effects_after(self._keeping, wishes))
                case Answer(ticket, outcome):
                    _answer(self._asked.pop(ticket, None), outcome)
                case AnswerEffects(ticket, told):
                    _answer(self._asked_effects.pop(ticket, None), told)
                case End(reason):
                    self._simulation.stop()
                    fault = ProtocolError("unknown_session", "$", f"{reason}.", "Open a new session.")
                    for change in self._asked.values():
                        _answer(change, fault)
                    for effect in self._asked_effects.values():
                        _answer(effect, fault)
                    _answer(self._first, fault)
                    self._asked.clear()
                    self._asked_effects.clear()
                    self._on_end(self, reason)
        for client in overflowed:
            self._outboxes.pop(client).overflow(POLICY_VIOLATION, "The client reads nothing")
            self._carry_out(self.machine.disconnect(client, self.now))

    async def _keep_after(self, before: asyncio.Task[None] | None, made: EditMade, number: int | None) -> None:
        """Store a change of the pattern of the garment of this number, after the one before, and say so."""
        if before is not None:
            await before
        fault = None
        try:
            await asyncio.to_thread(self._keep, made, number)
        except Exception as error:
            logger.exception("session %s: an edit could not be stored", self.machine.id)
            what = f"The edit is made, but could not be stored: {error!r:.200}."
            fault = ProtocolError("edit_not_kept", "$", what, "Make room on its disk, then undo and repeat the edit.")
        self._carry_out(self.machine.kept(made, fault, self.now))

    async def _keep_waiting_after(self, before: asyncio.Task[None] | None, action: KeepWaiting) -> None:
        """Store that a change waits, or waits no more, after what was to be stored before."""
        if before is not None:
            await before
        try:
            await asyncio.to_thread(self._keep_waiting, action.ticket, action.change)
            self._not_kept = None
        except Exception as error:
            logger.exception("session %s: a change that waits could not be stored", self.machine.id)
            what = f"What was asked for waits to be made, but could not be stored: {error!r:.200}."
            remedy = "Make room on its disk; where the server ends before it is made, ask for it again."
            self._not_kept = ProtocolError("edit_not_kept", "$", what, remedy)

    async def _keep_effects_after(self, before: asyncio.Task[None] | None, wishes: Mapping[str, Any]) -> None:
        """Store what is asked of the effects, after what was to be stored before."""
        if before is not None:
            await before
        try:
            await asyncio.to_thread(self._keep_effects, wishes)
        except Exception as error:
            logger.exception("session %s: what is asked of its effects could not be stored", self.machine.id)
            what = f"The effects are changed, but that could not be stored: {error!r:.200}."
            self._simulated(Troubled("effects_not_kept", "$", what, "Make room on its disk, then change them again."))


def _answer(asked: asyncio.Future[Answered] | None, outcome: Answered | ProtocolError) -> None:
    """Give whoever asked what came of it, unless it has gone."""
    if asked is None or asked.done():
        return
    if isinstance(outcome, ProtocolError):
        asked.set_exception(outcome)
    else:
        asked.set_result(outcome)
