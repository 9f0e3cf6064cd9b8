"""Strain limit: the fabric stiffens beyond its largest principal stretch (model in materials/strain_limit.py).

It acts in the correction. In projective dynamics' constant matrix its weight, many times the fabric's own, would stand
there also while it is silent, and slow every cycle down to a standstill.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.materials import strain_limit
from tryon_solver.materials.triangle_model import TriangleModel
from tryon_solver.plan import Contribution
from tryon_solver.scene import StrainLimit


def bind(spec: StrainLimit, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec of 0 is idle."""
    rest, device = context.rest, context.device
    stiffness = wp.full(rest.face_count, spec.stiffness, dtype=wp.float32, device=device)
    limits = context.scene.of_fabrics("strain_limit")[:, 0]
    limit: wp.array = wp.array(limits, dtype=wp.float32, device=device)
    model = TriangleModel.build(strain_limit, rest, [stiffness, limit])
    return Contribution(
        "strain_limit",
        project_in_correction=model.project,
        add_triangle_hessian=model.add_triangle_hessian,
        energy=model.energy,
    )
