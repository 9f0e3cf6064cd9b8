"""Edits of the patterns that sessions wear: what outlives a server that is killed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import msgspec
from sqlalchemy import Connection, Engine, select

from tryon_server.persistence import tables


class EditRecord(msgspec.Struct, frozen=True, kw_only=True):
    """An edit of a session's pattern: its number there, the edit as plain JSON, whether it was made on both sides, the
    pattern that it made, when [s since 1970], and whether it has been taken back."""

    session: str
    id: int
    edit: Mapping[str, Any]
    mirror: bool
    specification: Mapping[str, Any]
    made: float
    undone: bool = False


class Waiting(NamedTuple):
    """A change that waits to be made: its session, and its number there."""

    session: str
    number: int


class EditStore(Protocol):
    """Where edits are kept."""

    def add(self, edit: EditRecord, made_of: Waiting | None = None) -> None:
        """Keep a new edit; what had been taken back in its session is forgotten, and what it is made of waits no more:
        both or neither."""

    def add_all(self, edits: Sequence[EditRecord]) -> None:
        """Keep edits as they are, all or none of them."""

    def mark(self, session: str, edit_id: int, undone: bool, made_of: Waiting | None = None) -> None:
        """Note that an edit was taken back, or made again; `made_of` as in `add`."""

    def all(self, session: str) -> list[EditRecord]:
        """The edits of a session, oldest first, with those that were taken back."""

    def wait(self, waiting: Waiting, change: Mapping[str, Any]) -> None:
        """Keep that this change, plain JSON, waits to be made."""

    def waiting(self, session: str) -> list[Mapping[str, Any]]:
        """The changes of a session that wait, in their order."""

    def forget(self, waiting: Waiting) -> None:
        """This change waits no more."""


class SqlEdits:
    """Edits in a relational database."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine

    def add(self, edit: EditRecord, made_of: Waiting | None = None) -> None:
        columns = tables.edits.c
        undone = tables.edits.delete().where(columns.session == edit.session, columns.undone.is_(True))
        with self._engine.begin() as connection:
            connection.execute(undone)
            connection.execute(tables.edits.insert().values(_row(edit)))
            forget(connection, made_of)

    def add_all(self, edits: Sequence[EditRecord]) -> None:
        with self._engine.begin() as connection:
            connection.execute(tables.edits.insert(), [_row(edit) for edit in edits])

    def mark(self, session: str, edit_id: int, undone: bool, made_of: Waiting | None = None) -> None:
        columns = tables.edits.c
        which = (columns.session == session, columns.id == edit_id)
        with self._engine.begin() as connection:
            connection.execute(tables.edits.update().where(*which).values(undone=undone))
            forget(connection, made_of)

    def all(self, session: str) -> list[EditRecord]:
        query = select(tables.edits).where(tables.edits.c.session == session).order_by(tables.edits.c.id)
        with self._engine.connect() as connection:
            rows = connection.execute(query).mappings().all()
        return [
            EditRecord(
                **{
                    **{str(name): value for name, value in row.items()},
                    "edit": msgspec.json.decode(row["edit"]),
                    "specification": msgspec.json.decode(row["specification"]),
                }
            )
            for row in rows
        ]

    def wait(self, waiting: Waiting, change: Mapping[str, Any]) -> None:
        row = {**waiting._asdict(), "change": msgspec.json.encode(change).decode()}
        with self._engine.begin() as connection:
            connection.execute(tables.waiting_edits.insert().values(row))

    def waiting(self, session: str) -> list[Mapping[str, Any]]:
        columns = tables.waiting_edits.c
        query = select(columns.change).where(columns.session == session).order_by(columns.number)
        with self._engine.connect() as connection:
            return [msgspec.json.decode(text) for text in connection.execute(query).scalars()]

    def forget(self, waiting: Waiting) -> None:
        with self._engine.begin() as connection:
            forget(connection, waiting)


def forget(connection: Connection, waiting: Waiting | None) -> None:
    """This change waits no more, if one is told."""
    if waiting is not None:
        columns = tables.waiting_edits.c
        which = (columns.session == waiting.session, columns.number == waiting.number)
        connection.execute(tables.waiting_edits.delete().where(*which))


def _row(edit: EditRecord) -> dict[str, Any]:
    return {
        **msgspec.structs.asdict(edit),
        "edit": msgspec.json.encode(edit.edit).decode(),
        "specification": msgspec.json.encode(edit.specification).decode(),
    }
