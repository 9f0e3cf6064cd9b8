"""Inertial prediction: x_hat = x + dt v + dt^2 a_ext, from the positions at the start of the step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.launch import launch

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})


@wp.kernel
def predict_kernel(
    x_start: wp.array(dtype=wp.vec3),
    v: wp.array(dtype=wp.vec3),
    acceleration: wp.array(dtype=wp.vec3),
    time: wp.array(dtype=wp.float32),
    x_hat_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    dt = time[0]
    x_hat_out[i] = x_start[i] + dt * v[i] + dt * dt * acceleration[i]


def predict_positions(sim: Simulation) -> None:
    """Set `x_hat` (N,) m and what effects freeze for the step; remembers where the body's motion led as x_feasible."""
    state = sim.state
    wp.copy(state.x_feasible, state.x)
    for start_step in sim.stages.start_step:
        start_step(state)
    if sim.matrices.live is not None:
        sim.matrices.live.take_up()
    predict_as_frozen(sim)


def predict_as_frozen(sim: Simulation) -> None:
    """Set `x_hat`, and the matrices' `diagonal`, by what effects have frozen last."""
    state = sim.state
    if sim.stages.add_diagonal:
        wp.copy(sim.work.diagonal, sim.steady_diagonal, count=sim.cloth_count)
        for add_diagonal in sim.stages.add_diagonal:
            add_diagonal(state, sim.work.diagonal)
    state.acceleration.zero_()
    for add_acceleration in sim.stages.add_acceleration:
        add_acceleration(state.acceleration)
    launch(
        predict_kernel,
        sim.cloth_count,
        [state.x_start, state.v, state.acceleration, state.dt],
        [state.x_hat],
        device=sim.device,
    )
