"""The contact-free global step: where the cloth would go if nothing were in its way."""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.stepping.descend import descend_in_subspace, forget_search_history
from tryon_solver.stepping.gradient import elastic_gradient, invert_diagonal_blocks
from tryon_solver.stepping.smooth import smooth_in_full_space

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def solve_without_contact(sim: Simulation) -> None:
    """One global step at x_hat; leaves the result in x. The collision surface stays where it is."""
    state, work = sim.state, sim.work
    sim.pairs.size = 0
    wp.copy(state.x, state.x_hat, count=sim.cloth_count)
    work.direction.zero_()
    elastic_gradient(sim, state.x, work.gradient)
    invert_diagonal_blocks(sim)
    forget_search_history(sim)
    descend_in_subspace(sim)
    smooth_in_full_space(sim)
