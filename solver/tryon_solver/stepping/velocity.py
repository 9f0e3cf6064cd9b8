"""Velocity of implicit Euler: what the step moved, over its time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.launch import launch

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})


@wp.kernel
def velocity_kernel(
    x: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    dt: wp.array(dtype=wp.float32),
    v_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    v_out[i] = (x[i] - x_start[i]) / dt[0]


def update_velocity(sim: Simulation) -> None:
    """v = (x - x_start)/dt [m/s]."""
    state = sim.state
    launch(velocity_kernel, sim.cloth_count, [state.x, state.x_start, state.dt], [state.v], device=sim.device)
