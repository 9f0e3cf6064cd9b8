"""How sessions finish their fabric: the dye and the print that were chosen last."""

from __future__ import annotations

from typing import Protocol

import msgspec
from sqlalchemy import Engine, select

from tryon_server.persistence import tables


class FinishRecord(msgspec.Struct, frozen=True, kw_only=True):
    """A dye (RRGGBB) or the id of a print, in place of the fabric's own colour; None: not that."""

    dye: str | None = None
    print: str | None = None


class FinishStore(Protocol):
    """Where sessions' finishes are kept."""

    def put(self, session_id: str, finish: FinishRecord) -> None:
        """Keep what a session has chosen, in place of what it had."""

    def get(self, session_id: str) -> FinishRecord:
        """What a session has chosen last; neither dye nor print of one that chose nothing."""


class SqlFinishes:
    """Finishes in a relational database."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine

    def put(self, session_id: str, finish: FinishRecord) -> None:
        mine = tables.finishes.c.session == session_id
        with self._engine.begin() as connection:
            connection.execute(tables.finishes.delete().where(mine))
            connection.execute(tables.finishes.insert().values(session=session_id, **msgspec.structs.asdict(finish)))

    def get(self, session_id: str) -> FinishRecord:
        chosen = select(tables.finishes.c.dye, tables.finishes.c.print).where(tables.finishes.c.session == session_id)
        with self._engine.connect() as connection:
            row = connection.execute(chosen).mappings().first()
        return FinishRecord(**row) if row else FinishRecord()
