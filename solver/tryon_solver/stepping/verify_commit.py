"""The end of a step: its state is measured in double precision before it counts (contact/verify.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.contact.verify import is_finite, violations
from tryon_solver.stepping.search import search_around

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def verify_commit(sim: Simulation) -> None:
    """Float64 check of the rounded state; a step that fails it is void and x becomes the carried state again.

    That one is checked likewise. Should it fail too, cloth and collision surface go back to where they were committed
    last; the surface then lags behind the skin by the body's motion in the step.
    """
    state, work = sim.state, sim.work
    if violations(sim.candidates, sim.cloth_count, sim.contact.sizes, state.x, work.hits) == 0:
        return
    sim.counters.retries += 1
    if go_back(sim, state.x_feasible):
        return
    sim.counters.reverts += 1
    go_back(sim, state.x_committed)


def go_back(sim: Simulation, x: wp.array) -> bool:
    """Put cloth and surface to x (A,) and search there anew; is that state sound, by the check of a commit?"""
    state, work = sim.state, sim.work
    wp.copy(state.x, x)
    if not is_finite(state.x, work.hits):
        return False
    work.direction.zero_()
    if sim.touching:
        sim.searches = 0
        search_around(sim, state.x, work.direction)
    return violations(sim.candidates, sim.cloth_count, sim.contact.sizes, state.x, work.hits) == 0
