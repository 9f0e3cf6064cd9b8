"""How far a step ended from where its equations balance, estimated.

At the committed state the correction's Newton matrix and gradient are made once more, and conjugate gradients go a few
ITERATIONS towards Newton's next direction. That is short of the error, which takes several of Newton's iterations, each
solved to the end; but the two grow together. SCALE is the one number that was fitted: the median, over garments,
motions and presets, of the true error over the length of that direction (METHOD.md section 14). Ours.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.contact import pairs
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import dot
from tryon_solver.stepping.correct import linearise_at
from tryon_solver.stepping.newton import solve_newton_system
from tryon_solver.stepping.record import as_one

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

ITERATIONS = 10
SCALE = 4.6


@wp.kernel
def take_larger_kernel(
    squared: wp.array(dtype=wp.float32), count: int, scale: float, error_out: wp.array(dtype=wp.float32)
):
    """error = max(error, scale sqrt(squared / count))"""
    error_out[0] = wp.max(error_out[0], scale * wp.sqrt(squared[0] / float(count)))


def estimate_error(sim: Simulation) -> None:
    """Into `error` (1,) [m], where it is larger: the cloth's RMS distance from the balance of the step that ended in x,
    whose pairs are collected if contacts keep something (remember.py)."""
    if sim.touching and not sim.stages.contact:
        pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
    as_one(sim, "estimate_error", lambda: towards_balance(sim))


def towards_balance(sim: Simulation) -> None:
    """For the device: the beginning of Newton's direction at x, and its length."""
    work, cloth, squared = sim.work, sim.cloth_count, sim.work.scalars[0]
    linearise_at(sim)
    solve_newton_system(sim, ITERATIONS)
    direction = work.direction[:cloth]
    dot(direction, direction, squared)
    launch(take_larger_kernel, 1, [squared, cloth, SCALE], [sim.error], device=sim.device)
