"""Damping within the fabric, proportional to its stiffness, by a matrix that stands still during the step.

Force -beta K v with v = (x - x_start)/dt: stiffness-proportional (Rayleigh) damping, which takes pi f beta of critical
from a mode of frequency f. K is the constant bending matrix and, at the step's start, what of the membrane's stiffness
resists a change of strain, from where each triangle turns to by its velocities (materials/strain_rate.py). So the force
is the gradient of a potential of the step,

    D(x) = beta/(2 dt) (x - x_start)^T K_bending (x - x_start) + beta/(2 dt) sum A (F - R F0) : K_strain (F - R F0),

convex in x, whatever the cloth does: a matrix taken where the step ends follows cloth that buckles, and such a step
need not have a solution (METHOD.md section 18). The strain limit has no part in K: damped, it would hold fast sleeves
back. It acts in the correction (stepping/correct.py): projective dynamics' constant matrix would resist turning.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.constant_matrices import Term
from tryon_solver.linalg.lanes import lanes_of, shares_of, sum_of_lanes
from tryon_solver.linalg.launch import launch
from tryon_solver.materials import strain_rate
from tryon_solver.materials.triangle_hessian import hessians_of
from tryon_solver.plan import Contribution
from tryon_solver.scene import FabricDamping
from tryon_solver.state import State

wp.set_module_options({"enable_backward": False})


@wp.kernel
def add_rate_kernel(
    columns: wp.array2d(dtype=wp.int32),
    weights: wp.array2d(dtype=wp.float32),
    scale: float,
    dt: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    lanes: int,
    y_out: wp.array(dtype=wp.vec3),
):
    """y += scale S (x - x_start)/dt of the bending's matrix S, as in EllMatrix, each row shared by `lanes` threads
    (linalg/lanes.py)."""
    row = wp.tid() // lanes
    lane = wp.tid() % lanes
    total = wp.vec3()
    if row < columns.shape[0]:
        for k in range(lane, columns.shape[1], lanes):
            j = columns[row, k]
            total += weights[row, k] * (x[j] - x_start[j])
    total = wp.vec3(sum_of_lanes(total[0]), sum_of_lanes(total[1]), sum_of_lanes(total[2]))
    if lane == 0 and row < columns.shape[0]:
        y_out[row] = y_out[row] + scale * total / dt[0]


def bind(spec: FabricDamping, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec of 0 is idle."""
    rest, device = context.rest, context.device
    scene = context.scene
    per_face = scene.of_fabrics("k_warp", "k_weft", "k_shear")
    stiffness: wp.array = wp.array(per_face.astype(np.float32), dtype=wp.vec3, device=device)
    frozen = hessians_of(rest)  # beta/dt K of the membrane, over each triangle's dF [N m]
    x_start = wp.zeros(scene.garment.vertex_count, dtype=wp.vec3, device=device)  # m, where the step starts
    turned = wp.zeros((rest.face_count, 2), dtype=wp.vec3, device=device)  # R F0 - F0
    bent = context.bending

    def start_step(state: State) -> None:
        wp.copy(x_start, state.x_start, count=len(x_start))
        inputs = [rest.faces, rest.gradients, rest.area, stiffness, spec.time, state.dt, x_start, state.v]
        launch(strain_rate.strain_matrix_kernel, rest.face_count, inputs, [frozen, turned], device=device)

    def project(x: wp.array, corner_gradient: wp.array) -> None:
        inputs = [rest.faces, rest.gradients, frozen, x_start, x, turned]
        launch(strain_rate.project_kernel, rest.face_count, inputs, [corner_gradient], device=device)

    def add_triangle_hessian(_: wp.array, hessians: wp.array) -> None:
        strain_rate.add_hessians(frozen, hessians)

    def add_bending_gradient(state: State, x: wp.array, gradient: wp.array) -> None:
        assert bent is not None
        rows = bent.rows
        lanes = lanes_of(str(device))
        inputs = [rows.columns, rows.weights, spec.time, state.dt, x, state.x_start, lanes]
        launch(add_rate_kernel, shares_of(rows.row_count, lanes), inputs, [gradient], device=device)

    return Contribution(
        "fabric_damping",
        start_step=start_step,
        project_in_correction=project,
        add_velocity_gradient_in_correction=None if bent is None else add_bending_gradient,
        add_triangle_hessian=add_triangle_hessian,
        rate_stiffness=None if bent is None else Term(bent.matrix, spec.time, rate=True),
    )
