"""Parameters of effects: what each may hold, said once, for whoever checks them and whoever draws a form of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Literal

LIST_MAX = 64  # entries; no garment has more lines, pieces or points of a curve
NAME_MAX = 200  # characters


class EffectError(ValueError):
    """What is asked of an effect can't be: what is wrong (`message`), where (`place`) and what to do (`remedy`)."""

    def __init__(self, message: str, place: str, remedy: str) -> None:
        super().__init__(f"{place}: {message}. {remedy}")
        self.message, self.place, self.remedy = message, place, remedy


@dataclass(frozen=True)
class Field:
    """One parameter. `about` says what it is, for people; `unit` "" for none; `live`: a running scene takes it up at
    once, where others have the effect bound anew; `needed`: its default is none; `idle`: where the effect does nothing,
    plain JSON, from which it comes in and to which it goes, None where it begins at once."""

    name: str
    about: str
    unit: str = ""
    live: bool = False
    needed: bool = False
    idle: Any = None

    @property
    def default(self) -> Any:
        """What it is where it is not told, plain JSON."""
        raise NotImplementedError

    def check(self, value: Any, place: str) -> Any:
        """The value as plain JSON. Raises EffectError."""
        raise NotImplementedError

    def described(self) -> dict[str, Any]:
        """The field as plain JSON: its `kind` and what that has."""
        told = {"name": self.name, "about": self.about, "unit": self.unit, "live": self.live}
        return {**told, "kind": KINDS[type(self)], "default": self.default}


@dataclass(frozen=True)
class Number(Field):
    """A number from `low` to `high`; None for none, where it may be `open`, and then that is what it is untold."""

    low: float = 0.0
    high: float = 1.0
    untold: float = 0.0
    open: bool = False
    whole: bool = False

    @property
    def default(self) -> float | None:
        if self.open:
            return None
        return int(self.untold) if self.whole else self.untold

    def check(self, value: Any, place: str) -> float | None:
        if value is None and self.open:
            return None
        kind = "a whole number" if self.whole else "a number"
        bounds = f"Give {kind} from {self.low:g} to {self.high:g}{self.unit and f' {self.unit}'}"
        bounds += ", or null for the usual" if self.open else ""
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or (self.whole and isinstance(value, float) and not value.is_integer()):  # nor inf, nor NaN
            raise EffectError(f"{told(value)} is not {kind}", place, bounds)
        if not self.low <= value <= self.high:  # also NaN
            raise EffectError(f"{told(value)} is outside {self.low:g} to {self.high:g}", place, bounds)
        return int(value) if self.whole else float(value)

    def described(self) -> dict[str, Any]:
        return {**super().described(), "low": self.low, "high": self.high, "open": self.open, "whole": self.whole}


@dataclass(frozen=True)
class Vector(Field):
    """Three numbers along x, y and z, no longer together than `longest`."""

    longest: float = 1.0
    untold: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def default(self) -> list[float]:
        return list(self.untold)

    def check(self, value: Any, place: str) -> list[float]:
        remedy = f"Give three numbers, x, y and z, of at most {self.longest:g} {self.unit} together"
        if isinstance(value, str) or not isinstance(value, Sequence) or len(value) != 3:
            raise EffectError(f"{told(value)} is not a list of three", place, remedy)
        axis = Number("", "", self.unit, low=-self.longest, high=self.longest)
        numbers = [axis.check(entry, f"{place}[{k}]") or 0.0 for k, entry in enumerate(value)]
        if math.hypot(*numbers) > self.longest * (1 + 1e-9):
            raise EffectError(f"it is {math.hypot(*numbers):.3g} {self.unit} long", place, remedy)
        return numbers

    def described(self) -> dict[str, Any]:
        return {**super().described(), "longest": self.longest}


@dataclass(frozen=True)
class Choice(Field):
    """One of some words, the first of them where none is told."""

    of: tuple[str, ...] = ()

    @property
    def default(self) -> str:
        return self.of[0]

    def check(self, value: Any, place: str) -> str:
        if value not in self.of:
            raise EffectError(f"there is no {told(value)}", place, choose_one_of(str(value), self.of))
        return str(value)

    def described(self) -> dict[str, Any]:
        return {**super().described(), "of": list(self.of)}


@dataclass(frozen=True)
class Coordinate(Number):
    """A number: where a spot lies along an axis of a piece of the pattern, `of` the piece that this field of the same
    row names. None until it is told."""

    axis: Literal["x", "y"] = "x"
    of: str = "panel"

    @property
    def default(self) -> None:
        return None

    def described(self) -> dict[str, Any]:
        return {**super().described(), "axis": self.axis, "of": self.of}


@dataclass(frozen=True)
class Panel(Field):
    """The name of a piece of the garment. Which there are, the garment says. `besides` are words that may stand in
    its place."""

    besides: tuple[str, ...] = ()

    @property
    def default(self) -> str:
        return ""

    def check(self, value: Any, place: str) -> str:
        if not isinstance(value, str) or not 0 < len(value) <= NAME_MAX:
            raise EffectError(f"{told(value)} is not the name of a piece", place, "Name a piece of the garment")
        return value

    def described(self) -> dict[str, Any]:
        return {**super().described(), "besides": list(self.besides)}


@dataclass(frozen=True)
class Panels(Field):
    """Names of pieces of the garment; none stands for all."""

    @property
    def default(self) -> list[str]:
        return []

    def check(self, value: Any, place: str) -> list[str]:
        one = Panel("", "")
        return [one.check(entry, f"{place}[{k}]") for k, entry in enumerate(as_list(value, place, "names of pieces"))]


@dataclass(frozen=True)
class Edges(Field):
    """Edges of the pattern, `{"panel": name, "edge": number}` each, one after the other along a line."""

    @property
    def default(self) -> list[dict[str, Any]]:
        return []

    def check(self, value: Any, place: str) -> list[dict[str, Any]]:
        entries = as_list(value, place, 'edges of the pattern, as {"panel": name, "edge": number}')
        if not entries:
            raise EffectError("it names no edge", place, "Name at least one edge of the pattern")
        return [checked(EDGE, entry, f"{place}[{k}]") for k, entry in enumerate(entries)]


@dataclass(frozen=True)
class Curve(Field):
    """Points (x, y) of a curve that rises from (0, 0); none stands for none."""

    @property
    def default(self) -> list[list[float]]:
        return []

    def check(self, value: Any, place: str) -> list[list[float]]:
        points = []
        for k, point in enumerate(as_list(value, place, "points [strain, tension]")):
            here = f"{place}[{k}]"
            if isinstance(point, str) or not isinstance(point, Sequence) or len(point) != 2:
                raise EffectError(f"{told(point)} is not a point", here, "Give [strain, tension in N/m]")
            strain = Number("", "", "", low=0.0, high=10.0).check(point[0], f"{here}[0]")
            tension = Number("", "", "N/m", low=0.0, high=1e6).check(point[1], f"{here}[1]")
            points.append([strain or 0.0, tension or 0.0])
        return points


@dataclass(frozen=True)
class Rows(Field):
    """A list of entries that have these fields each; one at least, where it is `needed`."""

    fields: tuple[Field, ...] = ()

    @property
    def default(self) -> list[dict[str, Any]]:
        return []

    def check(self, value: Any, place: str) -> list[dict[str, Any]]:
        entries = as_list(value, place, f"entries with {', '.join(field.name for field in self.fields)}")
        if self.needed and not entries:
            raise EffectError("there is none", place, f"Give at least one, with {self.fields[0].name}")
        return [checked(self.fields, entry, f"{place}[{k}]") for k, entry in enumerate(entries)]

    def described(self) -> dict[str, Any]:
        return {**super().described(), "fields": [field.described() for field in self.fields]}


KINDS: dict[type[Field], str] = {
    Number: "number",
    Coordinate: "coordinate",
    Vector: "vector",
    Choice: "choice",
    Panel: "panel",
    Panels: "panels",
    Edges: "edges",
    Curve: "curve",
    Rows: "rows",
}
EDGE = (
    Panel("panel", "the piece", needed=True),
    Number("edge", "its edge, counted from 0", low=0, high=10_000, whole=True, needed=True, untold=-1),
)


def checked(fields: Sequence[Field], value: Any, place: str) -> dict[str, Any]:
    """All fields by their names, plain JSON, those that are not told as they are by default. Raises EffectError."""
    known = [field.name for field in fields]
    if not isinstance(value, Mapping):
        fault = f"{told(value)} is not an object"
        raise EffectError(fault, place, f"Give an object with {', '.join(known) or 'nothing in it'}")
    for name in value:
        if name not in known:
            here = f"{place}.{name}"[:NAME_MAX]
            raise EffectError(f"there is no parameter {told(name)}", here, of_these(name, known))
    found = {}
    for field in fields:
        given = value.get(field.name, field.default)
        if field.name in value or field.needed:  # a default that is not enough is refused as if it had been given
            given = field.check(given, f"{place}.{field.name}")
        found[field.name] = given
    return found


def as_list(value: Any, place: str, what: str) -> Sequence[Any]:
    """A list of not too many entries. Raises EffectError."""
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise EffectError(f"{told(value)} is not a list", place, f"Give a list of {what}")
    if len(value) > LIST_MAX:
        raise EffectError(f"{len(value)} entries, more than {LIST_MAX}", place, "Give fewer")
    return value


def told(value: Any) -> str:
    """A value as an error tells it: not all of what somebody sent."""
    try:
        return f"{value!r:.60}"
    except ValueError:  # Python's own limit on the digits of an integer
        return "a number of thousands of digits"


def choose_one_of(given: str, known: Sequence[str]) -> str:
    """The remedy for a name that is none of those known: the closest, and all of them."""
    close = get_close_matches(given, known, n=1)
    return f"{f'Did you mean {close[0]!r}? ' if close else ''}Use one of {', '.join(known)}"


def of_these(given: Any, known: Sequence[str]) -> str:
    """`choose_one_of`, where there may be none to choose from."""
    return choose_one_of(str(given), known) if known else "Leave it out: it takes no parameters"
