"""Dressing: place the pieces, sew them under full contact, weld the seams, let the garment settle.

The pieces start flat and clear of the body and of each other. Stitches draw all seams together in step while the same
solver that later runs the garment keeps every state free of penetration. Closed seams are welded, two vertices becoming
one, and gravity comes on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tryon_solver.body.on_device import WornBody
from tryon_solver.dressing.collar import slips_off
from tryon_solver.dressing.fit import (
    CrumpledError,
    DressingError,
    TightError,
    check_rest,
    close_seams,
    unforeseen_refused,
    weld_blocked,
    with_mesh,
    with_opening,
)
from tryon_solver.dressing.hang import hang
from tryon_solver.dressing.holding import holding
from tryon_solver.dressing.opening import Opening, laid_pieces, opening_as_drawn, upper_opening
from tryon_solver.dressing.outfit import Beneath, Outfit, Worn
from tryon_solver.dressing.stitching_on import stitch_stiffness, stitched_on
from tryon_solver.dressing.untangle import TangledError, untangle
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.placement import PlacementError, place_around
from tryon_solver.geometry.proximity import Surface
from tryon_solver.geometry.weld import WeldedMesh, unsewn, weld
from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import WORN, AirDrag, BodyContact, Effect, Scene, SelfContact, Sewing, StrainLimit
from tryon_solver.settings import Settings
from tryon_solver.simulation import Simulation, build
from tryon_solver.stepping.take import proven_free

Progress = Callable[[str, float], None]

SEWING_SECONDS = 1.2
FASTER_SECONDS = 0.8  # in which all is sewn once more where fabric was left crumpled at a seam: other folds form
SEWING_STEP = 1 / 60  # s, at most, of a garment alone; one over others is sewn in the steps that it is worn in: what is
# beneath leads its pieces, in fewer steps to the same place
CLOSING_SECONDS = 0.4  # seams held shut until they can be welded, at most
ROUNDS = 100  # of freeing what welding makes cross, hardly more than a triangle's corner
SEWING_DRAG = 2.0  # N s/m^3, so that pieces are drawn, not thrown
STILL_STIFFNESS = 1e5  # N/m and
STILL_HOLD = 1e3  # N: the skin of a body that stands still yields to no stitch; no fold closes on the pieces


def tell_nobody(_stage: str, _share: float) -> None:
    """The progress of a caller who does not ask for it."""


@dataclass(frozen=True)
class Dressed:
    """A worn garment: the running simulation, its welded mesh, the panels it came from, the pose it was put on in."""

    simulation: Simulation
    welded: WeldedMesh
    panels: PanelMesh
    pose: Any  # a Pose, or a Moment of a sequence

    def upper_opening(self) -> Opening | None:
        """The opening by which the garment hangs on the body as both are now, None where shoulders hold it."""
        scene, panels = self.simulation.scene, self.panels
        assert scene.body is not None
        x, skin = (at().astype(np.float64) for at in (self.simulation.cloth_positions, self.simulation.body_positions))
        held = holding(scene.effects, scene.garment, scene.fabric_of_garments()[0])
        return upper_opening(
            scene.garment, x, panels.panel_names, skin, scene.body.faces, held, laid_pieces(panels)
        )


def dress(
    panels: PanelMesh,
    body: WornBody,
    fabric: Fabric,
    settings: Settings | None = None,
    device: str = "cpu",
    effects: tuple[Effect, ...] = WORN,
    settle_seconds: float = 1.0,
    progress: Progress = tell_nobody,
) -> Dressed:
    """Put the garment on the body in the stance for that (its rest pose, or a frame) and let it settle.

    `progress(stage, share)` is called as it goes, share from 0 to 1. Raises PlacementError, GarmentError or
    DressingError with advice.
    """
    settings = settings or Settings()
    pose = body.start()
    surface = body.surface(pose)
    progress("placing", 0.0)
    clearance = settings.body_offset + 0.5 * fabric.thickness + settings.d_hat
    x_start = place(panels, surface, body.faces, clearance)
    joined = weld(panels)
    with unforeseen_refused("the pieces can't be sewn on this body"):
        try:
            sewn = sew(panels, joined, x_start, body, pose, fabric, settings, device, progress)
            garment = Garment(joined.vertex_of_corner, joined.uv_corners, joined.panel_of_face, joined.vertex_count)
            worn = (*effects, *stitched_on(panels, joined.welded_of_vertex, fabric))
            scene, tangled = Scene(garment, sewn.x, body, fabric, worn), sewn.fault is not None
            simulation = build(scene, settings, device, pose, sewn.surface, tangled)
            dressed = Dressed(simulation, joined, panels, pose)
            with told_as(sewn.fault):
                if tangled:
                    untangle(simulation, rounds=ROUNDS)
                hang(simulation, pose, dressed.upper_opening(), holding(effects, garment, fabric))
                settle(simulation, pose, settle_seconds, progress)
                check_rest(simulation, panels.panel_names)
        except DressingError as error:
            if too_large := slips_off(panels, surface, body.faces):
                raise too_large from error
            if isinstance(error, TightError):
                held = holding(effects, joined.garment(), fabric)
                told = with_opening(error, opening_as_drawn(panels, surface, body.faces, held))
                told = with_mesh(told, fabric, joined.garment().mean_edge_length())
                if told is not error:
                    raise told from error
            raise
    progress("dressed", 1.0)
    return dressed


def place(
    panels: PanelMesh, surface: np.ndarray, faces: np.ndarray, clearance: float, beneath: tuple[Surface, ...] = ()
) -> np.ndarray:
    """As place_around(), whatever the numbers are. Raises PlacementError."""
    try:
        return place_around(panels, surface, faces, clearance, beneath)
    except PlacementError:
        raise
    except (ValueError, IndexError, ZeroDivisionError) as error:  # of numbers that no standing body has
        remedy = "Give a body that stands upright on y = 0 over x = z = 0, faces +Z and holds its arms away from itself"
        raise PlacementError(f"the pieces find no place around this body ({error})", "body", remedy) from error


@contextmanager
def told_as(fault: CrumpledError | None) -> Iterator[None]:
    """What can't be worn because of a fault that was there before is refused for that, not for what came of it."""
    try:
        yield
    except (DressingError, TangledError) as error:
        if fault is None:
            raise
        raise fault from error


def settle(simulation: Simulation, pose: Any, seconds: float, progress: Progress) -> None:
    """Let a garment that was just put on come to rest, for `seconds` with the body still in `pose`."""
    step = simulation.settings.largest_step
    frames, begun = round(seconds / step), simulation.state.time
    for k in range(frames):
        progress("settling", k / frames)
        simulation.advance(pose, begun + (k + 1) * step)
    simulation.candidates.begin_anew()


@dataclass(frozen=True)
class Sewn:
    """A garment whose seams were closed: its welded vertices x (N, 3) m, the surface's (B, 3) m, why they may touch or
    cross, if that is so, and where what is worn beneath has come to, (U, 3) m."""

    x: np.ndarray
    surface: np.ndarray
    fault: CrumpledError | None
    beneath: np.ndarray


def sew(
    panels: PanelMesh,
    joined: WeldedMesh,
    x_start: np.ndarray,
    body: WornBody,
    pose: Any,
    fabric: Fabric,
    settings: Settings,
    device: str,
    progress: Progress,
    beneath: Beneath | None = None,
) -> Sewn:
    """Close all seams under contact. Raises DressingError for one that stays wide open, or open under tension.

    Fabric that was left crumpled at a seam is sewn once more, faster; not where that is taut and goes on over what is
    `beneath`, for then it is let out.
    """

    def in_time(seconds: float) -> Sewn:
        return _sew_in(seconds, panels, joined, x_start, body, pose, fabric, settings, device, progress, beneath)

    sewn = in_time(SEWING_SECONDS)
    let_out = beneath is not None and isinstance(sewn.fault, TightError)
    if isinstance(sewn.fault, CrumpledError) and not let_out:
        sewn = in_time(FASTER_SECONDS)
    if isinstance(sewn.fault, TightError):
        raise sewn.fault
    return sewn


def _sew_in(
    seconds: float,
    panels: PanelMesh,
    joined: WeldedMesh,
    x_start: np.ndarray,
    body: WornBody,
    pose: Any,
    fabric: Fabric,
    settings: Settings,
    device: str,
    progress: Progress,
    beneath: Beneath | None,
) -> Sewn:
    """As sew(), the stitches drawn together in that time [s]."""
    corners = panels.faces
    pieces = Garment(
        corners,
        panels.uv[corners],
        joined.panel_of_face,
        len(panels.uv),
        group=joined.welded_of_vertex,
    )
    first = 0 if beneath is None else len(beneath.x)
    stitches = Sewing(first + panels.stitches, stitch_stiffness(fabric))
    own = Worn("", pieces, fabric, panels.panel_names, panels, unsewn(panels))
    effects = (BodyContact(), SelfContact(), StrainLimit(), AirDrag(SEWING_DRAG), stitches)
    if beneath is None:
        surface, scene = None, Outfit((own,)).scene(x_start, body, effects)
    else:
        surface, every = beneath.surface, beneath.outfit.with_outermost(own)
        scene = every.scene(np.vstack([beneath.x, x_start]), body, (*effects, beneath.held()))
    settings = replace(
        settings,
        largest_step=settings.largest_step if beneath is not None else min(settings.largest_step, SEWING_STEP),
        skin_stiffness=STILL_STIFFNESS,
        skin_hold=STILL_HOLD,
    )
    simulation = build(scene, settings, device, pose, surface)
    share = next(c for c in simulation.plan.contributions if c.name == "sewing").values["share"]
    drawn = round(seconds / settings.largest_step)
    frames = drawn + round(CLOSING_SECONDS / settings.largest_step)
    for k in range(1, frames + 1):
        progress("sewing", (k - 1) / frames)
        share.fill_(max(0.0, 1.0 - k / drawn))
        simulation.advance(pose, k * settings.largest_step)
        if drawn <= k < frames and (sewn := _if_closed(simulation, panels, joined, fabric, first)) is not None:
            return sewn
    return _welded(simulation, panels, joined, fabric, first)


def _if_closed(
    simulation: Simulation, panels: PanelMesh, joined: WeldedMesh, fabric: Fabric, first: int
) -> Sewn | None:
    """`_welded` where all seams are closed and free by now; None where they are to be held shut longer."""
    try:
        sewn = _welded(simulation, panels, joined, fabric, first)
    except DressingError:
        return None
    return sewn if sewn.fault is None else None


def _welded(simulation: Simulation, panels: PanelMesh, joined: WeldedMesh, fabric: Fabric, first: int) -> Sewn:
    """The pieces as they are, behind the `first` vertices, of what is beneath, welded. Raises as close_seams."""
    under, x = np.split(simulation.cloth_positions().astype(np.float64), [first])
    stretches = simulation.stretches()[-len(panels.faces) :]
    x_welded, fault = close_seams(panels, joined, fabric, stretches, x)
    way = np.vstack([np.zeros_like(under), x_welded[joined.welded_of_vertex] - x])
    if fault is None and not proven_free(simulation, way):
        fault = weld_blocked(panels, joined, fabric, stretches, x)
    return Sewn(x_welded, simulation.body_positions().astype(np.float64), fault, under)
