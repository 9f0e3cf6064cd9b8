"""The materials every garment has, as contributions to the plan: membrane and bending."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from tryon_solver.geometry.element_sum import ElementSum
from tryon_solver.geometry.garment import Garment
from tryon_solver.linalg.constant_matrices import Term
from tryon_solver.linalg.device_matrix import DeviceMatrix, ElementMatrix
from tryon_solver.linalg.ell import EllMatrix, add_difference, entry_places
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.near_far import take
from tryon_solver.materials import bending, membrane
from tryon_solver.materials.device import RestShape
from tryon_solver.materials.triangle_model import TriangleModel
from tryon_solver.plan import Contribution


@dataclass(frozen=True)
class BendingRows:
    """Bending's constant matrix [N/m], and as float32 rows."""

    matrix: DeviceMatrix
    rows: EllMatrix


def bind_membrane(garment: Garment, per_face: np.ndarray, rest: RestShape, device: str) -> Contribution:
    """Orthotropic membrane (materials/membrane.py) of k_warp, k_weft, k_shear (F, 3) N/m."""
    stiffness: wp.array = wp.array(per_face.astype(np.float32), dtype=wp.vec3, device=device)
    model = TriangleModel.build(membrane, rest, [stiffness])
    constant: wp.array = wp.array(per_face[:, :2], dtype=wp.vec2d, device=device)
    summed = garment.connectivity.triangle_sum
    matrix, reshape = matrix_over(summed, membrane.matrix_kernel, [rest.flat, constant], device)
    return Contribution(
        "membrane",
        project=model.project,
        add_triangle_hessian=model.add_triangle_hessian,
        stiffness=Term(matrix),
        energy=model.energy,
        reshape=reshape,
    )


def bind_bending(
    garment: Garment, k_bend: np.ndarray, rest: RestShape, device: str
) -> tuple[Contribution, BendingRows] | None:
    """Isometric bending (materials/bending.py) of k_bend (F,) N m, at a hinge the mean of its two triangles'; None when
    no triangle has any."""
    if not k_bend.any():
        return None
    found = garment.connectivity
    corners: wp.array = wp.array(found.hinge_corners, dtype=wp.int32, device=device)
    of_hinge: wp.array = wp.array(k_bend[garment.hinges()[:, 4:]].mean(axis=1), dtype=wp.float64, device=device)
    matrix, make = matrix_over(found.hinge_sum, bending.matrix_kernel, [rest.flat, corners, of_hinge], device)
    columns, places = entry_places(matrix.pattern)
    rows = EllMatrix.of_columns(columns, device)
    entries: wp.array = wp.array(places, dtype=wp.int32, device=device)

    def reshape() -> None:
        make()
        take(matrix.values, entries, rows.weights)

    def add_gradient(x: wp.array, gradient: wp.array) -> None:
        add_difference(rows, x, gradient)

    def energy(x: wp.array) -> float:
        positions = x.numpy()[: garment.vertex_count].astype(np.float64)
        return 0.5 * float((positions * (matrix.matrix() @ positions)).sum())

    contribution = Contribution(
        "bending",
        add_gradient=add_gradient,
        stiffness=Term(matrix, exact=True),
        energy=energy,
        reshape=reshape,
    )
    return contribution, BendingRows(matrix, rows)


def matrix_over(
    found: ElementSum, kernel: Any, inputs: list[wp.array], device: str
) -> tuple[DeviceMatrix, Callable[[], None]]:
    """The sum of the elements' matrices that `kernel` makes of `inputs`, zero yet, and what makes it of them."""
    summed = ElementMatrix.build(found.pattern, found.order, found.starts, device)
    entries = summed.entries

    def make() -> None:
        launch(kernel, len(entries) // found.width**2, inputs, [entries], device=device)
        summed.add_up()

    return summed.total, make
