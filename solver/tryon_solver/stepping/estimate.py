"""How far a step ended from where its equations balance, estimated.

At the committed state the correction's Newton matrix and gradient are made once more, and conjugate gradients go a few
ITERATIONS towards Newton's next direction. That is short of the error, and the shorter the further the iterations have
come: what is steep is done first, and of the folds that are left the matrix, which is made positive, knows least. So
with l the length of that direction and w that of the way that the step went beside the body's motion, both as root mean
squares over the cloth,

    error = SCALE l^(1 - OF_WAY) (w^2 + l^2)^(OF_WAY/2);

what is left is on the way, too, so that a step that went nowhere is told of by l. A correction that goes on until it is
as near as was asked for, or its time is over, solves each of its directions further, and leaves less that is flat: its
scale is another, the DIALLED_SCALE. All three numbers were fitted (METHOD.md section 14). Ours.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import dot, subtract
from tryon_solver.stepping.correct import linearise_at
from tryon_solver.stepping.newton import solve_newton_system

if TYPE_CHECKING:
    from tryon_solver.settings import Settings
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

ITERATIONS = 10
SCALE = 2.7
DIALLED_SCALE = 2.0
OF_WAY = 0.1  # the exponent of the way


@wp.kernel
def take_larger_kernel(
    squared: wp.array(dtype=wp.float32),
    way_squared: wp.array(dtype=wp.float32),
    count: int,
    scale: float,
    of_way: float,
    error_out: wp.array(dtype=wp.float32),
):
    """error = max(error, scale l^(1 - of_way) (w^2 + l^2)^(of_way/2)), l^2 and w^2 the means over `count`"""
    left = wp.sqrt(squared[0] / float(count))
    way = wp.sqrt((way_squared[0] + squared[0]) / float(count))
    error_out[0] = wp.max(error_out[0], scale * wp.pow(left, 1.0 - of_way) * wp.pow(way, of_way))


def scale_of(settings: Settings) -> float:
    """What these settings' estimates are scaled by."""
    return SCALE if settings.ends_by_budget else DIALLED_SCALE


def estimate_error(sim: Simulation) -> None:
    """Into `error` (1,) [m], where it is larger: the cloth's RMS distance from the balance of the step that ended in x,
    whose pairs are collected."""
    work, cloth, squared, way_squared = sim.work, sim.cloth_count, sim.work.scalars[0], sim.work.scalars[1]
    linearise_at(sim)
    solve_newton_system(sim, ITERATIONS, anew=False)  # the last iteration's coarse level does as well
    direction, way = work.direction[:cloth], work.total[:cloth]
    dot(direction, direction, squared, work.parts)
    subtract(sim.state.x[:cloth], sim.x_carried[:cloth], way)
    dot(way, way, way_squared, work.parts)
    lengths = [squared, way_squared, cloth, scale_of(sim.settings), OF_WAY]
    launch(take_larger_kernel, 1, lengths, [sim.error], device=sim.device)
