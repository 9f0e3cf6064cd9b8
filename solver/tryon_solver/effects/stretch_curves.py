"""Measured stretch curves of the fabric (model in materials/stretch_curves.py).

They act in the correction, as the strain limit does: in projective dynamics' constant matrix their steepest piece would
stand at every strain, and slow every cycle down.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.materials import stretch_curves
from tryon_solver.materials.triangle_model import TriangleModel
from tryon_solver.plan import Contribution
from tryon_solver.scene import StretchCurves

NEVER = 1e30  # a strain that no piece begins at


def pieces_of(points: tuple[tuple[float, float], ...], count: int) -> np.ndarray:
    """(count, 4) strain, tension, tangent and work where each piece of the curve begins; rows that are left begin
    nowhere."""
    pieces = np.tile([NEVER, 0.0, 0.0, 0.0], (count, 1))
    strain, tension, work = 0.0, 0.0, 0.0
    for k, (next_strain, next_tension) in enumerate(points):
        pieces[k] = strain, tension, (next_tension - tension) / (next_strain - strain), work
        work += 0.5 * (tension + next_tension) * (next_strain - strain)
        strain, tension = next_strain, next_tension
    return pieces


def bind(spec: StretchCurves, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec without points is idle."""
    count = max(len(spec.warp), len(spec.weft))
    device = context.device
    rows = np.stack([pieces_of(points, count) for points in (spec.warp, spec.weft)])
    curves: wp.array = wp.array(rows, dtype=wp.vec4, device=device)
    of_fabrics = context.scene.of_fabrics
    stiffness: wp.array = wp.array(of_fabrics("k_warp", "k_weft", "k_shear"), dtype=wp.vec3, device=device)
    model = TriangleModel.build(stretch_curves, context.rest, [stiffness, curves])
    return Contribution(
        "stretch_curves",
        project_in_correction=model.project,
        add_triangle_hessian=model.add_triangle_hessian,
        energy=model.energy,
    )
