"""Sewing a piece on another: a patch all around, a pocket open at its top."""

from __future__ import annotations

from typing import Any

import numpy as np

from tryon_solver.redesign.draft import Draft, Edge, Piece, Vertex
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import Patch, Pocket, SewnOn

TOP = 2  # edge of a rectangle whose corners are listed from the lower left one on, counter-clockwise


def patch(draft: Draft, edit: Patch) -> None:
    """Edits Patch."""
    _sew_on(draft, edit, "patch", ())


def pocket(draft: Draft, edit: Pocket) -> None:
    """Edits Pocket."""
    _sew_on(draft, edit, "pocket", (TOP,))


def hosts_no_more(draft: Draft, host: Piece, heirs: tuple[Piece, ...]) -> None:
    """What lies on a piece that has become others lies on the one of them below its middle, or is taken away."""
    for name, piece in list(draft.pieces.items()):
        on = piece.fields.get("on")
        if on is None or on["panel"] != host.name:
            continue
        at = np.array(on["at"], dtype=np.float64)[None] / draft.units_in_meter
        below = next((heir for heir in heirs if draft.covers(heir, at)), None)
        if below is None:
            del draft.pieces[name]
            draft.notes.append(f"{name!r}, which was sewn on {host.name!r}, is taken away with it")
        else:
            piece.fields = {**piece.fields, "on": {**on, "panel": below.name}}


def refuse_patch(piece: Piece, what: str) -> None:
    """Raises EditError for a piece that lies on another."""
    if piece.fields.get("on") is not None:
        message = f"{piece.name!r} is sewn on {piece.fields['on']['panel']!r}: {what}"
        raise EditError(message, "panel", "Remove it, and sew on another one")


def _sew_on(draft: Draft, edit: SewnOn, name: str, opened: tuple[int, ...]) -> None:
    host = draft.piece(edit.panel)
    refuse_patch(host, "nothing can be sewn on it in turn")
    x, y = edit.width / 2, edit.height / 2
    corners = [Vertex(np.array(at)) for at in ((-x, -y), (x, -y), (x, y), (-x, y))]
    edges = [Edge(start, end, {}) for start, end in zip(corners, [*corners[1:], corners[0]])]
    if draft.turns(host) < 0:  # its right side is seen from the other side: so is the pocket's
        edges = [Edge(edge.end, edge.start, {}) for edge in edges[::-1]]
        opened = tuple(len(edges) - 1 - edge for edge in opened)
    at = (np.array(edit.at) * draft.units_in_meter).tolist()
    on: dict[str, Any] = {"panel": edit.panel, "at": at, "turn": edit.turn, "open": list(opened)}
    free = draft.free_name(name)
    draft.pieces[free] = Piece(free, corners, edges, {"on": on})
