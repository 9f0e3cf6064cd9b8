"""The end of a step: its state is measured in double precision before it counts (contact/verify.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.contact import pairs, verify
from tryon_solver.linalg.finite import count_not_finite, is_finite
from tryon_solver.linalg.read_back import read
from tryon_solver.stepping.record import as_one
from tryon_solver.stepping.search import search_around

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def verify_commit(sim: Simulation) -> None:
    """Float64 check of the rounded state; a step that fails it is void and x becomes the carried state again. Leaves
    the pairs there. A state that a GPU has checked by itself (ending.py) is checked.

    That one is checked likewise. Should it fail too, cloth and collision surface go back to where they were committed
    last; the surface then lags behind the skin by the body's motion in the step.
    """
    state = sim.state
    if sim.concluded or is_sound(sim):
        return
    sim.counters.retries += 1
    if go_back(sim, state.x_feasible):
        return
    sim.counters.reverts += 1
    go_back(sim, state.x_committed)


def is_sound(sim: Simulation) -> bool:
    """Does x pass the check of a commit? Collects the pairs at x, and waits for the device once for both."""
    as_one(sim, "look_over", lambda: look_over(sim))
    hits, counters = read(sim.work.hits, sim.pairs.counters)
    if sim.touching and sim.pairs.know_size(counters) > sim.pairs.capacity:
        pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)  # once more: there is room for all now
        for term in sim.stages.contact:
            term.make_room(sim.pairs)
    return int(hits[0]) == 0


def look_over(sim: Simulation) -> None:
    """For the device: count into `hits` what keeps x from passing the check, and collect the pairs there."""
    if not sim.touching:
        count_not_finite(sim.state.x, sim.work.hits)
    else:
        verify.count_violations(sim.candidates, sim.cloth_count, sim.contact.sizes, sim.state.x, sim.work.hits)
        pairs.look_for(sim.pairs, sim.candidates, sim.contact, sim.state.x)


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
    return is_sound(sim)
