"""What an error within a step leaves: nothing of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.stepping.search import distrust_list

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def take_back(sim: Simulation) -> None:
    """Cloth and collision surface are where the step began, and the body's skin is where its stance then has it. What
    was under way had been proven free in part, or was a trial that nothing had been; and a list whose search was cut
    off says of budgets that are granted already that it covers them."""
    wp.copy(sim.state.x, sim.state.x_committed)
    if sim.body is not None:
        sim.body.stand(sim.body.pose)
    distrust_list(sim)
    sim.under_way, sim.concluded, sim.figures = False, False, None
