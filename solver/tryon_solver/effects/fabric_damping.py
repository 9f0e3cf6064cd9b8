"""Damping within the fabric, proportional to its stiffness: a potential of the step over what has changed since its
start.

Stiffness-proportional (Rayleigh) damping, which takes pi f beta of critical from a mode of frequency f: of the membrane
beta/(2 dt) times what it would store in its strains' changes since the step's start (materials/strain_rate.py), of the
constant bending matrix K beta/(2 dt) (x - x_start)^T K (x - x_start). A potential, so that each step has a solution: a
force -beta K v with a matrix K taken where the step ends follows cloth that buckles, and need not have one (METHOD.md
section 18). The strain limit has no part in it: damped, it would hold fast sleeves back. Turning costs flat cloth
nothing; of bent cloth the bending matrix sees the mean curvature turn. It acts in the correction
(stepping/correct.py): projective dynamics' constant matrix would resist turning.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.constant_matrices import Term
from tryon_solver.linalg.launch import launch
from tryon_solver.materials import strain_rate
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
    y_out: wp.array(dtype=wp.vec3),
):
    """y += scale S (x - x_start)/dt of the bending's matrix S, as in EllMatrix."""
    row = wp.tid()
    total = wp.vec3()
    for k in range(columns.shape[1]):
        j = columns[row, k]
        total += weights[row, k] * (x[j] - x_start[j])
    y_out[row] = y_out[row] + scale * total / dt[0]


def bind(spec: FabricDamping, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec of 0 is idle."""
    rest, device = context.rest, context.device
    scene = context.scene
    per_face = scene.of_fabrics("k_warp", "k_weft", "k_shear")
    stiffness: wp.array = wp.array(per_face.astype(np.float32), dtype=wp.vec3, device=device)
    x_start = wp.zeros(scene.garment.vertex_count, dtype=wp.vec3, device=device)  # m, where the step starts
    dt = wp.zeros(1, dtype=wp.float32, device=device)  # s
    bent = context.bending

    def start_step(state: State) -> None:
        wp.copy(x_start, state.x_start, count=len(x_start))
        wp.copy(dt, state.dt)

    def launch_over_triangles(kernel: wp.Kernel, x: wp.array, out: wp.array) -> None:
        inputs = [rest.faces, rest.gradients, rest.area, stiffness, spec.time, dt, x_start, x]
        launch(kernel, rest.face_count, inputs, [out], device=device)

    def project(x: wp.array, corner_gradient: wp.array) -> None:
        launch_over_triangles(strain_rate.project_kernel, x, corner_gradient)

    def add_triangle_hessian(x: wp.array, hessians: wp.array) -> None:
        launch_over_triangles(strain_rate.hessian_kernel, x, hessians)

    def add_bending_gradient(state: State, x: wp.array, gradient: wp.array) -> None:
        assert bent is not None
        rows = bent.rows
        inputs = [rows.columns, rows.weights, spec.time, state.dt, x, state.x_start]
        launch(add_rate_kernel, rows.row_count, inputs, [gradient], device=device)

    return Contribution(
        "fabric_damping",
        start_step=start_step,
        project_in_correction=project,
        add_velocity_gradient_in_correction=None if bent is None else add_bending_gradient,
        add_triangle_hessian=add_triangle_hessian,
        rate_stiffness=None if bent is None else Term(bent.matrix, spec.time, rate=True),
    )
