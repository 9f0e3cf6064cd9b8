"""In which unit and with which axis up a garment was written: in the one in which it is worn by its body.

Three things are evidence: where it lies, how much fabric it is, and whether its openings go around the body. Nearness
alone is none between two readings: a wide skirt in metres, read in feet, is a narrow one between the shins, and nearer.
What its owner tells is not doubted. What a format prescribes is, where the other axis would have it worn: exporters
forget to turn what they write.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from tryon_solver.files.around import goes_through, longest, within
from tryon_solver.files.convention import AXES, BODY_AXES, UNITS, Convention, Told, refuse_unknown
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.surface_repair import crowded_edges, three_corners, twins, weld_coincident

GARMENT_AREA = (0.1, 12.0)  # m^2 of fabric
USUAL_AREA = 0.2  # m^2: a garment has more, but for a band
TOLD_AREA = (0.002, 60.0)  # m^2, where the unit is told: a wristband, a bridal train
GARMENT_REACH = 0.45  # m, from the skin to a garment's furthest vertex, but for a few
REACHING = 0.98  # share of the vertices that must be so near
WIDE_REACHING = 0.5  # share of them that must be, of a garment whose openings go around the body: of a gown
LOOKED_AT = 256  # vertices of each
AROUND = 0.7  # openings go around the body when the skin nearest to so many of their vertices is within them
CLEARLY_NEARER = 0.5  # one reading is taken when its median distance to the skin is below this share of the others'


class NotOnBodyError(MeshFileError):
    """A garment that no reading puts on this body; another body may wear it."""


@dataclass(frozen=True)
class Reading:
    """One way to read a garment: `area` m^2 of fabric, `distance` m its median one to the skin, `nearest` m its
    smallest, `reaching` the share of it within GARMENT_REACH, `around` the share of its openings around the body."""

    convention: Convention
    area: float
    distance: float
    nearest: float
    reaching: float
    around: float

    @property
    def name(self) -> str:
        return f"{self.convention.unit}, {self.convention.up.upper()} up"

    def worn(self, told: Told) -> bool:
        """Whether it can be a garment on its body; what is told is not doubted but for no part of it being there."""
        low, high = TOLD_AREA if told.unit else GARMENT_AREA
        if not low <= self.area <= high:
            return False
        if told.unit and told.up:
            return self.nearest <= GARMENT_REACH
        return self.reaching >= REACHING or (self.goes_around and self.reaching >= WIDE_REACHING)

    @property
    def goes_around(self) -> bool:
        """Whether its openings go around the body."""
        return self.around >= AROUND

    def wide(self) -> bool:
        """Whether it might be a garment that stands away from the body."""
        return GARMENT_AREA[0] <= self.area <= GARMENT_AREA[1] and self.reaching >= WIDE_REACHING


def find_for_garment(
    vertices: np.ndarray, faces: np.ndarray, skin: np.ndarray, told: Told, body: Convention | None, name: str
) -> Convention:
    """Unit and up of a garment that lies where the body is.

    `vertices` (V, 3) in file units, `faces` (F, 3); `skin` (B, 3) m the body's vertices in the pose it comes in; `body`
    the convention of the body's own file, tried first. Raises NotOnBodyError when no reading puts the garment on the
    body, and MeshFileError when more than one does, or what is told is not known.
    """
    as_body = body is not None and body.up == "x" and told.up in (None, "x")
    refuse_unknown(told, BODY_AXES if as_body else AXES, "--", name)
    near = cKDTree(skin)
    loops = _openings(vertices, faces)
    over = body is not None and body.over
    readings = []
    for unit in (told.unit,) if told.unit else UNITS:
        for up in (told.up,) if told.up else (*AXES, "x") if as_body else AXES:
            turns = body.turns if body is not None and up == "x" else 0
            convention = Convention(unit, up, told.source, turns, over)
            readings.append(_read(convention, vertices, faces, loops, skin, near))
    if told.unit and told.up and told.source != Told().source:
        turned = replace(readings[0].convention, up="z" if told.up == "y" else "y")
        other = _read(turned, vertices, faces, loops, skin, near)
        if _worn_rather(other, readings[0], vertices, loops, skin):
            raise _turned(readings[0], other, name)
    worn = [reading for reading in readings if reading.worn(told)]
    if not worn:
        both = told.unit and told.up
        few = "; ".join(_tried(reading) for reading in readings)
        why = few if len(readings) <= 2 else f"none of {', '.join(UNITS)} with Y or Z up does"
        remedy = "Export it worn, alone, in the place and pose of its body, which comes in a file of its own"
        ask = "; or say its unit and axis with --units and --up"
        if both:
            also = [Convention(unit, up, "", 0, over) for unit in UNITS for up in AXES]
            better = [_read(convention, vertices, faces, loops, skin, near) for convention in also]
            better = [reading for reading in better if reading.worn(Told())]
            fits = [reading.convention for reading in (_decide(better)[0] if better else [])]
            named = " or ".join(f"--units {fit.unit} and --up {fit.up}" for fit in fits)
            ask = "; or say another unit and axis" + (f": it is worn with {named}" if named else "")
        raise NotOnBodyError(f"the garment is not where the body is ({why})", name, remedy + ask)
    for reading in worn:
        if body is not None and (reading.convention.unit, reading.convention.up) == (body.unit, body.up):
            return replace(reading.convention, because=f"as its body's; {1e3 * reading.distance:.0f} mm from the skin")
    left, why = _decide(worn)
    if len(left) == 1 and not (told.unit and told.up):  # it may be the shrunken copy of what it is, as that has slits
        size = left[0].convention.metres_per_unit
        left += [reading for reading in readings if reading.wide() and reading.convention.metres_per_unit > size]
    if len(left) > 1:
        names = " and ".join(reading.name for reading in left)
        raise MeshFileError(
            f"its unit and axis can't be told: {names} put it on the body", name, "Say them with --units and --up"
        )
    chosen = left[0]
    why = told.source if told.unit and told.up else why
    return replace(chosen.convention, because=f"{why}; {1e3 * chosen.distance:.0f} mm from the skin")


def find_by_size(vertices: np.ndarray, faces: np.ndarray, told: Told) -> Convention | None:
    """Unit and up of a garment whose body is not there: by what is told, or the first unit in which it has a garment's
    fabric, and Y; None where it has so much in no such unit.

    `vertices` (V, 3) in file units, `faces` (F, 3).
    """
    corners = vertices[faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    low, high = TOLD_AREA if told.unit else GARMENT_AREA
    for unit in (told.unit,) if told.unit else UNITS:
        if low <= area * UNITS[unit] ** 2 <= high:
            return Convention(unit, told.up or "y", f"{area * UNITS[unit] ** 2:.3g} m^2 of fabric")
    return None


def _worn_rather(
    other: Reading, prescribed: Reading, vertices: np.ndarray, loops: list[np.ndarray], skin: np.ndarray
) -> bool:
    """Whether a garment is worn by the body with the `other` axis up, and not as its format has it."""

    def held(reading: Reading) -> bool:
        placed = reading.convention.apply(vertices)
        return any(goes_through(skin, placed[loop]) for loop in loops)

    unit_told = Told(unit=other.convention.unit)
    if not other.worn(unit_told):
        return False
    if not prescribed.worn(unit_told):
        return prescribed.reaching < WIDE_REACHING or held(other)
    return held(other) and (other.distance <= CLEARLY_NEARER * prescribed.distance or not held(prescribed))


def _turned(prescribed: Reading, other: Reading, name: str) -> MeshFileError:
    unit, up = prescribed.convention.unit, prescribed.convention.up
    return MeshFileError(
        f"read {prescribed.convention.because}, {prescribed.name}, it is not worn by the body, and with "
        f"{other.convention.up.upper()} up it is ({_placed(prescribed)}; {_placed(other)})",
        name,
        f"Say --units {unit} and --up {other.convention.up}, or export it turned as its format has it; where it is "
        f"meant so, say --units {unit} and --up {up}",
    )


def _decide(worn: list[Reading]) -> tuple[list[Reading], str]:
    """The readings that the evidence leaves, and what that was."""
    if len(worn) == 1:
        return worn, "it is near the body only so"
    left = [reading for reading in worn if reading.goes_around] or worn
    if len(left) == 1:
        return left, "its openings go around the body only so"
    left = [reading for reading in left if reading.area >= USUAL_AREA] or left
    if len(left) == 1:
        return left, "it is as large as a garment on the body only so"
    left.sort(key=lambda reading: reading.distance)
    if not left[0].goes_around and left[0].distance <= CLEARLY_NEARER * left[1].distance:
        return left[:1], "it lies close to the body only so"
    return left, ""


def _tried(reading: Reading) -> str:
    return f"{reading.name}: {reading.area:.3g} m^2, {100 * reading.reaching:.0f} % of it at the body"


def _placed(reading: Reading) -> str:
    return f"{reading.name}: {100 * reading.reaching:.0f} % of it at the body, {1e3 * reading.distance:.0f} mm from it"


def _read(
    convention: Convention,
    vertices: np.ndarray,
    faces: np.ndarray,
    loops: list[np.ndarray],
    skin: np.ndarray,
    near: cKDTree,
) -> Reading:
    placed = convention.apply(vertices)
    corners = placed[faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    distance, closest = near.query(placed)
    around = []
    for loop in loops:
        some = loop[np.linspace(0, len(loop) - 1, min(len(loop), LOOKED_AT)).astype(int)]
        around.append(within(skin[closest[some]], placed[loop]))
    return Reading(
        convention,
        float(area.sum()),
        float(np.median(distance)),
        float(distance.min()),
        float((distance <= GARMENT_REACH).mean()),
        float(np.concatenate(around).mean()) if around else 0.0,
    )


def _openings(vertices: np.ndarray, faces: np.ndarray) -> list[np.ndarray]:
    """The longest loops of vertices around which there is no fabric; none where the surface is no manifold."""
    size = float(np.ptp(vertices[np.unique(faces)], axis=0).max())
    if not 0 < size < np.inf:
        return []
    joined = weld_coincident(vertices / size, faces)  # as a garment of a metre
    first = np.unique(joined, return_index=True)[1]
    welded = joined[faces]
    welded = welded[three_corners(welded)]
    welded = welded[~twins(welded)]
    if len(crowded_edges(welded)):
        return []
    return longest([first[loop] for loop in boundary_loops(welded)], vertices / size)
