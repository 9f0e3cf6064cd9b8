"""A garment that its edits made one which nobody can put on, as they may while it is worn: a T-shirt made a fifth
smaller hangs where it hung, but its seams would not close around the body again. It is put on as it was before its
edits, and these are made again, one after the other, while it is worn.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import groupby, pairwise
from typing import Any

from tryon_server.problems import ProblemError
from tryon_server.runtime.drape import Progress
from tryon_server.runtime.order import DrapeOrder, GarmentOrder
from tryon_server.runtime.solver_drape import SolverDrape
from tryon_server.runtime.sources import LONGEST_MOVE
from tryon_solver.geometry.pattern import PatternError, read_pattern_file
from tryon_solver.redesign.fabrics import made_of, named_fabric
from tryon_solver.redesign.parsed import parsed
from tryon_solver.redesign.structure import difference

logger = logging.getLogger(__name__)

REST_SECONDS = 0.5  # simulated after each edit that is made again: as long as cloth that is pulled at takes to follow
MAKING_AGAIN = "Making the edits again"

Specification = Mapping[str, Any]
PutOn = Callable[[DrapeOrder], SolverDrape]
"""Dresses as ordered. Raises ProblemError."""


def put_on_or_edited(order: DrapeOrder, put_on: PutOn, progress: Progress) -> SolverDrape:
    """What is ordered, put on in its patterns; where that can't be, as it was before its edits, which are made again
    while it is worn, as they were when it was edited.

    Raises ProblemError, of its patterns, where it can't be worn so either.
    """
    try:
        return put_on(order)
    except ProblemError as error:
        if error.problem.code != "garment.unfit" or not any(one.edited_from for one in order.garments):
            raise
        logger.info("%s; it is put on as it was before its edits", error.problem.message)
        drape = _edited_again(order, put_on, progress)
        if drape is None:
            raise
        why = f"{error.problem.message.rstrip('.')}; so it was put on as it was before its edits, and edited while worn"
        drape.outfit = replace(drape.outfit, notes=(*drape.outfit.notes, f"garment: as it is now, {why}"))
        drape.edited = order.of_edited.worn_as
        drape.stay()
        return drape


def _edited_again(order: DrapeOrder, put_on: PutOn, progress: Progress) -> SolverDrape | None:
    """All that is ordered in its patterns, by way of those that they were edited from; None where that leads nowhere.

    The edits that a history keeps no more are a part of the first pattern that it keeps: where that can't be put on,
    there is the one that was uploaded.
    """
    drape = _tried(put_on, order, _at_first) or _tried(put_on, order, _as_uploaded)
    for garment in order.garments:
        runs = list(_runs([*garment.edited_from, garment.specification])) if garment.specification else []
        for k, run in enumerate(runs if garment.edited_from else []):
            for pattern in run:
                progress(MAKING_AGAIN, k / len(runs))
                drape = drape and (_in_pattern(drape, garment, pattern) or drape)
                if not order.over and (drape is None or drape.own.shown != pattern):  # as when that edit was made
                    drape = _tried(put_on, order, partial(_made_in, pattern=pattern)) or drape
        if drape is None or (garment.edited_from and _worn(drape, garment) != garment.specification):
            return None
    return drape


def _tried(put_on: PutOn, order: DrapeOrder, as_it_was: Callable[[GarmentOrder], GarmentOrder]) -> SolverDrape | None:
    """What is ordered, each garment as it was; None where it can't be put on so."""
    try:
        return put_on(order.wearing(tuple(as_it_was(one) for one in order.garments), order.edited))
    except (ProblemError, PatternError, ValueError) as error:
        logger.info("%s", error)
        return None


def _at_first(garment: GarmentOrder) -> GarmentOrder:
    return _made_in(garment, garment.edited_from[0]) if garment.edited_from else garment


def _as_uploaded(garment: GarmentOrder) -> GarmentOrder:
    """Raises PatternError, or ValueError where its file is no JSON any more."""
    return _made_in(garment, json.loads(read_pattern_file(garment.pattern))) if garment.edited_from else garment


def _made_in(garment: GarmentOrder, pattern: Specification) -> GarmentOrder:
    """The garment of this pattern, in the fabric that it names."""
    fabric = named_fabric(pattern) or garment.fabric
    return replace(garment, specification=made_of(pattern, fabric), fabric=fabric, edited_from=())


def _runs(patterns: list[Specification]) -> Iterator[tuple[Specification, Specification]]:
    """The first and the last of patterns in a row that one mesh can serve: from any to any other of them a shape
    goes at once."""
    number, numbered = 0, [(0, patterns[0])]
    for before, after in pairwise(patterns):
        number += difference(parsed(before), parsed(after)) is not None
        numbered.append((number, after))
    for _, run in groupby(numbered, key=lambda one: one[0]):
        every = [pattern for _, pattern in run]
        yield every[0], every[-1]


def _in_pattern(drape: SolverDrape, garment: GarmentOrder, pattern: Specification) -> SolverDrape | None:
    """What is worn with the garment in this pattern, from where it is worn; None where that can't be."""
    if _worn(drape, garment) == pattern:
        return drape
    drape.edit_garment(garment.worn_as)
    return _reshaped(drape, pattern) or _recut(drape, garment, pattern)


def _reshaped(drape: SolverDrape, pattern: Specification) -> SolverDrape | None:
    """The drape in the pattern's shape; None, and it is as before, where its mesh can't have that."""
    before = drape.own.shown
    if drape.reshape(pattern):
        return None
    _rest(drape)
    if drape.outgrown and before is not None:
        drape.reshape(before)
        _rest(drape)
        return None
    return drape


def _recut(drape: SolverDrape, garment: GarmentOrder, pattern: Specification) -> SolverDrape | None:
    """The pattern's own mesh put on where the garment is worn; None where it can't be."""
    try:
        cut = drape.cutting(pattern, named_fabric(pattern) or garment.fabric)()
    except ProblemError as error:
        logger.info("%s", error.problem.message)
        return None
    for made in drape.recut(cut):
        if made is not None:
            _rest(made)
            return made
    return None


def _rest(drape: SolverDrape) -> None:
    """Let the garment take on its shape, on the body that stands as it does."""
    edit = drape.own.edit
    way = 0.0 if edit is None else edit.ramp_seconds
    begun = drape.seconds
    while drape.seconds < begun + way + REST_SECONDS and not drape.outgrown:
        drape.advance(drape.stance, drape.seconds + LONGEST_MOVE)


def _worn(drape: SolverDrape, garment: GarmentOrder) -> Specification | None:
    return drape.garments[drape.names.index(garment.worn_as)].shown
