"""Drag of air at rest, linear in speed and implicit in time.

Force -c A v on a vertex of area A, with v = (x - x_start)/dt at the end of the step; its matrix is the diagonal c A/dt.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.launch import launch
from tryon_solver.plan import Contribution
from tryon_solver.scene import AirDrag
from tryon_solver.state import State

wp.set_module_options({"enable_backward": False})


@wp.kernel
def add_drag_kernel(
    coefficient: float,
    dt: wp.array(dtype=wp.float32),
    area: wp.array(dtype=wp.float32),
    x_start: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    gradient_out[i] = gradient_out[i] + coefficient / dt[0] * area[i] * (x[i] - x_start[i])


def bind(spec: AirDrag, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec of 0 is idle."""
    area = context.rest.spread

    def add_velocity_gradient(state: State, x: wp.array, gradient: wp.array) -> None:
        launch(
            add_drag_kernel,
            len(area),
            [spec.coefficient, state.dt, area, state.x_start, x],
            [gradient],
            device=context.device,
        )

    def diagonal(dt: float, around: np.ndarray) -> np.ndarray:
        return spec.coefficient / dt * around

    return Contribution("air_drag", add_velocity_gradient=add_velocity_gradient, diagonal=diagonal)
