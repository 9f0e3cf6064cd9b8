"""Uploaded motions, bodies and prints: what is known about each file."""

from __future__ import annotations

from typing import Generic, Protocol, TypeVar

import msgspec
from sqlalchemy import ColumnElement, Engine, select
from sqlalchemy.exc import IntegrityError

from tryon_server.findings import BodyFacts, MotionFacts, PrintFacts
from tryon_server.persistence import tables


class MotionRecord(msgspec.Struct, frozen=True, kw_only=True):
    """A stored motion. ``digest`` is the sha256 of its file, ``key`` that of the file and what was told about it;
    ``units``, ``up``, ``facing`` and ``joints`` as told, None where nothing was; ``created`` in s since 1970."""

    id: str
    name: str
    key: str
    digest: str
    created: float
    facts: MotionFacts
    units: str | None = None
    up: str | None = None
    facing: str | None = None
    joints: dict[str, str] | None = None


class BodyRecord(msgspec.Struct, frozen=True, kw_only=True):
    """A stored body: as ``MotionRecord``; ``up``, ``fps`` and ``animation`` are told likewise."""

    id: str
    name: str
    key: str
    digest: str
    created: float
    facts: BodyFacts
    units: str | None = None
    up: str | None = None
    fps: float | None = None
    animation: str | None = None
    facing: str | None = None


class PrintRecord(msgspec.Struct, frozen=True, kw_only=True):
    """A stored print: as ``MotionRecord``; how wide it is on the cloth is told, and in its facts."""

    id: str
    name: str
    key: str
    digest: str
    created: float
    facts: PrintFacts


Record = TypeVar("Record", MotionRecord, BodyRecord, PrintRecord)


class UploadStore(Protocol[Record]):
    """Where the records of one kind of upload are kept."""

    def add(self, record: Record) -> Record:
        """Keep a record; the one that is kept: this one, or the one of the same key that was there before."""

    def get(self, upload_id: str) -> Record | None:
        """The record with this id, or None."""

    def by_key(self, key: str) -> Record | None:
        """The record with this key, or None."""

    def all(self) -> list[Record]:
        """Every record, oldest first."""

    def remove(self, upload_id: str) -> None:
        """Forget the record with this id."""


class SqlUploads(Generic[Record]):
    """Records of one kind in a relational database."""

    def __init__(self, engine: Engine, kind: type[Record]) -> None:
        self._engine = engine
        self._kind: type[Record] = kind
        self._mine = tables.uploads.c.kind == kind.__name__

    def add(self, record: Record) -> Record:
        row = {
            "id": record.id,
            "kind": self._kind.__name__,
            "key": record.key,
            "digest": record.digest,
            "created": record.created,
            "record": msgspec.json.encode(record).decode(),
        }
        try:
            with self._engine.begin() as connection:
                connection.execute(tables.uploads.insert().values(row))
        except IntegrityError:  # somebody uploaded the same file at the same moment
            known = self.by_key(record.key)
            if known is None:
                raise
            return known
        return record

    def get(self, upload_id: str) -> Record | None:
        return self._one(tables.uploads.c.id == upload_id)

    def by_key(self, key: str) -> Record | None:
        return self._one(tables.uploads.c.key == key)

    def all(self) -> list[Record]:
        query = select(tables.uploads.c.record).where(self._mine)
        query = query.order_by(tables.uploads.c.created, tables.uploads.c.id)
        with self._engine.connect() as connection:
            return [msgspec.json.decode(text, type=self._kind) for text in connection.execute(query).scalars()]

    def remove(self, upload_id: str) -> None:
        with self._engine.begin() as connection:
            connection.execute(tables.uploads.delete().where(self._mine, tables.uploads.c.id == upload_id))

    def _one(self, condition: ColumnElement[bool]) -> Record | None:
        query = select(tables.uploads.c.record).where(self._mine, condition)
        with self._engine.connect() as connection:
            text = connection.execute(query).scalars().first()
        return None if text is None else msgspec.json.decode(text, type=self._kind)


def digest_in_use(engine: Engine, digest: str) -> bool:
    """Whether a garment, a motion, a body or a print has the file of this digest."""
    queries = [select(table.c.id).where(table.c.digest == digest) for table in (tables.uploads, tables.garments)]
    with engine.connect() as connection:
        return any(connection.execute(query).first() is not None for query in queries)
