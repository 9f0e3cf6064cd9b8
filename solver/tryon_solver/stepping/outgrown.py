"""How far a direction may lead out of the region before a GPU searches further for it.

Another search looks for all that the garment could meet, and the device stands still until the host has asked for it.
Nearly half of a walk's frames had one, for two vertices of 20,000 at the median. Who is led out of its ball stops at
the border, like who meets something, and the next step has its ball around where it was going. So there is another
search only where the region would withhold more than what is near enough tells of (near.py): more than SHARE of that,
as root mean square over the cloth, or of one vertex more than EDGES. Only after a step that came near within its first
budget, and in a correction's first iterations (progress.py: LETTING_GO), which are all that a step of a walk has: let
go in blow after blow, cloth was torn. Where nothing says what is near enough, none is let go; nor on a CPU, which
waits for nobody. Ours.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

SHARE = 0.1  # of what is near enough
EDGES = 0.04  # of the cloth's mean edge
NONE = 0.0, 0.0, 0.0  # of those that a correction may let go


def let_go(sim: Simulation) -> tuple[float, float, float]:
    """What is near enough until the way is known that the step goes (near.py) [m]; how far a vertex may be led out of
    the region [m]; and all of them, by the sum of squares, in squares of what is near enough."""
    if wp.get_device(sim.device).is_cpu:
        return NONE
    near = near_enough(sim)
    return near, EDGES * sim.mean_edge, sim.cloth_count * SHARE**2


def near_enough(sim: Simulation) -> float:
    """RMS distance from balance [m] that is asked for, or else the preset's for a step as long as this; 0: none."""
    settings = sim.settings
    if settings.accuracy is not None:
        return settings.accuracy
    return (settings.correction_nearness or 0.0) * sim.dt
