"""Searching for candidates around the coming motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.contact import candidates

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def search_around(sim: Simulation, x: wp.array, direction: wp.array) -> None:
    """Find the candidates of every motion within a slack of the paths from x along `direction`.

    The slack is `search_slack` at first and doubles with every further search of the step: who outgrew it once will
    again.
    """
    slack = sim.settings.search_slack * 2**sim.searches
    candidates.sweep(sim.inner, x, direction, slack)
    candidates.sweep(sim.boxes, x, direction, slack + 0.5 * sim.reach)
    candidates.find(
        sim.candidates,
        sim.cloth,
        sim.touching,
        sim.boxes,
        sim.group,
        x,
        direction,
        sim.reach + 2 * slack,
        relative=False,
    )
    wp.copy(sim.x_searched, x)
    sim.searches += 1
