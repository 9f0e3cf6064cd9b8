"""The session's wardrobe: what is worn, in order, and changes of that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from tryon_protocol import ProtocolError
from tryon_server.sessions.actions import Action, Answer, Order
from tryon_server.sessions.commands import ChangeOutfit, WornItem
from tryon_server.sessions.events import Designed, Event, OutfitRefused, OutfitWorn
from tryon_server.sessions.machine import Session
from tryon_server.sessions.pattern_changes import refuse_before


class WardrobeSession(Session):
    """A session that several garments are worn in. What is asked of it is asked without a connection.

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

    def change_outfit(self, items: Sequence[WornItem], edited: str, order: Any) -> tuple[int, list[Action]]:
        """Somebody asks for these garments; the ticket that `Answer` will have, and what is to be done.

        Raises ProtocolError: nothing is dressed yet, or another change of them is under way.
        """
        refuse_before(self._topology is not None)
        if self._asked is not None:
            what = "Another change of what is worn is under way."
            raise ProtocolError("unexpected_message", "$", what, "Wait until it is worn.")
        self._asked = ChangeOutfit(self._changes.new_ticket(), tuple(items), edited, order)
        return self._asked.ticket, [Order(self._asked)]

    def simulated(self, event: Event, now: float) -> list[Action]:
        """The simulation told something."""
        if isinstance(event, Designed) and not event.design.held:
            self.edited = event.design.garment
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
