"""Repeating a cycle of verbs until nothing moves."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.vectors import subtract

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def repeat_until(sim: Simulation, at_most: int, cycle: tuple[Callable[[Simulation], None], ...]) -> None:
    """Run the cycle until its largest vertex move is below tolerance * dt, at most `at_most` times."""
    n = sim.cloth_count
    for _ in range(at_most):
        wp.copy(sim.x_before, sim.state.x, count=n)
        for verb in cycle:
            sim.timed(verb)
        sim.counters.iterations += 1
        subtract(sim.state.x, sim.x_before, sim.x_before)
        if sim.largest(sim.x_before) < sim.settings.tolerance * sim.dt:
            return
