"""Between which parameters an effect comes in and goes: with what acts in it at idle, where it does nothing.

An entry of a list, such as a line of elastic, comes and goes by itself; it is the same one before and after where all
is that a running scene can't take up. Of two that are on the same line, told from both sides of a seam, the one that
stays covers the one that goes: then nothing goes, and nothing comes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from tryon_solver.effect_words.fields import Field, Rows
from tryon_solver.effect_words.rules import Parameters, fixed
from tryon_solver.effect_words.table import BY_NAME

Covers = Callable[[Parameters, Parameters], bool]
"""Does the first of two entries act on all that the second one does, and in the same way?"""


def as_it_comes(name: str, parameters: Parameters, before: Parameters | None, covers: Covers) -> dict[str, Any]:
    """The effect's parameters as it is bound: what acted in it `before` as then, what is new at idle."""
    return _meeting(BY_NAME[name].fields, parameters, before, covers, theirs=True)


def as_it_goes(name: str, parameters: Parameters, after: Parameters | None, covers: Covers) -> dict[str, Any]:
    """The effect's parameters before another binding: what acts on in it `after` as now, what goes at idle."""
    return _meeting(BY_NAME[name].fields, parameters, after, covers, theirs=False)


def _meeting(
    fields: Sequence[Field], parameters: Parameters, other: Parameters | None, covers: Covers, theirs: bool
) -> dict[str, Any]:
    met = dict(parameters)
    for field in fields:
        if isinstance(field, Rows):
            rows = [] if other is None else other[field.name]
            met[field.name] = [
                _meeting(field.fields, row, _same_row(field.fields, row, rows, covers), covers, theirs)
                for row in parameters[field.name]
            ]
        elif field.idle is not None:
            shared = other if theirs else parameters
            met[field.name] = field.idle if other is None or shared is None else shared[field.name]
    return met


def _same_row(
    fields: Sequence[Field], row: Parameters, others: Sequence[Parameters], covers: Covers
) -> Parameters | None:
    own = fixed(fields, row)
    told = next((other for other in others if fixed(fields, other) == own), None)
    return told or next((other for other in others if covers(other, row)), None)
