"""The session's wardrobe: what is worn, in order, and changes of that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

from tryon_protocol import ClientMessage, OutfitMessage, OutfitWish, ProtocolError, PutOnMessage, WornGarment, encode
from tryon_server.sessions.actions import Action, Answer, ChangeWorn, Order, Send
from tryon_server.sessions.commands import ChangeOutfit, WornItem
from tryon_server.sessions.events import Designed, Event, FabricWorn, OutfitRefused, OutfitWorn
from tryon_server.sessions.machine import Session
from tryon_server.sessions.pattern_changes import refuse_before
from tryon_server.sessions.rules import unknown
from tryon_server.sessions.viewer import Viewer

FITTING: Literal["fit"] = "fit"  # in place of a size that is looked for


class WardrobeSession(Session):
    """A session that several garments are worn in. Who finds what is asked for are its
    surroundings, also where a client asks (`ChangeWorn`).

    Attributes:
        items: what is worn, from the innermost outwards.
        edited: the name of the garment that is edited.
    """

    items: tuple[WornItem, ...] = ()
    edited: str = ""
    _asked: ChangeOutfit | None = None

    def begin_with(self, items: Sequence[WornItem], edited: str) -> None:
        """What the session is opened with."""
        self.items, self.edited = tuple(items), edited

    def number_of(self, name: str) -> int | None:
        """That of the worn garment of this name, which its edits are kept by; None where there is none."""
        return next((item.number for item in self.items if item.name == name), None)

    def new_ticket(self) -> int:
        """For a change of what is worn that waits for its turn."""
        return self._changes.new_ticket()

    def change_outfit(
        self, items: Sequence[WornItem], edited: str, order: Any, ticket: int | None = None
    ) -> tuple[int, list[Action]]:
        """Somebody asks for these garments; the ticket that `Answer` will have, a new one unless it is told, and what
        is to be done.

        Raises ProtocolError: nothing is dressed yet, or another change of them is under way.
        """
        refuse_before(self._topology is not None)
        if self._asked is not None:
            what = "Another change of what is worn is under way."
            raise ProtocolError("unexpected_message", "$", what, "Wait until it is worn.")
        self._asked = ChangeOutfit(ticket or self.new_ticket(), tuple(items), edited, order)
        return self._asked.ticket, [Order(self._asked)]

    def tick(self, now: float) -> list[Action]:
        """Time went by; who asked for another outfit waits for it, with a connection or without."""
        if self._asked is not None:
            self.asked_for(now)
        return super().tick(now)

    def _obey(self, client: int, viewer: Viewer, message: ClientMessage, now: float) -> list[Action]:
        if not isinstance(message, OutfitWish):
            return super()._obey(client, viewer, message, now)
        try:
            if isinstance(message, PutOnMessage) and message.fabric not in (None, *self._rules.fabrics):
                raise unknown("unknown_fabric", "fabric", str(message.fabric), self._rules.fabrics)
        except ProtocolError as fault:
            return self._answer_fault(client, viewer, fault, message.request, now)
        return [ChangeWorn(client, message)]

    def outfit_changed(
        self,
        worn: Sequence[WornItem],
        edited: str,
        again: Sequence[str],
        client: int | None = None,
        request: int | None = None,
    ) -> list[Action]:
        """These garments are worn and kept, as that client asked for, if one did, those of the names ``again`` put on
        again for it; all clients are told."""
        told = tuple(
            WornGarment(
                name=item.name,
                garment=item.garment,
                fabric=item.fabric,
                size=FITTING if item.size is None else item.size,
                edited=item.name == edited,
                again=item.name in again,
            )
            for item in worn
        )
        return [
            Send(each, encode(OutfitMessage(worn=told, request=request if each == client else None)))
            for each in self._greeted()
        ]

    def outfit_refused(self, client: int, request: int | None, fault: ProtocolError, now: float) -> list[Action]:
        """What a client wants to wear is refused, and what is worn is worn on."""
        viewer = self._viewers.get(client)
        return [] if viewer is None else self._answer_fault(client, viewer, fault, request, now)

    def simulated(self, event: Event, now: float) -> list[Action]:
        """The simulation told something."""
        if isinstance(event, Designed) and not event.design.held:
            self.edited = event.design.garment
        if isinstance(event, FabricWorn) or (isinstance(event, Designed) and not event.design.held):
            self.items = tuple(
                replace(item, fabric=event.fabric) if item.name == self.edited else item for item in self.items
            )
        if not isinstance(event, OutfitWorn | OutfitRefused):
            return super().simulated(event, now)
        asked = self._asked
        if self._ended or asked is None or asked.ticket != event.ticket:
            return []
        self._asked = None
        if isinstance(event, OutfitRefused):
            return [Answer(event.ticket, ProtocolError("edit_refused", event.place, event.message, event.remedy))]
        self.items, self.edited = asked.items, asked.edited
        return [Answer(event.ticket, event)]
