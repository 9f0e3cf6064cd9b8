"""Repeating a cycle of verbs until nothing moves; the device decides."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import find_largest, subtract

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

MORE = wp.constant(0)  # 1 while another cycle is to be run
TAKEN = wp.constant(1)  # cycles since the report began
LEFT = wp.constant(2)  # that may be run before the repetition ends


@wp.kernel
def begin_kernel(most: wp.array(dtype=wp.int32), cycles: wp.array(dtype=wp.int32)):
    cycles[MORE] = 1
    cycles[LEFT] = most[0]


@wp.kernel
def judge_kernel(
    longest: wp.array(dtype=wp.float32),
    tolerance: float,
    dt: wp.array(dtype=wp.float32),
    cycles: wp.array(dtype=wp.int32),
):
    cycles[TAKEN] = cycles[TAKEN] + 1
    cycles[LEFT] = cycles[LEFT] - 1
    cycles[MORE] = wp.where(longest[0] < tolerance * dt[0] or cycles[LEFT] <= 0, 0, 1)


def repeat_until(sim: Simulation, at_most: int, cycle: tuple[Callable[[Simulation], None], ...]) -> None:
    """Run the cycle until its largest vertex move is below tolerance * dt, at most `at_most` times, nor more often than
    the step's pace has it."""
    n, cycles = sim.cloth_count, sim.cycles
    launch(begin_kernel, 1, [sim.most_cycles], [cycles], device=sim.device)

    def run() -> None:
        wp.copy(sim.x_before, sim.state.x, count=n)
        for verb in cycle:
            sim.timed(verb)
        subtract(sim.state.x, sim.x_before, sim.x_before)
        find_largest(sim.x_before, sim.largest_out)
        judged = [sim.largest_out, sim.settings.tolerance, sim.state.dt]
        launch(judge_kernel, 1, judged, [cycles], device=sim.device)

    if at_most > 0:
        run()  # there is no need to ask for the first
    for _ in range(1, at_most):
        wp.capture_if(cycles[int(MORE) : int(MORE) + 1], run)
