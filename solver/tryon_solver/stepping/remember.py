"""What contacts keep from one step to the next: how far each has given tangentially (effects/slip.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tryon_solver.contact import pairs

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def remember_contacts(sim: Simulation) -> None:
    """Of the pairs at the x that is committed."""
    if not (sim.touching and sim.stages.contact):
        return
    pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
    for term in sim.stages.contact:
        term.remember(sim.pairs, sim.state)
