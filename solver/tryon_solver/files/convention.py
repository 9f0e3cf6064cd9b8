"""In which unit and with which axis up a mesh file was written: found from what it holds, and always said.

A file of a mesh seldom says either. Both are found from evidence, and where the evidence is silent or contradicts
itself the file is refused with the question to be answered, never guessed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tryon_solver.files.raw_mesh import MeshFileError

UNITS: dict[str, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Metres in one unit."""
AXES = ("y", "z")

HUMAN = (1.0, 2.3)  # m, largest extent of a body: its height, or its span with the arms out; no two units fit both
FLAT = 0.75  # a body is less deep than this share of its other extents
TALL = 1.3  # a body whose height is over this many times its other extents stands along that axis
ON_FLOOR = 0.06  # share of the extent by which the lowest point may miss zero and still be said to stand on it
GARMENT_AREA = (0.1, 12.0)  # m^2 of fabric
GARMENT_REACH = 0.45  # m, from the skin to a garment's furthest vertex, but for a few
REACHING = 0.98  # share of the vertices that must be so near
CLEARLY_NEARER = 0.5  # one reading is taken when its median distance to the skin is below this share of the others'


@dataclass(frozen=True)
class Convention:
    """A file's unit and upward axis, and how each is known."""

    unit: str
    up: str
    because: str

    @property
    def metres_per_unit(self) -> float:
        return UNITS[self.unit]

    def apply(self, vertices: np.ndarray) -> np.ndarray:
        """(..., 3) m, Y up, from the file's units and axes. Z up: x stays, z becomes y, y becomes -z."""
        placed = np.asarray(vertices, np.float64) * UNITS[self.unit]
        if self.up == "z":
            placed = np.stack([placed[..., 0], placed[..., 2], -placed[..., 1]], axis=-1)
        return placed

    def describe(self) -> str:
        """For people."""
        return f"{self.unit}, {self.up.upper()} up ({self.because})"


@dataclass(frozen=True)
class Told:
    """What is known before the vertices are looked at: by the user or by the format; None where nothing is."""

    unit: str | None = None
    up: str | None = None
    source: str = "as told"


def refuse_unknown(told: Told, name: str) -> None:
    """Raises MeshFileError when a unit or an axis is told that is none of those that are known."""
    if told.unit is not None and told.unit not in UNITS:
        remedy = f"Say one of {', '.join(UNITS)} with --units"
        raise MeshFileError(f"{told.unit!r} is no unit that is known", name, remedy)
    if told.up is not None and told.up not in AXES:
        remedy = "Turn it so that y or z is up, and say which with --up"
        raise MeshFileError(f"{told.up!r} can't be up, only {' or '.join(AXES)} can", name, remedy)


GLTF = Told("m", "y", "as glTF prescribes")


def find_for_body(vertices: np.ndarray, told: Told, name: str) -> Convention:
    """Unit and up of a human body from its vertices (V, 3) in file units.

    Raises MeshFileError when the evidence does not decide, or what is told is not known.
    """
    refuse_unknown(told, name)
    extent = np.ptp(vertices, axis=0)
    largest = float(extent.max())
    up, why_up = (told.up, told.source) if told.up else _up_of_body(vertices, name)
    fitting = [unit for unit, size in UNITS.items() if HUMAN[0] <= largest * size <= HUMAN[1]]
    if told.unit is not None:
        size = largest * UNITS[told.unit]
        if told.unit not in fitting:
            others = f"; in {fitting[0]} it would be {largest * UNITS[fitting[0]]:.2f} m" if fitting else ""
            raise MeshFileError(
                f"in {told.unit} ({told.source}) the body's largest extent is {size:.3g} m, no human's{others}",
                name,
                f"Say the unit with --units ({', '.join(UNITS)}), or scale the export",
            )
        return Convention(told.unit, up, f"unit {told.source}, {size:.2f} m large; up {why_up}")
    if len(fitting) != 1:
        raise MeshFileError(
            f"the body's largest extent is {largest:.4g} units, which is a human's {HUMAN[0]} to {HUMAN[1]} m in no "
            "unit we know",
            name,
            f"Scale the export to the size of a human in one of: {', '.join(UNITS)}",
        )
    unit = fitting[0]
    return Convention(unit, up, f"its largest extent, {largest:.4g} units, is {largest * UNITS[unit]:.2f} m; {why_up}")


def _up_of_body(vertices: np.ndarray, name: str) -> tuple[str, str]:
    """The axis along which the body stands, and the evidence."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    extent = high - low
    y, z = extent[1], extent[2]
    votes: list[tuple[str, str]] = []
    if min(y, z) < FLAT * max(y, z) and min(y, z) < FLAT * extent[0]:
        deep, stands = ("z", "y") if z < y else ("y", "z")
        votes.append((stands, f"it is least deep along {deep}"))
    if max(y, z) > TALL * min(y, z) and max(y, z) > TALL * extent[0]:
        stands = "y" if y > z else "z"
        votes.append((stands, f"it is tallest along {stands}"))
    on_floor = [axis for axis, k in (("y", 1), ("z", 2)) if abs(low[k]) < ON_FLOOR * max(extent[k], 1e-12)]
    if len(on_floor) == 1:
        votes.append((on_floor[0], f"it stands on {on_floor[0]} = 0"))
    axes = {axis for axis, _ in votes}
    if len(axes) != 1:
        why = "; ".join(reason for _, reason in votes) or "its extents say nothing"
        raise MeshFileError(f"which axis is up can't be told ({why})", name, "Say it with --up y or --up z")
    return votes[0][0], ", ".join(reason for _, reason in votes)


def find_for_garment(
    vertices: np.ndarray, faces: np.ndarray, skin: np.ndarray, told: Told, body: Convention | None, name: str
) -> Convention:
    """Unit and up of a garment that lies where the body is.

    `vertices` (V, 3) in file units, `faces` (F, 3); `skin` (B, 3) m the body's vertices in the pose it comes in; `body`
    the convention of the body's own file, tried first. Raises MeshFileError when no reading, or more than one, puts the
    garment on the body, or what is told is not known.
    """
    refuse_unknown(told, name)
    near = cKDTree(skin)
    readings: list[tuple[Convention, float]] = []
    tried: list[str] = []
    for unit in (told.unit,) if told.unit else UNITS:
        for up in (told.up,) if told.up else AXES:
            reading = Convention(unit, up, told.source)
            placed = reading.apply(vertices)
            corners = placed[faces]
            area = 0.5 * np.linalg.norm(
                np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
            )
            distance = near.query(placed, distance_upper_bound=GARMENT_REACH)[0]
            reaching = float(np.isfinite(distance).mean())
            tried.append(f"{unit}, {up.upper()} up: {area.sum():.3g} m^2, {100 * reaching:.0f} % of it at the body")
            if GARMENT_AREA[0] <= area.sum() <= GARMENT_AREA[1] and reaching >= REACHING:
                readings.append((reading, float(np.median(distance))))
    if not readings:
        few = tried if len(tried) <= 2 else [f"none of {', '.join(UNITS)} with Y or Z up does"]
        raise MeshFileError(
            f"the garment is not where the body is ({'; '.join(few)})",
            name,
            "Export it worn, in the place and pose of its body, together with that body; or say its unit and axis with "
            "--units and --up",
        )
    for reading, distance in readings:
        if body is not None and (reading.unit, reading.up) == (body.unit, body.up):
            return Convention(reading.unit, reading.up, f"as its body's; {1e3 * distance:.0f} mm from the skin")
    readings.sort(key=lambda pair: pair[1])
    best, distance = readings[0]
    if len(readings) > 1 and distance > CLEARLY_NEARER * readings[1][1]:
        names = " and ".join(f"{reading.unit}, {reading.up.upper()} up" for reading, _ in readings)
        raise MeshFileError(
            f"its unit and axis can't be told: {names} put it on the body", name, "Say them with --units and --up"
        )
    why = told.source if told.unit and told.up else "it lies on the body only so"
    return Convention(best.unit, best.up, f"{why}; {1e3 * distance:.0f} mm from the skin")
