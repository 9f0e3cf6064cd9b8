"""Why an edit can't be worn: of a garment that earlier edits have made small, or as it sews an opening shut.

Worn, a T-shirt bears to be made 0.85 times as large: it hangs where it hung. What can't go on from there is put on
anew, and around the body the seams of one so small do not close. Looked at by itself the edit that was asked for is
sound; what stands in its way is one that was made before.

A garment whose hem is sewn shut can't be put on, however large. That openings become fewer does not tell by itself that
it can't: a slit may be sewn, too, that no part of the body goes through. It is tried, and told where it fails.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tryon_solver.geometry import outline
from tryon_solver.redesign.draft import read_draft
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import CloseSeam, Cut, Dart, Edit, SewnOn
from tryon_solver.redesign.history import Entry, History

NO_ROOM = (CloseSeam, Cut, Dart, SewnOn)  # edits that leave a garment no wider than it is
TOO_TIGHT = 0.25  # of the cloth, stretched by more than its fabric bears: of a walking T-shirt 0.01 in its own size,
# 0.10 in 0.92 of it, in which it goes on anew, 0.14 in 0.9, in which its seams stay 4 mm open, and 0.28 in 0.85, 16 mm
SMALLER = 0.97  # of the area of its pieces, at most, that an edit leaves of a garment, by which it makes that tight

SEWN_SHUT = "Leave these edges open: what of the body goes through an opening can't be got through it once it is shut"


class UnfitError(EditError):
    """What an edit makes can't be put on, or not in time."""


def refuse_what_is_too_tight(edit: Edit | None, overstretched: float) -> None:
    """Raises UnfitError where what is worn, of whose cloth a share is `overstretched`, can't be put on anew with this
    edit, either: to find that by sewing takes longest where there is least hope."""
    if isinstance(edit, NO_ROOM) and overstretched > TOO_TIGHT:
        raise UnfitError(
            f"it can't be put on anew: {100 * overstretched:.0f} % of what is worn are stretched by more than the "
            "fabric bears already, and the seams of a garment so tight do not close around the body",
            "garment",
            "Make the garment larger",
        )


def with_cause(error: EditError, history: History, edit: Edit | None, wanted: Mapping[str, Any]) -> EditError:
    """The same of the `edit` that makes the `wanted` pattern: with the openings that it sews shut, or else with the
    earlier edit that made the garment so small, where one did; other errors have nothing to do with either, nor has
    what takes an edit back or makes it again (None): that was worn before."""
    if not isinstance(error, UnfitError) or edit is None:
        return error
    before, after = (openings(pattern) for pattern in (history.specification, wanted))
    if isinstance(edit, CloseSeam) and after < before:
        message = f"{error.message.rstrip('.')}; of {before} openings the seam leaves {after}"
        return EditError(message, error.place, SEWN_SHUT)
    tightest = tightening(history)
    if tightest is None:
        return error
    entry, left = tightest
    said = f"edit {entry.id} ({entry.edit.kind})"
    message = f"{error.message.rstrip('.')}; {said} left {100 * left:.0f} % of the area of its pieces"
    remedy = f"{error.remedy.rstrip('.')}; or take {said} back, make this one first, and that one after it"
    return EditError(message, error.place, remedy)


def tightening(history: History) -> tuple[Entry, float] | None:
    """Of the edits that keep all pieces the one that made these smallest, and which share of their area it left; None
    where none made them notably smaller."""
    patterns = [history.beginning, *(entry.specification for entry in history.done)]
    areas = [areas_of(pattern) for pattern in patterns]
    left = [
        (sum(after.values()) / sum(before.values()), entry)
        for entry, (before, after) in zip(history.done, pairwise(areas))
        if before.keys() == after.keys() and not isinstance(entry.edit, NO_ROOM)
    ]
    share, entry = min(left, key=lambda each: each[0], default=(1.0, None))
    return None if entry is None or share > SMALLER else (entry, share)


def areas_of(specification: Mapping[str, Any]) -> dict[str, float]:
    """m^2 of each piece, by name."""
    draft = read_draft(specification)
    return {name: abs(float(outline.signed_area(draft.outline(piece)))) for name, piece in draft.pieces.items()}


def openings(specification: Mapping[str, Any]) -> int:
    """How many openings the sewn garment has: edges sewn to nothing, in rows that close by what their ends are sewn to.
    Two that meet in a point are one. The edges of a piece that lies on another are no openings."""
    draft = read_draft(specification)
    index = {vertex: k for k, vertex in enumerate(v for piece in draft.pieces.values() for v in piece.vertices)}
    sewn = {edge for seam in draft.seams for edge in (seam.first, seam.second)}
    lying = (piece.edges for piece in draft.pieces.values() if "on" not in piece.fields)
    free = [edge for edges in lying for edge in edges if edge not in sewn]
    met = [*(pair for seam in draft.seams for pair in seam.ends()), *((edge.start, edge.end) for edge in free)]
    links = np.array([(index[one], index[other]) for one, other in met], np.int64).reshape(-1, 2)
    graph = coo_array((np.ones(len(links)), links.T), shape=(len(index), len(index)))
    _, row_of_vertex = connected_components(graph, directed=False)
    return len({int(row_of_vertex[index[edge.start]]) for edge in free})
