"""In which unit and with which axis up a mesh file was written: found from what it holds, and always said.

A file of a mesh seldom says either. Both are found from evidence, and where the evidence is silent or contradicts
itself the file is refused with the question to be answered, never guessed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_solver.body.own_sides import FACINGS
from tryon_solver.files.facing import toes, unlikeness
from tryon_solver.files.raw_mesh import MeshFileError

UNITS: dict[str, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Metres in one unit."""
AXES = ("y", "z")
BODY_AXES = (*AXES, "x")
FORWARDS = ((0, 1), (-1, 0), (0, -1), (1, 0))  # along x and z: what none to three quarter turns bring to +Z

HUMAN = (0.5, 2.3)  # m, largest extent of a body: its height, or its span with the arms out
GROWN = (1.0, 2.1)  # m, the same of nearly all; no two units fit both
TOLD = (0.3, 3.0)  # m, the same of what is still believed where its owner says the unit
USUAL_UNITS = ("m", "cm", "mm")  # of two that fit somebody small or very tall
FLAT = 0.75  # a body is less deep than this share of its other extents
TALL = 1.3  # a body whose height is over this many times its other extents stands along that axis
ON_FLOOR = 0.06  # share of the extent by which the lowest point may miss zero and still be said to stand on it
MUCH_LIKER = 0.5  # sides are alike along an axis rather than x when they differ by less than this share as much


@dataclass(frozen=True)
class Convention:
    """A file's unit and upward axis, and how each is known."""

    unit: str
    up: str
    because: str
    turns: int = 0  # quarter turns about the upward axis, of a body that has X up
    over: bool = False  # the axis points down: half a turn about z follows
    others: tuple[str, ...] = ()  # units in which it would be a human's, too, the likelier first

    @property
    def metres_per_unit(self) -> float:
        return UNITS[self.unit]

    def apply(self, vertices: np.ndarray) -> np.ndarray:
        """(..., 3) m, Y up, from the file's units and axes.

        Z up: x stays, z becomes y, y becomes -z. X up: x becomes y, y becomes -x, z stays, as COLLADA has it; then the
        quarter turns, z to x; then, where the axis points down, half a turn about z.
        """
        placed = np.asarray(vertices, np.float64) * UNITS[self.unit]
        x, y, z = placed[..., 0], placed[..., 1], placed[..., 2]
        if self.up == "z":
            y, z = z, -y
        elif self.up == "x":
            x, y = -y, x
            for _ in range(self.turns):
                x, z = z, -x
        if self.over:
            x, y = -x, -y
        return np.stack([x, y, z], axis=-1)

    def direction(self, axis: str) -> np.ndarray:
        """(3,) the unit vector, Y up, of one of `FACINGS` in the file's axes."""
        return self.apply(np.array(FACINGS[axis])) / UNITS[self.unit]

    def describe(self) -> str:
        """For people."""
        return f"{self.unit}, {self.up.upper()} {'down' if self.over else 'up'} ({self.because})"


@dataclass(frozen=True)
class Told:
    """What is known before the vertices are looked at: by the user or by the format; None where nothing is.

    `facing`: the axis of its file, one of `FACINGS`, that a body faces along.
    """

    unit: str | None = None
    up: str | None = None
    source: str = "as told"
    facing: str | None = None


def refuse_unknown(told: Told, axes: tuple[str, ...], options: str, name: str) -> None:
    """Raises MeshFileError when a unit or an axis is told that is none of those that are known, `axes` of the latter.

    `options` is how those begin that tell it.
    """
    if told.unit is not None and told.unit not in UNITS:
        remedy = f"Say one of {', '.join(UNITS)} with {options}units"
        raise MeshFileError(f"{told.unit!r} is no unit that is known", name, remedy)
    if told.up is not None and told.up not in axes:
        remedy = f"Turn it so that y or z is up, and say which with {options}up"
        raise MeshFileError(f"{told.up!r} can't be up, only {' or '.join(axes)} can", name, remedy)


GLTF = Told("m", "y", "as glTF prescribes")


def find_for_body(vertices: np.ndarray, told: Told, name: str) -> Convention:
    """Unit and up of a human body from its vertices (V, 3) in file units.

    Of several units in which it is a human's it is the one in which it is grown up; if there is none, one of
    `USUAL_UNITS`; the others are told. Raises MeshFileError when the evidence does not decide, or what is told is not
    known.
    """
    refuse_unknown(told, BODY_AXES, "--body-", name)
    if told.facing is not None and told.facing not in FACINGS:
        remedy = f"Say one of {', '.join(FACINGS)} with --body-facing"
        raise MeshFileError(f"{told.facing!r} is no axis to face along", name, remedy)
    extent = np.ptp(vertices, axis=0)
    largest = float(extent.max())
    up, why_up = (told.up, told.source) if told.up else _up_of_body(vertices, name)
    if told.facing is not None and told.facing.lstrip("-") == up:
        raise MeshFileError(
            f"it can't face along {told.facing}, as told: {up} is up ({why_up})",
            name,
            "Say another axis with --body-facing, or which one is up with --body-up",
        )
    turns = 0
    if up == "x":
        turns, why_up = _turns_of_body(vertices, told, why_up, name)
    fitting = sorted(
        (unit for unit, size in UNITS.items() if _within(largest * size, HUMAN)),
        key=lambda unit: (not _within(largest * UNITS[unit], GROWN), unit not in USUAL_UNITS, -UNITS[unit]),
    )
    if told.unit is not None:
        size = largest * UNITS[told.unit]
        if not _within(size, TOLD if told.source == Told().source else HUMAN):
            others = f"; in {fitting[0]} it would be {largest * UNITS[fitting[0]]:.2f} m" if fitting else ""
            raise MeshFileError(
                f"in {told.unit} ({told.source}) the body's largest extent is {size:.3g} m, no human's{others}",
                name,
                f"Say the unit with --body-units ({', '.join(UNITS)}), scale the export, or export all of the person",
            )
        return Convention(told.unit, up, f"unit {told.source}, {size:.2f} m large; up {why_up}", turns)
    if not fitting:
        raise MeshFileError(
            f"the body's largest extent is {largest:.4g} units, which is a human's {HUMAN[0]} to {HUMAN[1]} m in no "
            "unit we know",
            name,
            f"Scale the export to the size of a human in one of: {', '.join(UNITS)}; or export all of the person",
        )
    unit, also = fitting[0], tuple(fitting[1:])
    if not _within(largest * UNITS[unit], GROWN):  # a figure may be larger or smaller than people
        also += tuple(u for u in USUAL_UNITS if u not in fitting and _within(largest * UNITS[u], TOLD))
    elif unit in USUAL_UNITS:
        also = tuple(other for other in also if other in USUAL_UNITS)  # an infant in feet is not worth a word
    because = f"its largest extent, {largest:.4g} units, is {largest * UNITS[unit]:.2f} m"
    if also:
        sizes = " or ".join(f"{largest * UNITS[other]:.2f} m in {other}" for other in also)
        because += f", and could also be {sizes}: --body-units tells"
    return Convention(unit, up, f"{because}; {why_up}", turns, others=also)


def _within(size: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= size <= limits[1]


def _up_of_body(vertices: np.ndarray, name: str) -> tuple[str, str]:
    """The axis along which the body stands, and the evidence."""
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
    deep = int(extent.argmin())
    others = [k for k in range(3) if k != deep]
    votes: list[tuple[str, str]] = []
    flat = extent[deep] < FLAT * extent[others].min()
    if flat and deep != 0:
        side = others[1]  # x is the first of them
        if unlikeness(vertices, side) < MUCH_LIKER * unlikeness(vertices, 0):
            votes.append(("x", f"its two sides along {'xyz'[side]} are alike"))
    tallest = int(extent.argmax())
    unlike = [unlikeness(vertices, k) for k in range(3)] if tallest == 0 else [1.0, 0.0, 0.0]
    wide = unlike[0] < MUCH_LIKER * min(unlike[1:])  # half a person's arms, which are left and right
    if extent[tallest] > TALL * np.delete(extent, tallest).max() and not wide:
        votes.append(("xyz"[tallest], f"it is tallest along {'xyz'[tallest]}"))
    on_floor = ["xyz"[k] for k in range(3) if abs(low[k]) < ON_FLOOR * max(extent[k], 1e-12)]
    if len(on_floor) == 1:
        votes.append((on_floor[0], f"it stands on {on_floor[0]} = 0"))
    if flat and deep != 0 and "x" not in [axis for axis, _ in votes]:  # where x is not its height it is its width
        votes.insert(0, ("y" if deep == 2 else "z", f"it is least deep along {'xyz'[deep]}"))
    axes = {axis for axis, _ in votes}
    if len(axes) != 1:
        why = "; ".join(reason for _, reason in votes) or "its extents say nothing"
        raise MeshFileError(f"which axis is up can't be told ({why})", name, "Say it with --body-up y, z or x")
    return votes[0][0], ", ".join(reason for _, reason in votes)


def _turns_of_body(vertices: np.ndarray, told: Told, why: str, name: str) -> tuple[int, str]:
    """How often to turn a body that has X up, and the evidence: nothing prescribes which way it faces."""
    reading = Convention(told.unit or "m", "x", "")
    forwards = reading.direction(told.facing) if told.facing else toes(reading.apply(vertices))
    if forwards is None:
        raise MeshFileError(
            f"X is up ({why}), and its feet don't tell which way it faces",
            name,
            "Say it with --body-facing, or turn it so that y or z is up",
        )
    turns = FORWARDS.index(tuple(forwards[[0, 2]].round().astype(int)))
    return turns, f"{why}; it faces {'along ' + told.facing + ', as told' if told.facing else 'where its toes point'}"
