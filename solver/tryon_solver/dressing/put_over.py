"""Putting a garment on over what is worn: its pieces are placed outside of that, sewn around it and welded, with all
that is worn simulated along; then all of it settles. Every state on the way is free of penetration.

What is put on later lies outside. What is beneath gives while the pieces are drawn together, without gravity; weak
springs keep it about where it hung.
"""

from __future__ import annotations

import numpy as np

from tryon_solver.dressing.dress import ROUNDS, Progress, place, settle, sew, tell_nobody, told_as
from tryon_solver.dressing.fit import check_rest, unforeseen_refused
from tryon_solver.dressing.outfit import Beneath, Worn, WornOutfit
from tryon_solver.dressing.untangle import untangle
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.proximity import Surface
from tryon_solver.geometry.weld import weld
from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import WORN, Effect
from tryon_solver.simulation import build


def put_over(
    worn: WornOutfit,
    name: str,
    panels: PanelMesh,
    fabric: Fabric,
    effects: tuple[Effect, ...] = WORN,
    settle_seconds: float = 1.0,
    progress: Progress = tell_nobody,
) -> WornOutfit:
    """Put the garment on over the outfit `worn`, which hangs on a body in the stance for that, and let all settle.

    The outfit that is given stays as it is. `name` is one that no other garment of it has. Raises PlacementError,
    GarmentError or DressingError with advice, as `dress`; ValueError for a name that comes twice.
    """
    before, pose = worn.simulation, worn.pose
    body, settings, device = before.scene.body, before.settings.by_budget(), before.device
    assert body is not None
    beneath = Beneath.of(worn)
    progress("placing", 0.0)
    thickest = max(fabric.thickness, *(one.fabric.thickness for one in worn.outfit.worn))
    clearance = settings.body_offset + 0.5 * thickest + settings.d_hat
    x_start = place(panels, beneath.surface, body.faces, clearance, surfaces_of(beneath))
    joined = weld(panels)
    with unforeseen_refused("the pieces can't be sewn over what is worn"):
        sewn = sew(panels, joined, x_start, body, pose, fabric, settings, device, progress, beneath)
        outfit = worn.outfit.with_outermost(Worn.of_pattern(name, panels, joined, fabric))
        scene = outfit.scene(np.vstack([sewn.beneath, sewn.x]), body, effects)
        simulation = build(scene, settings, device, pose, sewn.surface, tangled=sewn.fault is not None)
        with told_as(sewn.fault):
            if sewn.fault is not None:
                untangle(simulation, rounds=ROUNDS)
            settle(simulation, pose, settle_seconds, progress)
            check_rest(simulation, outfit.piece_names)
    progress("dressed", 1.0)
    return WornOutfit(outfit, simulation, pose)


def surfaces_of(beneath: Beneath) -> tuple[Surface, ...]:
    """Each garment of it as a surface that pieces are placed clear of."""
    garment, layers = beneath.outfit.garment, beneath.outfit.layers
    return tuple(Surface(beneath.x, garment.faces[layer.faces]) for layer in layers)
