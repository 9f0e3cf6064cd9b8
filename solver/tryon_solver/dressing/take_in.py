"""A garment let out to go on over what is worn, and taken in again there.

Sewn in its own size over a shirt, a waist meets cloth that hangs wide: stitches would have to press it into folds
through the edge of an opening that is not closed yet. Sewn in a larger size it goes around first. Then its rest shape
shrinks to its own size, as slowly as stitches are drawn, under full contact and friction, and what is beneath gathers
in folds on the body: a shirt is tucked in. In which size on the way it was still borne by its fabric says how much room
there is. Into which folds it gathers depends on how wide the garment was before, and a single one that lies badly under
a waist presses the skin in as one does that is too tight; so what is refused all but on is let out otherwise. Ours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tryon_solver.dressing.fit import MOST_SQUEEZED, MOST_STRETCH, TightError
from tryon_solver.dressing.opening import girth_around, opening_as_drawn
from tryon_solver.dressing.outfit import Beneath, Worn
from tryon_solver.geometry.body_parts import find_trunk
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.reshape import reshape
from tryon_solver.simulation import Simulation

LET_OUT = (1.3, 1.2, 1.5)  # sizes, over its own, that are tried one after the other for sewing
ALL_BUT_ON = 1.05  # over its own, borne on the way by what is refused at rest: how the folds beneath lie decides
TAKING_IN_SECONDS = 1.0
LEAST_STEP = 1.01  # that the sizes of two frames are apart: what bore it on the way and not at rest misses so much


@dataclass(frozen=True)
class TakenIn:
    """Where a garment that was taken in and what is beneath have come to, x (N, 3) m, the body's surface (B, 3) m, and
    the smallest size on the way in which all fabrics bore it; infinite: in none."""

    x: np.ndarray
    surface: np.ndarray
    bears: float


def meets_more_cloth(panels: PanelMesh, beneath: Beneath, faces: np.ndarray) -> bool:
    """Is the upper opening of the pieces narrower than a garment `beneath`, as that hangs where it comes? Then it is
    sewn in no size of its own: what is seen of most that try is a seam that stays open, or one that cloth is caught in.
    `faces` (F, 3) are the body's."""
    opening = opening_as_drawn(panels, beneath.surface, faces)
    if opening is None:
        return False
    soles, middle = float(beneath.surface[:, 1].min()), find_trunk(beneath.surface, faces).middle
    garment, height = beneath.outfit.garment, soles + opening.height
    girths = [girth_around(beneath.x, garment.faces[layer.faces], height, middle) for layer in beneath.outfit.layers]
    return max(girths) > opening.girth


def take_in(
    simulation: Simulation,
    pose: Any,
    outermost: slice,
    let_out: float,
    progress: Callable[[str, float], None],
) -> TakenIn:
    """Let the rest shape of the faces `outermost`, which is `let_out` times their own, become that, the body still in
    `pose`."""
    let_out_shape = simulation.scene.garment
    step = simulation.settings.largest_step
    frames = round(TAKING_IN_SECONDS / step)
    bears = np.inf
    for k in range(1, frames + 1):
        progress("taking in", (k - 1) / frames)
        size = let_out + (1.0 - let_out) * k / frames
        reshape(simulation, scaled(let_out_shape, outermost, size / let_out))
        report = simulation.advance(pose, k * step)
        if _stretched(simulation) <= MOST_STRETCH and report.body_lag <= MOST_SQUEEZED:
            bears = min(bears, size)
    surface = simulation.body_positions().astype(np.float64)
    return TakenIn(simulation.cloth_positions().astype(np.float64), surface, bears)


def scaled(garment: Garment, faces: slice, factor: float) -> Garment:
    """The same with the rest shape of these faces so many times as large."""
    uv = garment.uv_corners.copy()
    uv[faces] *= factor
    return replace(garment, uv_corners=uv)


def _stretched(simulation: Simulation) -> float:
    """The largest stretch of a triangle over what its fabric bears."""
    limits = np.array([fabric.strain_limit for fabric in simulation.scene.fabric_of_face()])
    return float((simulation.stretches() / limits).max())


def no_room(error: TightError, one: Worn, beneath: Beneath, bears: float, faces: np.ndarray) -> TightError:
    """The refusal of a garment that goes on over what is `beneath` in no less than the size `bears`, over its own;
    infinite: in none that was tried. `faces` (F, 3) are the body's."""
    assert one.panels is not None
    over = " and ".join(worn.name for worn in beneath.outfit.worn)
    under = f"wear it under {over}"
    opening = opening_as_drawn(one.panels, beneath.surface, faces)
    if opening is None or opening.body_girth == 0:
        larger = f"a size {bears:.2f} times this one" if np.isfinite(bears) else "a larger size"
        return TightError(f"over {over}, {error.message}", error.place, f"Choose {larger}, or {under}")
    bearable = MOST_STRETCH * one.fabric.strain_limit * opening.girth
    layers = 2 * np.pi * (sum(worn.fabric.thickness for worn in beneath.outfit.worn) + 0.5 * one.fabric.thickness)
    least = max((opening.body_girth + layers) / bearable, 1.0)
    size = max(bears, LEAST_STEP) if np.isfinite(bears) else least
    what = f"over {over} its opening of {' and '.join(opening.pieces)}, of {100 * opening.girth:.1f} cm, "
    short = 1e3 * (size - 1.0) * opening.girth
    what += f"is too narrow by {'about' if np.isfinite(bears) else 'at least'} {np.ceil(short):.0f} mm"
    remedy = (
        f"Choose a size at least {np.ceil(100 * size) / 100:.2f} times this one, draw the opening that much wider and "
        "put elastic in it, or choose a fabric that stretches more"
    )
    if bearable >= opening.body_girth:
        remedy += f"; or {under}"
    return TightError(f"{what}: {error.message}", error.place, remedy)
