"""Ending the correction where it is near enough to balance: what `Settings.accuracy` asks for, or else
`Settings.correction_nearness`.

Newton's direction leads to where the step balances, as far as conjugate gradients got and the energy is quadratic: its
RMS length over the cloth, times SCALE, is how far that is. SCALE was fitted: the median, over garments, motions and
lengths of step, of the true error after such a correction over what it was asked for, is kept under 1 (METHOD.md
section 14). Where directions have not become shorter for PATIENCE iterations, none that follows can be hoped to. Ours.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import dot
from tryon_solver.stepping.progress import LEFT, SHORTEST, SINCE

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

SCALE = 2.0
SHORTER = wp.constant(0.7)  # times the shortest before it, a direction is a gain
PATIENCE = wp.constant(8)  # iterations without one


@wp.kernel
def make_last_kernel(
    accuracy: wp.array(dtype=wp.float32),
    nearness: float,
    dt: wp.array(dtype=wp.float32),
    squared: wp.array(dtype=wp.float32),
    count: int,
    scale: float,
    state: wp.array(dtype=wp.int32),
    lengths: wp.array(dtype=wp.float32),
):
    length = wp.sqrt(squared[0] / float(count))
    state[SINCE] = state[SINCE] + 1
    if length < SHORTER * lengths[SHORTEST]:
        lengths[SHORTEST] = length
        state[SINCE] = 0
    enough = accuracy[0]
    if enough <= 0.0:  # none is asked for
        enough = nearness * dt[0]
    if scale * length <= enough or state[SINCE] >= PATIENCE:
        state[LEFT] = 0


def make_last_if_near(sim: Simulation) -> None:
    """Let the iteration whose direction was found be the correction's last, if that is no longer than is near enough,
    or if none has become shorter for long."""
    settings = sim.settings
    if not settings.ends_when_near:
        return
    direction, squared = sim.work.direction[: sim.cloth_count], sim.work.scalars[0]
    dot(direction, direction, squared)
    nearness = settings.correction_nearness or 0.0
    asked = [sim.accuracy, nearness, sim.state.dt, squared, sim.cloth_count, SCALE]
    launch(make_last_kernel, 1, asked, [sim.progress.state, sim.progress.lengths], device=sim.device)
