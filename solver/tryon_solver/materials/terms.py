"""The materials every garment has, as contributions to the plan: membrane and bending."""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.geometry.garment import Garment
from tryon_solver.linalg.ell import EllMatrix, add_difference
from tryon_solver.materials import bending, membrane
from tryon_solver.materials.device import RestShape
from tryon_solver.materials.triangle_model import TriangleModel
from tryon_solver.plan import Contribution


def bind_membrane(garment: Garment, per_face: np.ndarray, rest: RestShape, device: str) -> Contribution:
    """Orthotropic membrane (materials/membrane.py) of k_warp, k_weft, k_shear (F, 3) N/m."""
    stiffness: wp.array = wp.array(per_face.astype(np.float32), dtype=wp.vec3, device=device)
    model = TriangleModel.build(membrane, rest, [stiffness])
    matrix = membrane.matrix(garment, per_face[:, 0], per_face[:, 1])
    return Contribution(
        "membrane",
        project=model.project,
        add_hessian=model.add_hessian,
        stiffness=matrix,
        energy=model.energy,
        at_rest=(rest.gradients, rest.area),
    )


def bind_bending(garment: Garment, k_bend: np.ndarray, device: str) -> Contribution | None:
    """Isometric bending (materials/bending.py) of k_bend (F,) N m; None when no triangle has any."""
    if not k_bend.any():
        return None
    matrix = bending.matrix(garment, k_bend)
    rows = EllMatrix.from_scipy(matrix, device)

    def add_gradient(x: wp.array, gradient: wp.array) -> None:
        add_difference(rows, x, gradient)

    def energy(x: wp.array) -> float:
        positions = x.numpy()[: garment.vertex_count].astype(np.float64)
        return 0.5 * float((positions * (matrix @ positions)).sum())

    return Contribution(
        "bending",
        add_gradient=add_gradient,
        stiffness=matrix,
        constant=True,
        energy=energy,
        at_rest=(rows.columns, rows.weights),
    )
