"""Strain limit: the fabric stiffens beyond its largest principal stretch (model in materials/strain_limit.py).

It acts in the correction. In projective dynamics' constant matrix its weight, many times the fabric's own, would stand
there also while it is silent, and slow every cycle down to a standstill.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.materials.strain_limit import energy_kernel, hessian_kernel, project_kernel
from tryon_solver.plan import Contribution
from tryon_solver.scene import StrainLimit


def bind(spec: StrainLimit, context: BuildContext) -> Contribution | None:
    """None when the stiffness is zero."""
    if spec.stiffness == 0:
        return None
    rest, device = context.rest, context.device
    stiffness = wp.full(rest.face_count, spec.stiffness, dtype=wp.float32, device=device)
    limit = wp.full(rest.face_count, context.scene.fabric.strain_limit, dtype=wp.float32, device=device)
    energy_out = wp.zeros(rest.face_count, dtype=wp.float32, device=device)

    def project(x: wp.array, corner_gradient: wp.array) -> None:
        wp.launch(
            project_kernel,
            rest.face_count,
            [rest.faces, rest.gradients, rest.area, stiffness, limit, x],
            [corner_gradient],
            device=device,
        )

    def add_hessian(x: wp.array, rows: BlockRows) -> None:
        wp.launch(
            hessian_kernel,
            rest.face_count,
            [rest.faces, rest.gradients, rest.area, stiffness, limit, rows.slots, x],
            [rows.blocks],
            device=device,
        )

    def energy(x: wp.array) -> float:
        wp.launch(
            energy_kernel,
            rest.face_count,
            [rest.faces, rest.gradients, rest.area, stiffness, limit, x],
            [energy_out],
            device=device,
        )
        return float(energy_out.numpy().sum(dtype=np.float64))

    return Contribution(
        "strain_limit",
        project_in_correction=project,
        add_hessian=add_hessian,
        energy=energy,
    )
