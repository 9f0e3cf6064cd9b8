"""One change of what a session wears, from the wish for it to where it is worn and kept."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from tryon_protocol import OutfitWish, ProtocolError, PutOnMessage
from tryon_server.persistence import Waiting
from tryon_server.problems import ProblemError
from tryon_server.sessions.pattern_changes import OTHERS_FIRST, TO_BE_WORN
from tryon_server.streaming.jobs import BEING_KEPT, Progress
from tryon_server.streaming.live_session import LiveSession
from tryon_server.streaming.wardrobes import Changed

if TYPE_CHECKING:
    from tryon_server.streaming.live_sessions import LiveSessions

BEGUN = "It is begun, beside what is worn"


class OutfitChange:
    """Finds, orders and keeps what is wished for, of what is worn in its turn.

    Attributes:
        ticket: its number in the session.
    """

    def __init__(self, sessions: LiveSessions, live: LiveSession, wish: OutfitWish) -> None:
        self._sessions, self._live, self._wish = sessions, live, wish
        self.ticket = live.machine.new_ticket()
        self._session = live.machine.id
        self._task: asyncio.Task[Any] | None = None
        self._ordered = self._worn = False

    async def keep(self) -> None:
        """Keep that it waits: if the server is killed, the session that continues this one makes it."""
        await asyncio.to_thread(self._sessions.waiting.keep, self._session, self.ticket, self._wish)

    async def made_in_turn(self) -> Changed:
        """Have it worn in its turn, for somebody without a connection. One that is refused or given up waits no more;
        one whose session ends waits for that which continues it.

        Raises:
            ProblemError, ProtocolError: it can't be worn so, or not now; what was worn is worn on.
        """
        self._task = asyncio.current_task()
        try:
            async with self._live.in_turn():
                return await self.made()
        except (ProblemError, ProtocolError, asyncio.CancelledError):
            if not self._live.machine.ended:
                await asyncio.to_thread(self._sessions.waiting.keep, self._session, self.ticket, None)
            raise

    async def made(self, client: int | None = None) -> Changed:
        """The same to who has the turn, and a client who asked for it, if one did. Raises as `made_in_turn`."""
        sessions, live, wish = self._sessions, self._live, self._wish
        wardrobes = sessions.wardrobes
        fabric = await sessions.fabric_for(wish.garment, wish.fabric) if isinstance(wish, PutOnMessage) else ""
        before = await sessions.outfit(await sessions.record(self._session))
        wanted = wardrobes.wished(wish, fabric)(before)
        await asyncio.to_thread(wardrobes.hold, self._session, wanted)
        order = await asyncio.to_thread(wardrobes.garments, self._session, wanted)
        self._ordered = True
        items = wardrobes.items(wanted)
        again = await live.change_outfit(items, wanted.edited, order, self.ticket)
        self._worn = True
        await asyncio.to_thread(wardrobes.keep, self._session, wanted, Waiting(self._session, self.ticket))
        live.tell_outfit(items, wanted.edited, again, client, wish.request)
        return Changed(wanted, again)

    def give_up(self) -> None:
        """It is wanted no more: it is refused, unless something is off for it already, or it is worn."""
        if self._ordered:
            self._live.give_up(self.ticket)
        elif self._task is not None:
            self._task.cancel()

    def progress(self) -> Progress:
        """How far it is."""
        if self._worn:
            return Progress("keeping", BEING_KEPT)
        if not self._ordered:
            return Progress("waiting", OTHERS_FIRST if self._live.machine.dressed else TO_BE_WORN)
        status = self._live.machine.status(self._live.now)
        told = status.progress is not None
        return Progress("dressing", status.detail if told else BEGUN, status.progress)
