"""The edits of a garment as they are kept, and as a session that continues another goes on with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from tryon_protocol import OutfitWish, PutOnMessage, ReorderMessage, TakeOffMessage
from tryon_server.persistence import EditRecord, EditStore, Waiting
from tryon_server.runtime.order import KeptEdit
from tryon_server.sessions.commands import HELD, ChangeEffect, ChangePattern

WISHES = {kind.__name__: kind for kind in (PutOnMessage, TakeOffMessage, ReorderMessage)}
BEGINNING = 0  # in place of an edit's number: the pattern that a session began with, where that is another one's


def carry_on(edits: EditStore, before: str, after: str, unedited: Mapping[str, Any]) -> None:
    """Keep under `after` the edits that are kept under `before`, those that were taken back among them, by the same
    numbers: they can be taken back and made again there. `unedited` is the pattern before all of them, plain JSON, if
    nothing else is kept of that. Blocks."""
    kept = edits.all(before)
    if not kept or kept[0].id != BEGINNING:
        made = kept[0].made if kept else 0.0
        own = {"continues": before}
        first = EditRecord(session=before, id=BEGINNING, edit=own, mirror=False, specification=unedited, made=made)
        kept = [first, *kept]
    edits.add_all([msgspec.structs.replace(edit, session=after) for edit in kept])


class WaitingChanges:
    """Changes of patterns, of effects and of what is worn that sessions were asked for, kept until they are made or
    refused."""

    def __init__(self, edits: EditStore) -> None:
        self._edits = edits

    def keep(self, session: str, ticket: int, change: ChangePattern | ChangeEffect | OutfitWish | None) -> None:
        """Keep that this change waits in a session; for None, that the one with this ticket does no more. Blocks."""
        which = Waiting(session, ticket)
        if change is None:
            self._edits.forget(which)
            return
        if isinstance(change, OutfitWish):
            self._edits.wait(which, {"outfit": type(change).__name__, **msgspec.structs.asdict(change)})
            return
        if isinstance(change, ChangeEffect):
            self._edits.wait(which, {"effect": change.name, "state": change.state, "parameters": change.parameters})
            return
        told = {"step": change.step, "edit": change.edit, "mirror": change.mirror, "garment": change.garment}
        self._edits.wait(which, told)

    def of(self, session: str | None) -> list[ChangePattern | ChangeEffect]:
        """Those of patterns and of effects of a session, in their order; [] of None. Blocks."""
        kept = [one for one in self._waiting(session) if "outfit" not in one]
        return [
            ChangeEffect(HELD, one["effect"], one["state"], one["parameters"])
            if "effect" in one
            else ChangePattern(one["step"], HELD, one["edit"], one["mirror"], garment=one["garment"])
            for one in kept
        ]

    def wishes(self, session: str | None) -> list[OutfitWish]:
        """Those of what a session wears, likewise. Blocks."""
        return [
            WISHES[one["outfit"]](**{name: value for name, value in one.items() if name != "outfit"})
            for one in self._waiting(session)
            if "outfit" in one
        ]

    def _waiting(self, session: str | None) -> list[Mapping[str, Any]]:
        return [] if session is None else self._edits.waiting(session)


def told(kept: Sequence[EditRecord]) -> tuple[KeptEdit, ...]:
    """What a simulation is told of records of one garment, in their order, to go on with them; nothing of edits that no
    BEGINNING is kept for."""
    if not kept or kept[0].id != BEGINNING:
        return ()
    return tuple(KeptEdit(one.id, one.edit, one.specification, one.undone) for one in kept)
