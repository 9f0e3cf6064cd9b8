"""Fields of edits: what each may hold, said once in its type and checked whenever an edit is made.

An edit made in Python and one read from JSON pass the same checks, so none with a NaN or a boolean for a length exists.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Annotated, Any, get_type_hints

from tryon_solver.geometry.size import SIZE_MAX, SIZE_MIN
from tryon_solver.redesign.edit_error import EditError, choose_one_of
from tryon_solver.redesign.measures import NAMES

LENGTH_MAX = 2.0  # m; what is longer reaches from one end of a garment to the other
NAME_MAX = 200  # characters of a piece's name in an edit
INDEX_MAX = 10_000  # more than any pattern has edges or vertices

Check = Callable[[Any, str], Any]


def _told(value: Any) -> str:
    try:
        return f"{value!r:.60}"
    except ValueError:  # Python's own limit on the digits of an integer
        return "a number of thousands of digits"


def _number(low: float, high: float, unit: str) -> Check:
    bounds = f"Give a number from {low:g} to {high:g}{unit and f' {unit}'}"

    def check(value: Any, place: str) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise EditError(f"{_told(value)} is not a number", place, bounds)
        if not low <= value <= high:  # also NaN
            raise EditError(f"{_told(value)} is outside {low:g} to {high:g}{unit and f' {unit}'}", place, bounds)
        return float(value)

    return check


def _text(value: Any, place: str) -> str:
    if not isinstance(value, str) or len(value) > NAME_MAX:
        message = f"not a name of at most {NAME_MAX} characters"
        raise EditError(message, place, "Give the name of a piece of the pattern")
    return value


def _index(value: Any, place: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise EditError(f"{_told(value)} is not an index", place, "Give a whole number, counted from 0")
    if not 0 <= value <= INDEX_MAX:
        raise EditError("there is no such index", place, f"Give a whole number from 0 to {INDEX_MAX}")
    return value


def _boolean(value: Any, place: str) -> bool:
    if not isinstance(value, bool):
        raise EditError(f"{_told(value)} is neither true nor false", place, "Give true or false")
    return value


def _pair_of(check_one: Check, what: str) -> Check:
    def check(value: Any, place: str) -> tuple[Any, Any]:
        if isinstance(value, str) or not isinstance(value, Sequence) or len(value) != 2:
            raise EditError(f"not {what}", place, f"Give {what} as a list of two")
        return check_one(value[0], f"{place}[0]"), check_one(value[1], f"{place}[1]")

    return check


def _or_none(check_given: Check) -> Check:
    return lambda value, place: None if value is None else check_given(value, place)


def _measures(value: Any, place: str) -> dict[str, float]:
    if not isinstance(value, Mapping) or not value:
        raise EditError("no measures of a body", place, f"Give at least one of {', '.join(NAMES)}, in m")
    for name in value:
        if name not in NAMES:
            raise EditError(f"there is no measure {name!r:.60}", place, choose_one_of(f"{name}", NAMES))
    return {name: _measure(length, f"{place}.{name}") for name, length in value.items()}


_measure = _number(0.2, 3.0, "m")
_length = _number(-LENGTH_MAX, LENGTH_MAX, "m")
_coordinates = _pair_of(_number(-10.0, 10.0, "m"), "coordinates [x, y]")
_factor = _number(SIZE_MIN, SIZE_MAX, "")

Name = Annotated[str, _text]
Index = Annotated[int, _index]
Flag = Annotated[bool, _boolean]
Length = Annotated[float, _length]  # m, of either sign
Extent = Annotated[float, _number(1e-3, LENGTH_MAX, "m")]  # m, a size
Share = Annotated[float, _number(0.0, 1.0, "")]
Gathered = Annotated[float | None, _or_none(_number(0.25, 1.0, ""))]
Eased = Annotated[float | None, _or_none(_length)]  # m
Percent = Annotated[float | None, _or_none(_number(-30.0, 50.0, "%"))]
Angle = Annotated[float, _number(-180.0, 180.0, "degrees")]
Place = Annotated[tuple[float, float], _coordinates]  # m
Move = Annotated[tuple[float, float], _pair_of(_length, "a move [x, y]")]  # m
Line = Annotated[tuple[tuple[float, float], tuple[float, float]], _pair_of(_coordinates, "two points")]  # m
_factors = _pair_of(_factor, "factors [width, height]")
Factors = Annotated[tuple[float, float], _factors]
FactorsOrNone = Annotated[tuple[float, float] | None, _or_none(_factors)]
BodyOrNone = Annotated[Mapping[str, float] | None, _or_none(_measures)]  # measures.py


def checks_of(kind: type) -> dict[str, Check]:
    """The check of every field of an edit's class, by the field's name."""
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: hints[field.name].__metadata__[0] for field in fields(kind)}
