"""Repeating proxy, projective dynamics and correction from the corrected state, where the settings ask for it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.stepping.search import remember_solve
from tryon_solver.stepping.velocity import update_velocity

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def contact_passes(sim: Simulation) -> Iterator[int]:
    """One pass, or up to `contact_passes` until the residual of the full energy is below `correction_tolerance`.

    Each further pass starts from the verified state in which the last one ended: there the contact proxy is made anew,
    friction's at the slip so far. A void pass leaves the state of the one before and is the last. Where an accuracy is
    asked for, so is one whose correction began as near as that, and under a deadline one that ends after its time.
    """
    settings, state, counters = sim.settings, sim.state, sim.counters
    voided = counters.retries
    if sim.lead is None:
        wp.copy(sim.x_carried, state.x_feasible)
    for number in range(settings.contact_passes):
        if number:
            wp.copy(state.x_feasible, state.x)
            update_velocity(sim)  # what friction's model takes the slip from
            sim.searches = 0
        made = counters.newton_iterations
        yield number
        near = settings.accuracy is not None and counters.newton_iterations - made <= 1
        settled = near or counters.residual < settings.correction_tolerance
        if settled or counters.retries > voided or sim.pace.over:
            break
    if sim.touching and counters.retries == voided:
        remember_solve(sim)
    elif sim.lead is not None:
        sim.lead.forget()
