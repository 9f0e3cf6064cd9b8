"""Dressing: place the pieces, sew them under full contact, weld the seams, let the garment settle.

The pieces start flat and clear of the body and of each other. Stitches draw all seams together in step while the same
solver that later runs the garment keeps every state free of penetration. Closed seams are welded, two vertices becoming
one, and gravity comes on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose, skin
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.placement import place_around
from tryon_solver.geometry.weld import WeldedMesh, weld
from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import WORN, AirDrag, BodyContact, Effect, Scene, SelfContact, Sewing, StrainLimit
from tryon_solver.settings import Settings
from tryon_solver.simulation import Simulation, build
from tryon_solver.stepping.correct import proven_free

Progress = Callable[[str, float], None]

SEWING_SECONDS = 1.2
CLOSING_SECONDS = 0.4  # seams held shut before they are welded
SEWING_DRAG = 2.0  # N s/m^3, so that pieces are drawn, not thrown
CLOSED = 2e-3  # m, a seam further open than this can't be welded


def tell_nobody(_stage: str, _share: float) -> None:
    """The progress of a caller who does not ask for it."""


class DressingError(ValueError):
    """The garment could not be put on; the message says where and what to try."""


@dataclass(frozen=True)
class Dressed:
    """A worn garment: the running simulation, its welded mesh, the panels it came from, the pose it was put on in."""

    simulation: Simulation
    welded: WeldedMesh
    panels: PanelMesh
    pose: Pose


def dress(
    panels: PanelMesh,
    body: BodyModel,
    fabric: Fabric,
    settings: Settings | None = None,
    device: str = "cpu",
    effects: tuple[Effect, ...] = WORN,
    settle_seconds: float = 1.0,
    progress: Progress = tell_nobody,
) -> Dressed:
    """Put the garment on the body in its rest pose and let it settle.

    `progress(stage, share)` is called as it goes, share from 0 to 1. Raises PlacementError, GarmentError or
    DressingError with advice.
    """
    settings = settings or Settings()
    pose = Pose.rest(body)
    surface = skin(body, pose)
    progress("placing", 0.0)
    clearance = settings.body_offset + 0.5 * fabric.thickness + settings.d_hat
    x_start = place_around(panels, surface, body.faces, clearance)
    joined = weld(panels)
    x_sewn = sew(panels, joined, x_start, body, pose, fabric, settings, device, progress)
    garment = Garment(joined.vertex_of_corner, joined.uv_corners, joined.panel_of_face, joined.vertex_count)
    simulation = build(Scene(garment, x_sewn, body, fabric, effects), settings, device, pose)
    frames = round(settle_seconds / settings.largest_step)
    for k in range(frames):
        progress("settling", k / frames)
        simulation.advance(pose, (k + 1) * settings.largest_step)
    progress("dressed", 1.0)
    return Dressed(simulation, joined, panels, pose)


def sew(
    panels: PanelMesh,
    joined: WeldedMesh,
    x_start: np.ndarray,
    body: BodyModel,
    pose: Pose,
    fabric: Fabric,
    settings: Settings,
    device: str,
    progress: Progress,
) -> np.ndarray:
    """Close all seams under contact; returns the welded vertices' positions (N, 3) m."""
    corners = panels.faces
    pieces = Garment(
        corners,
        panels.uv[corners],
        joined.panel_of_face,
        len(panels.uv),
        group=joined.welded_of_vertex,
    )
    effects = (BodyContact(), SelfContact(), StrainLimit(), AirDrag(SEWING_DRAG), Sewing(panels.stitches))
    settings = replace(settings, largest_step=min(settings.largest_step, 1 / 60))
    simulation = build(Scene(pieces, x_start, body, fabric, effects), settings, device, pose)
    share = next(c for c in simulation.plan.contributions if c.name == "sewing").values["share"]
    frames = round((SEWING_SECONDS + CLOSING_SECONDS) / settings.largest_step)
    for k in range(frames):
        progress("sewing", k / frames)
        time = (k + 1) * settings.largest_step
        share.fill_(max(0.0, 1.0 - time / SEWING_SECONDS))
        simulation.advance(pose, time)
    x = simulation.cloth_positions().astype(np.float64)
    x_welded = close(panels, joined, x)
    if not proven_free(simulation, x_welded[joined.welded_of_vertex] - x):
        raise DressingError(
            "the closed seams could not be welded without touching other fabric: the garment is crumpled where it is "
            "sewn; use a shorter edge length, or a pattern that lies smoother there"
        )
    return x_welded


def close(panels: PanelMesh, joined: WeldedMesh, x: np.ndarray) -> np.ndarray:
    """(N, 3) m: each welded vertex at the mean of the vertices it joins.

    Raises DressingError naming the pieces of the seam that stayed widest open.
    """
    mean = joined.mean_of_vertices(x)
    gap = np.linalg.norm(x - mean[joined.welded_of_vertex], axis=1)
    worst = int(np.argmax(gap))
    if gap[worst] > CLOSED:
        a, b = next((s for s in panels.stitches if worst in s), (worst, worst))
        names = [panels.panel_names[panels.panel_of_vertex[v]] for v in (a, b)]
        raise DressingError(
            f"the seam between {names[0]} and {names[1]} stayed {2e3 * gap[worst]:.1f} mm open: the garment is too "
            "small for this body there, or its pieces start on the wrong side of each other; enlarge the pieces or "
            "move them"
        )
    return mean
