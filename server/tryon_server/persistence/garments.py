"""Garments: what is known about each uploaded or built-in pattern."""

from __future__ import annotations

from typing import Protocol

import msgspec
from sqlalchemy import Engine, select
from sqlalchemy.exc import IntegrityError

from tryon_server.persistence import tables


class GarmentRecord(msgspec.Struct, frozen=True, kw_only=True):
    """A stored garment. ``digest`` is the sha256 of its pattern file; ``area`` in m^2; ``created`` in s since 1970.

    The counts of vertices and triangles are those of the mesh made when the pattern was checked.
    """

    id: str
    name: str
    digest: str
    panel_count: int
    seam_count: int
    vertex_count: int
    triangle_count: int
    area: float
    created: float


class GarmentStore(Protocol):
    """Where garments are kept."""

    def add(self, garment: GarmentRecord) -> None:
        """Keep a garment; one whose id is already there is replaced."""

    def get(self, garment_id: str) -> GarmentRecord | None:
        """The garment with this id, or None."""

    def all(self) -> list[GarmentRecord]:
        """Every garment, oldest first."""


class SqlGarments:
    """Garments in a relational database."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine

    def add(self, garment: GarmentRecord) -> None:
        values = msgspec.structs.asdict(garment)
        update = tables.garments.update().where(tables.garments.c.id == garment.id).values(values)
        with self._engine.begin() as connection:
            if connection.execute(update).rowcount:
                return
        try:
            with self._engine.begin() as connection:
                connection.execute(tables.garments.insert().values(values))
        except IntegrityError:  # somebody uploaded the same pattern at the same moment
            with self._engine.begin() as connection:
                connection.execute(update)

    def get(self, garment_id: str) -> GarmentRecord | None:
        query = select(tables.garments).where(tables.garments.c.id == garment_id)
        with self._engine.connect() as connection:
            row = connection.execute(query).mappings().first()
        return None if row is None else GarmentRecord(**row)

    def all(self) -> list[GarmentRecord]:
        query = select(tables.garments).order_by(tables.garments.c.created, tables.garments.c.id)
        with self._engine.connect() as connection:
            return [GarmentRecord(**row) for row in connection.execute(query).mappings()]
