"""What contacts keep from one step to the next: how far each has given tangentially (effects/slip.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def remember_contacts(sim: Simulation) -> None:
    """Of the pairs at the x that is committed, as `verify_commit` has left them."""
    for term in sim.stages.contact:
        term.remember(sim.pairs, sim.state)
