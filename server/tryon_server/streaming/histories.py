"""The edits of a garment as they are kept, and as a session that continues another goes on with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from tryon_server.persistence import EditRecord, EditStore
from tryon_server.runtime.order import KeptEdit

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


def told(kept: Sequence[EditRecord]) -> tuple[KeptEdit, ...]:
    """What a simulation is told of records of one garment, in their order, to go on with them; nothing of edits that no
    BEGINNING is kept for."""
    if not kept or kept[0].id != BEGINNING:
        return ()
    return tuple(KeptEdit(one.id, one.edit, one.specification, one.undone) for one in kept)
