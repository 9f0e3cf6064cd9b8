"""Dressing a garment that comes as a mesh, worn: free it where it lies, sew what is open, let it settle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tryon_solver.advice import allowed, percent
from tryon_solver.body.on_device import WornBody
from tryon_solver.dressing.dress import (
    CLOSING_SECONDS,
    SEWING_DRAG,
    SEWING_SECONDS,
    Progress,
    settle,
    tell_nobody,
)
from tryon_solver.dressing.fit import CLOSED, unforeseen_refused
from tryon_solver.dressing.stitching_on import stitch_stiffness
from tryon_solver.dressing.untangle import Freed, TangledError, untangle
from tryon_solver.files.mesh_garment import MeshGarment
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import WORN, AirDrag, BodyContact, Effect, Scene, SelfContact, Sewing, StrainLimit
from tryon_solver.settings import Settings
from tryon_solver.simulation import Simulation, build
from tryon_solver.stepping.take import proven_free

DRAWN_PER_SECOND = 0.05  # m/s at which the ends of a stitch near each other; a pattern's pieces come from further off
SOONEST = 0.2  # s, in which even a seam that is nearly closed is drawn together


@dataclass(frozen=True)
class DressedMesh:
    """A worn mesh garment: the running simulation, the pose it was put on in, and what was found on the way."""

    simulation: Simulation
    pose: Any  # a Pose, or a Moment of a sequence
    piece_names: tuple[str, ...]
    freed: Freed
    notes: tuple[str, ...]


def dress_mesh(
    garment: MeshGarment,
    body: WornBody,
    pose: Any,
    fabric: Fabric,
    settings: Settings | None = None,
    device: str = "cpu",
    effects: tuple[Effect, ...] = WORN,
    settle_seconds: float = 1.0,
    progress: Progress = tell_nobody,
) -> DressedMesh:
    """Put the garment on the body where it lies, with the body in `pose`, and let it settle.

    Raises MeshFileError naming triangles that can't be freed or sewn, or GarmentError or DressingError.
    """
    with unforeseen_refused("it can't be freed and sewn on this body"):
        return _dressed(garment, body, pose, fabric, settings or Settings(), device, effects, settle_seconds, progress)


def _dressed(
    garment: MeshGarment,
    body: WornBody,
    pose: Any,
    fabric: Fabric,
    settings: Settings,
    device: str,
    effects: tuple[Effect, ...],
    settle_seconds: float,
    progress: Progress,
) -> DressedMesh:
    progress("freeing", 0.0)
    if len(garment.stitches):
        x, freed, surface = _sew(garment, body, pose, fabric, settings, device, progress)
    else:
        x, freed, surface = garment.x, None, None
    sewn, _ = garment.sewn()
    simulation = build(Scene(sewn, x, body, fabric, effects), settings, device, pose, surface, tangled=True)
    again = _untangled(simulation, garment, progress)
    freed = freed or again
    settle(simulation, pose, settle_seconds, progress)
    progress("dressed", 1.0)
    report = simulation.reported
    rest = (
        f"at rest it is stretched by {percent(report.max_stretch)} at most ({allowed(fabric)}) and presses the skin in "
        f"by {1e3 * report.body_lag:.1f} mm at most"
    )
    return DressedMesh(simulation, pose, garment.piece_names, freed, (*garment.notes, freed.describe(), rest))


def sewing_seconds(garment: MeshGarment) -> float:
    """How long [s] the stitches of a garment take to be drawn to nothing: by the widest, where it lies."""
    ends = garment.x[garment.stitches]
    widest = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max(initial=0.0))
    return min(max(widest / DRAWN_PER_SECOND, SOONEST), SEWING_SECONDS)


def _untangled(simulation: Simulation, garment: MeshGarment, progress: Progress) -> Freed:
    try:
        return untangle(simulation, lambda share: progress("freeing", share))
    except TangledError as error:
        raise MeshFileError(
            f"the garment can't be freed: {error}",
            garment.places(error.faces),
            "Move these apart in the program the garment comes from, or simulate it there until nothing crosses",
        ) from error


def _sew(
    garment: MeshGarment,
    body: WornBody,
    pose: Any,
    fabric: Fabric,
    settings: Settings,
    device: str,
    progress: Progress,
) -> tuple[np.ndarray, Freed, np.ndarray]:
    """Draw the stitches together under contact; the joined vertices (N, 3) m, what was freed, the surface (B, 3) m."""
    stitches = Sewing(garment.stitches, stitch_stiffness(fabric))
    effects = (BodyContact(), SelfContact(), StrainLimit(), AirDrag(SEWING_DRAG), stitches)
    slow = replace(settings, largest_step=min(settings.largest_step, 1 / 60))
    simulation = build(Scene(garment.garment, garment.x, body, fabric, effects), slow, device, pose, tangled=True)
    freed = _untangled(simulation, garment, progress)
    share = next(c for c in simulation.plan.contributions if c.name == "sewing").values["share"]
    seconds = sewing_seconds(garment)
    frames = round((seconds + CLOSING_SECONDS) / slow.largest_step)
    for k in range(frames):
        progress("sewing", k / frames)
        time = (k + 1) * slow.largest_step
        share.fill_(max(0.0, 1.0 - time / seconds))
        simulation.advance(pose, time)
    x = simulation.cloth_positions().astype(np.float64)
    _, merged = garment.sewn()
    count = np.bincount(merged)
    mean = np.stack([np.bincount(merged, x[:, k]) / count for k in range(3)], axis=1)
    gap = np.linalg.norm(x - mean[merged], axis=1)
    worst = int(gap.argmax())
    if gap[worst] > CLOSED:
        there = np.flatnonzero((garment.garment.faces == worst).any(axis=1))
        raise MeshFileError(
            f"a stitch stayed {2e3 * gap[worst]:.1f} mm open: the garment is too small there for the body, or "
            "something lies between its two ends",
            garment.places(there),
            "Move the two sides of the seam towards each other",
        )
    if not proven_free(simulation, mean[merged] - x):
        raise MeshFileError(
            "the closed seams could not be joined without touching other fabric: it is crumpled where it is sewn",
            garment.source.name,
            "Bring the two sides of the seams nearer to each other",
        )
    return mean, freed, simulation.body_positions().astype(np.float64)
