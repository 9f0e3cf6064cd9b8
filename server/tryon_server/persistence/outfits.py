"""What sessions wear: what outlives a server that is killed."""

from __future__ import annotations

from typing import Protocol

import msgspec
from sqlalchemy import Engine, select

from tryon_server.persistence import tables
from tryon_server.persistence.edits import Waiting, forget
from tryon_server.persistence.sessions import Size


class WornRecord(msgspec.Struct, frozen=True, kw_only=True):
    """A garment of an outfit by its name there, and its number in the session, by which its edits are kept; the stored
    garment's id, the name of its fabric, and the size of its pattern, over its own."""

    name: str
    number: int
    garment: str
    fabric: str
    size: Size = 1.0


class OutfitRecord(msgspec.Struct, frozen=True, kw_only=True):
    """What a session wears, from the innermost outwards, which garment is edited, and the highest number that one of
    its garments ever had."""

    worn: tuple[WornRecord, ...]
    edited: str
    highest: int


class OutfitStore(Protocol):
    """Where outfits are kept."""

    def put(self, session: str, outfit: OutfitRecord, made_of: Waiting | None = None) -> None:
        """Keep what a session wears, in place of what it wore; the wish that it is `made_of` waits no more: both or
        neither."""

    def get(self, session: str) -> OutfitRecord | None:
        """What a session wears; None of one that was never told."""


class SqlOutfits:
    """Outfits in a relational database."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine

    def put(self, session: str, outfit: OutfitRecord, made_of: Waiting | None = None) -> None:
        table = tables.outfits
        text = msgspec.json.encode(outfit).decode()
        with self._engine.begin() as connection:
            connection.execute(table.delete().where(table.c.session == session))
            connection.execute(table.insert().values(session=session, outfit=text))
            forget(connection, made_of)

    def get(self, session: str) -> OutfitRecord | None:
        query = select(tables.outfits.c.outfit).where(tables.outfits.c.session == session)
        with self._engine.connect() as connection:
            text = connection.execute(query).scalar()
        return None if text is None else msgspec.json.decode(text, type=OutfitRecord)
