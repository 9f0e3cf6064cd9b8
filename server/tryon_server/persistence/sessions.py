"""Sessions: which were opened with what, and why they ended. A restart of the server ends those that were open."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, Protocol

import msgspec
from sqlalchemy import ColumnElement, Engine, select

from tryon_server.persistence import tables

FIT: Literal["fit"] = "fit"  # the size that fits, which is looked for by trying some on
Size = float | Literal["fit"]


class SessionRecord(msgspec.Struct, frozen=True, kw_only=True):
    """A session as opened. Times in s since 1970; ``ended`` and ``ending`` are None while it lives.

    ``size`` is that of the pattern over its own, as it was asked for: a number, or ``fit`` for the one that fits;
    ``body`` the id of an uploaded body, None for the default one.
    """

    id: str
    garment: str
    motion: str | None
    fabric: str
    preset: str
    created: float
    ended: float | None = None
    ending: str | None = None
    size: Size = 1.0
    body: str | None = None


class SessionStore(Protocol):
    """Where the history of sessions is kept."""

    def add(self, session: SessionRecord) -> None:
        """Keep a new session."""

    def end(self, session_id: str, when: float, why: str) -> None:
        """Note that a session ended; one that had ended before keeps its first ending."""

    def end_all_open(self, when: float, why: str) -> int:
        """Note the end of every session still open; their count."""

    def get(self, session_id: str) -> SessionRecord | None:
        """The session with this id, or None."""

    def keep_effects(self, session_id: str, wishes: Mapping[str, Any]) -> None:
        """Keep what is asked of the session's effects, plain JSON, in place of what was asked before."""

    def effects(self, session_id: str) -> Mapping[str, Any]:
        """What is asked of the session's effects; {} where nothing is."""


WISH = ("size", "body")  # kept aside, as one text
WHOLE = select(tables.sessions, tables.wishes.c.wish).outerjoin(
    tables.wishes, tables.wishes.c.session == tables.sessions.c.id
)


class SqlSessions:
    """Sessions in a relational database."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine

    def add(self, session: SessionRecord) -> None:
        values = msgspec.structs.asdict(session)
        wish = msgspec.json.encode({name: values.pop(name) for name in WISH}).decode()
        with self._engine.begin() as connection:
            connection.execute(tables.sessions.insert().values(values))
            connection.execute(tables.wishes.insert().values(session=session.id, wish=wish))

    def end(self, session_id: str, when: float, why: str) -> None:
        self._end([tables.sessions.c.id == session_id], when, why)

    def end_all_open(self, when: float, why: str) -> int:
        return self._end([], when, why)

    def _end(self, which: list[ColumnElement[bool]], when: float, why: str) -> int:
        update = tables.sessions.update().where(tables.sessions.c.ended.is_(None), *which)
        with self._engine.begin() as connection:
            return connection.execute(update.values(ended=when, ending=why[:500])).rowcount

    def keep_effects(self, session_id: str, wishes: Mapping[str, Any]) -> None:
        kept = tables.effects
        with self._engine.begin() as connection:
            connection.execute(kept.delete().where(kept.c.session == session_id))
            connection.execute(kept.insert().values(session=session_id, wishes=msgspec.json.encode(wishes).decode()))

    def effects(self, session_id: str) -> Mapping[str, Any]:
        kept = tables.effects
        with self._engine.connect() as connection:
            text = connection.execute(select(kept.c.wishes).where(kept.c.session == session_id)).scalar()
        wishes: Mapping[str, Any] = {} if text is None else msgspec.json.decode(text)
        return wishes

    def get(self, session_id: str) -> SessionRecord | None:
        with self._engine.connect() as connection:
            row = connection.execute(WHOLE.where(tables.sessions.c.id == session_id)).mappings().first()
        if row is None:
            return None
        values = {str(name): value for name, value in row.items()}
        wish = values.pop("wish")
        return msgspec.convert({**values, **(msgspec.json.decode(wish) if wish else {})}, SessionRecord)
