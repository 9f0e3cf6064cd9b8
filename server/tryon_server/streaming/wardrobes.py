"""What sessions wear, as it is kept and as it is ordered."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain, count
from typing import Any

import msgspec

from tryon_protocol import OutfitWish, ProtocolError, PutOnMessage, ReorderMessage, TakeOffMessage
from tryon_server.garments.service import GarmentService
from tryon_server.persistence import (
    FIT,
    EditStore,
    KeptFiles,
    OutfitRecord,
    OutfitStore,
    SessionRecord,
    Waiting,
    WornRecord,
)
from tryon_server.problems import ProblemError, problem_error
from tryon_server.runtime.order import DrapeOrder, GarmentOrder, KeptEdit, MeshReading
from tryon_server.sessions.commands import WornItem
from tryon_server.streaming.histories import carry_on, told

MOST = 6  # garments of one session
FIRST = 1  # the number of the garment that a session was opened with, whose edits are kept under the session's id


@dataclass(frozen=True)
class Changed:
    """What a session wears after a change of it, and the names of what was taken off for it and put on again."""

    outfit: OutfitRecord
    again: tuple[str, ...]


class Wardrobes:
    """Finds, orders and keeps what sessions wear. What looks into a database or a folder blocks."""

    def __init__(self, garments: GarmentService, files: KeptFiles, edits: EditStore, outfits: OutfitStore) -> None:
        self._garments, self._files, self._edits, self._outfits = garments, files, edits, outfits

    def begin(self, record: SessionRecord, continues: str | None) -> OutfitRecord:
        """What a new session wears: its garment, or what the session wore that it continues."""
        first = WornRecord(
            name=record.garment, number=FIRST, garment=record.garment, fabric=record.fabric, size=record.size
        )
        outfit = OutfitRecord(worn=(first,), edited=first.name, highest=FIRST)
        before = None if continues is None else self._outfits.get(continues)
        if before is not None and continues is not None:
            worn = (
                msgspec.structs.replace(one, fabric=record.fabric, size=record.size) if one.number == FIRST else one
                for one in before.worn
            )
            outfit = msgspec.structs.replace(before, worn=tuple(worn))
            for one in before.worn:
                if one.number != FIRST:
                    self._carry_on(continues, record, one)
        self.hold(record.id, outfit)
        self._outfits.put(record.id, outfit)
        return outfit

    def _carry_on(self, continues: str, record: SessionRecord, one: WornRecord) -> None:
        """Go on with the edits of a garment in another session, if there are any."""
        before, after = (history_key(session, one.number) for session in (continues, record.id))
        if self._edits.all(before):
            path = self._garments.pattern_path(self._garments.get(one.garment))
            unedited = json.loads(path.read_text("utf-8-sig"))
            carry_on(self._edits, before, after, unedited)

    def histories(self, session_id: str, outfit: OutfitRecord) -> dict[str, tuple[KeptEdit, ...]]:
        """The edits of garments which an earlier session began, by name."""
        kept = {one.name: told(self._edits.all(history_key(session_id, one.number))) for one in outfit.worn}
        return {name: edits for name, edits in kept.items() if edits}

    def of(self, record: SessionRecord) -> OutfitRecord:
        """What a session wears, or wore when it ended."""
        kept = self._outfits.get(record.id)
        return kept if kept is not None else self.begin(record, None)

    def one(self, record: SessionRecord, name: str) -> WornRecord:
        """The garment of this name of what a session wears; the edited one for "". Raises ProblemError 404."""
        outfit = self.of(record)
        return _one(outfit, name or outfit.edited)

    def history_of(self, session_id: str, name: str) -> str:
        """Under what the edits of a session's garment are kept. Raises ProblemError 404."""
        outfit = self._outfits.get(session_id)
        return session_id if outfit is None else history_key(session_id, _one(outfit, name or outfit.edited).number)

    def as_edited(self, session_id: str, worn: WornRecord) -> Mapping[str, Any] | None:
        """The pattern that the edits of a garment have made; None without any."""
        made = [edit for edit in self._edits.all(history_key(session_id, worn.number)) if not edit.undone]
        return made[-1].specification if made else None

    def keep(self, session_id: str, outfit: OutfitRecord, made_of: Waiting | None = None) -> None:
        """The session wears this from now on; the wish that it is `made_of` waits no more."""
        self._outfits.put(session_id, outfit, made_of)

    def with_one(
        self, outfit: OutfitRecord, garment: str, fabric: str, size: float, position: int | None, replaces: str | None
    ) -> OutfitRecord:
        """The outfit with another garment: at this position counted from the innermost; for None where the one of the
        name `replaces` was, or outermost. It is the one that is edited then. Its name is none of those that are worn,
        nor of the one that it replaces, whose edits are not its own.

        Raises ProblemError: 404 no garment of that name, 409 too many, 422 no such position.
        """
        left = list(outfit.worn)
        if replaces is not None:
            gone = _one(outfit, replaces)
            position = left.index(gone) if position is None else position
            left.remove(gone)
        place = len(left) if position is None else position
        if not 0 <= place <= len(left):
            message, remedy = f"there is no position {place}", f"Give one from 0, innermost, to {len(left)}"
            raise problem_error("position.outside", message, remedy, place="position", status=422)
        if len(left) >= MOST:
            remedy = "Take one off before"
            raise problem_error("outfit.full", f"{MOST} garments are worn", remedy, place="session", status=409)
        number = outfit.highest + 1
        names = {one.name for one in outfit.worn}
        numbered = (f"{garment}-{k}" for k in count(number))
        name = next(one for one in chain([garment], numbered) if one not in names)
        left.insert(place, WornRecord(name=name, number=number, garment=garment, fabric=fabric, size=size))
        return OutfitRecord(worn=tuple(left), edited=name, highest=number)

    @staticmethod
    def without(outfit: OutfitRecord, name: str) -> OutfitRecord:
        """The outfit without this garment. Raises ProblemError: 404 no such one, 409 it is the only one."""
        gone = _one(outfit, name)
        left = tuple(one for one in outfit.worn if one is not gone)
        if not left:
            remedy = "Put another one on in its place, or end the session"
            raise problem_error("outfit.empty", f"{name!r} is all that is worn", remedy, place="garment", status=409)
        edited = outfit.edited if outfit.edited != name else left[-1].name
        return msgspec.structs.replace(outfit, worn=left, edited=edited)

    @staticmethod
    def in_order(outfit: OutfitRecord, order: Sequence[str] | None, edited: str | None) -> OutfitRecord:
        """The same garments in this order, and the one that is edited; None: as they are. Raises ProblemError 422."""
        names = [one.name for one in outfit.worn]
        if order is not None and sorted(order) != sorted(names):
            remedy = f"Name each of {', '.join(names)} once"
            raise problem_error("order.other", "the order names other garments", remedy, place="order", status=422)
        worn = tuple(_one(outfit, name) for name in order or names)
        return msgspec.structs.replace(outfit, worn=worn, edited=_one(outfit, edited or outfit.edited).name)

    def wished(self, wish: OutfitWish, fabric: str) -> Callable[[OutfitRecord], OutfitRecord]:
        """What makes of an outfit the one that is asked for; what is put on is of this fabric. Raises ProblemError."""
        match wish:
            case PutOnMessage():
                return lambda before: self.with_one(
                    before, wish.garment, fabric, wish.size, wish.position, wish.replaces
                )
            case TakeOffMessage():
                return lambda before: self.without(before, wish.garment)
            case ReorderMessage():
                return lambda before: self.in_order(before, wish.order, wish.edited)

    @staticmethod
    def as_worn(outfit: OutfitRecord, items: Sequence[WornItem], edited: str) -> OutfitRecord:
        """The outfit with the fabrics of its `items` as a live session wears them, and the garment that it edits."""
        fabrics = {item.name: item.fabric for item in items}
        worn = (msgspec.structs.replace(one, fabric=fabrics.get(one.name, one.fabric)) for one in outfit.worn)
        known = edited if edited in fabrics else outfit.edited
        return msgspec.structs.replace(outfit, worn=tuple(worn), edited=known)

    def hold(self, session_id: str, outfit: OutfitRecord) -> None:
        """Keep the files of all its garments to the session's end."""
        for one in outfit.worn:
            self._files.hold(session_id, self._garments.get(one.garment).digest)

    def garments(self, session_id: str, outfit: OutfitRecord) -> tuple[GarmentOrder, ...]:
        """What a simulation is told to wear, in the patterns that edits have made."""
        return tuple(self._garment(one, self.as_edited(session_id, one)) for one in outfit.worn)

    def _garment(self, one: WornRecord, edited: Mapping[str, Any] | None) -> GarmentOrder:
        stored = self._garments.get(one.garment)
        return GarmentOrder(
            worn_as=one.name,
            pattern=self._garments.pattern_path(stored),
            fabric=one.fabric,
            specification=edited,
            size=None if one.size == FIT else one.size,
            garment_name=stored.name,
            reading=MeshReading(stored.units, stored.up, rest_shape=stored.rest_shape),
        )

    def ordered(self, session_id: str, outfit: OutfitRecord, order: DrapeOrder) -> DrapeOrder:
        """A session's order with all that it wears."""
        return replace(order, edited=outfit.edited).wearing(self.garments(session_id, outfit), outfit.edited)

    @staticmethod
    def items(outfit: OutfitRecord) -> tuple[WornItem, ...]:
        """As the session's machine knows them."""
        return tuple(
            WornItem(one.name, one.garment, one.fabric, None if one.size == FIT else one.size, one.number)
            for one in outfit.worn
        )


@contextmanager
def as_protocol_errors() -> Iterator[None]:
    """What is wrong with a wish for an outfit, as a client is told it: refused, but for what the moment forbids."""
    try:
        yield
    except ProblemError as error:
        fault = error.problem
        place = f"$.{fault.place}" if fault.place else "$"
        raise ProtocolError("outfit_refused", place, f"{fault.message}.", f"{fault.remedy}.") from error
    except ProtocolError as error:
        code = "outfit_refused" if error.code == "edit_refused" else error.code
        raise ProtocolError(code, error.place, error.message, error.remedy) from error


def history_key(session_id: str, number: int) -> str:
    """Under what the edits of a session's garment with this number are kept, in place of a session's id."""
    return session_id if number == FIRST else f"{session_id}:{number}"


def _one(outfit: OutfitRecord, name: str) -> WornRecord:
    found = next((one for one in outfit.worn if one.name == name), None)
    if found is None:
        known = ", ".join(one.name for one in outfit.worn)
        message, remedy = f"no garment {name!r} is worn", f"Choose one of: {known}"
        raise problem_error("worn.unknown", message, remedy, place="garment", status=404)
    return found
