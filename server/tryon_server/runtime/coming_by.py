"""Cloth that comes back with what is worn has to fit beside the body, and fits best where it hung: so the body is
waited for to come by that stance, as somebody who walks does at every second step."""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import TYPE_CHECKING

from tryon_solver.dressing.returned import Hung, stances_apart
from tryon_solver.simulation import Simulation

if TYPE_CHECKING:
    from tryon_server.runtime.solver_drape import SolverDrape

NEAR = 0.12  # m, that no skin is further from where it was, the root's way apart: of walking trousers (900 vertices)
# all pieces came back up to there, and to 0.15, and beyond 0.24 none
LONGEST = 1.5  # s, simulated: two steps of a walk take 1.2
WAITS = 3  # times: where it does not fit in a stance that is near, the next frames have others
HELD = 1.0  # s, in which no frame went by: the body is held, and comes by nowhere


def comes_by(drape: SolverDrape, new: Simulation, hung: Hung) -> Generator[None, None, bool]:
    """None until the body of the drape, which is worn and advanced meanwhile, is near the stance in which the garment
    `hung`, or that is waited for no more; `new` is what is to be put on. `drape.waiting` is set meanwhile. Returns
    whether it came by."""
    assert drape.simulation.body is not None
    seconds, seen = drape.seconds, time.monotonic()
    until = seconds + LONGEST
    drape.waiting = True
    try:
        while seconds < until and time.monotonic() - seen < HELD:
            yield None
            if drape.seconds != seconds:
                seconds, seen = drape.seconds, time.monotonic()
                if stances_apart(drape.simulation, new, hung) <= NEAR:
                    return True
        return False
    finally:
        drape.waiting = False
