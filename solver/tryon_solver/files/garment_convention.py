"""In which unit and with which axis up a garment was written: in the one in which it is worn by its body.

Three things are evidence: where it lies, how much fabric it is, and whether its openings go around the body. Nearness
alone is none between two readings: a wide skirt in metres, read in feet, is a narrow one between the shins, and nearer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

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
OPENINGS = 24  # the longest are looked at, the others are holes in it
LOOKED_AT = 256  # vertices of each
AROUND = 0.7  # openings go around the body when the skin nearest to so many of their vertices is within them
CLEARLY_NEARER = 0.5  # one reading is taken when its median distance to the skin is below this share of the others'


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
    the convention of the body's own file, tried first. Raises MeshFileError when no reading, or more than one, puts the
    garment on the body, or what is told is not known.
    """
    as_body = body is not None and body.up == "x" and told.up in (None, "x")
    refuse_unknown(told, BODY_AXES if as_body else AXES, "--", name)
    near = cKDTree(skin)
    loops = _openings(vertices, faces)
    readings = []
    for unit in (told.unit,) if told.unit else UNITS:
        for up in (told.up,) if told.up else (*AXES, "x") if as_body else AXES:
            turns = body.turns if body is not None and up == "x" else 0
            over = body is not None and body.over
            convention = Convention(unit, up, told.source, turns, over)
            readings.append(_read(convention, vertices, faces, loops, skin, near))
    worn = [reading for reading in readings if reading.worn(told)]
    if not worn:
        both = told.unit and told.up
        few = "; ".join(_tried(reading) for reading in readings)
        why = few if len(readings) <= 2 else f"none of {', '.join(UNITS)} with Y or Z up does"
        remedy = "Export it worn, alone, in the place and pose of its body, which comes in a file of its own"
        other = "; or say another unit and axis" if both else "; or say its unit and axis with --units and --up"
        raise MeshFileError(f"the garment is not where the body is ({why})", name, remedy + other)
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


def _decide(worn: list[Reading]) -> tuple[list[Reading], str]:
    """The readings that the evidence leaves, and what that was."""
    if len(worn) == 1:
        return worn, "it lies on the body only so"
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
    within = []
    for loop in loops:
        some = loop[np.linspace(0, len(loop) - 1, min(len(loop), LOOKED_AT)).astype(int)]
        within.append(_within(skin[closest[some]], placed[loop]))
    return Reading(
        convention,
        float(area.sum()),
        float(np.median(distance)),
        float(distance.min()),
        float((distance <= GARMENT_REACH).mean()),
        float(np.concatenate(within).mean()) if within else 0.0,
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
    loops = [first[loop] for loop in boundary_loops(welded)]
    steps = [(vertices[loop] - vertices[np.roll(loop, 1)]) / size for loop in loops]
    lengths = [float(np.linalg.norm(step, axis=1).sum()) for step in steps]
    return [loops[k] for k in np.argsort(lengths)[::-1][:OPENINGS]]


def _within(points: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """(P,) which points lie within a loop (L, 3), seen along the loop's area vector: by the parity of the crossings of
    a ray with it (Shimrat, Algorithm 112, CACM 5 (1962) 434)."""
    middle = loop.mean(axis=0)
    size = max(float(np.abs(loop - middle).max()), np.finfo(float).tiny)
    spokes = (loop - middle) / size
    normal = np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0)
    along = np.linalg.svd(np.outer(normal, normal))[0][:, 1:]
    (x, y), (a, b) = ((points - middle) / size @ along).T, (spokes @ along).T
    c, d = np.roll(a, -1), np.roll(b, -1)
    over = (b[None] > y[:, None]) != (d[None] > y[:, None])
    run = np.where(b == d, 1.0, d - b)
    beyond = x[:, None] < a + (y[:, None] - b) * (c - a) / run
    return (over & beyond).sum(axis=1) % 2 == 1
