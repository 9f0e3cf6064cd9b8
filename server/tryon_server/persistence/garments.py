"""Garments: what is known about each uploaded or built-in pattern."""

from __future__ import annotations

import contextlib
from typing import Any, Protocol

import msgspec
from sqlalchemy import Engine, RowMapping, select
from sqlalchemy.exc import IntegrityError

from tryon_server.persistence import tables


class GarmentRecord(msgspec.Struct, frozen=True, kw_only=True):
    """A stored garment. ``digest`` is the sha256 of its pattern file; ``area`` in m^2; ``created`` in s since 1970.

    The counts of vertices and triangles are those of the mesh made when the pattern was checked. Of a garment that is a
    mesh: ``units``, ``up`` and ``rest_shape`` as told by who uploaded it, None where nothing was; ``notes`` what was
    found out.
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
    units: str | None = None
    up: str | None = None
    rest_shape: str | None = None
    notes: tuple[str, ...] = ()


class GarmentStore(Protocol):
    """Where garments are kept."""

    def add(self, garment: GarmentRecord) -> None:
        """Keep a garment; one whose id is already there is replaced."""

    def get(self, garment_id: str) -> GarmentRecord | None:
        """The garment with this id, or None."""

    def all(self) -> list[GarmentRecord]:
        """Every garment, oldest first."""

    def remove(self, garment_id: str) -> None:
        """Forget the garment with this id, if it is there."""


READING = ("units", "up", "rest_shape", "notes")  # kept aside, as one text: only a mesh has them
WHOLE = select(tables.garments, tables.readings.c.reading).outerjoin(
    tables.readings, tables.readings.c.garment == tables.garments.c.id
)


class SqlGarments:
    """Garments in a relational database."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine

    def add(self, garment: GarmentRecord) -> None:
        values = msgspec.structs.asdict(garment)
        reading = {name: values.pop(name) for name in READING}
        if any(reading.values()):
            self._keep_reading(garment.id, msgspec.json.encode(reading).decode())
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

    def _keep_reading(self, garment_id: str, text: str) -> None:
        with contextlib.suppress(IntegrityError), self._engine.begin() as connection:  # the same, kept at this moment
            connection.execute(tables.readings.delete().where(tables.readings.c.garment == garment_id))
            connection.execute(tables.readings.insert().values(garment=garment_id, reading=text))

    def get(self, garment_id: str) -> GarmentRecord | None:
        with self._engine.connect() as connection:
            row = connection.execute(WHOLE.where(tables.garments.c.id == garment_id)).mappings().first()
        return None if row is None else _record(row)

    def all(self) -> list[GarmentRecord]:
        query = WHOLE.order_by(tables.garments.c.created, tables.garments.c.id)
        with self._engine.connect() as connection:
            return [_record(row) for row in connection.execute(query).mappings()]

    def remove(self, garment_id: str) -> None:
        with self._engine.begin() as connection:
            connection.execute(tables.readings.delete().where(tables.readings.c.garment == garment_id))
            connection.execute(tables.garments.delete().where(tables.garments.c.id == garment_id))


def _record(row: RowMapping) -> GarmentRecord:
    values: dict[str, Any] = {str(name): value for name, value in row.items()}
    reading = values.pop("reading")
    return msgspec.convert({**values, **(msgspec.json.decode(reading) if reading else {})}, GarmentRecord)
