"""How a GPU ends a step by itself, where the correction has ended as it should, as it does in nearly every step.

Else it stands still twice while the host reads what has come of the correction, has the state checked, reads what has
come of that, and has the step concluded: a tenth of a millisecond each time, and of a walk's frame of 20,000 vertices
six. So the check of a commit, what concludes the step, and the report's figures are in the correction's graph, on
conditions. Where one of them is not met nothing of it was done, and the host goes on as it does without a GPU.

Not with more than one contact pass, which the correction does not end, nor where cloth touches itself alone, which
goes on as one (coast.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.device_loop import keeps_graphs
from tryon_solver.stepping.coast import touches_itself_alone
from tryon_solver.stepping.report import figures, measure_for_report
from tryon_solver.stepping.verify_commit import look_over

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def ends_by_itself(sim: Simulation) -> bool:
    """May the device conclude a step without being told to?"""
    return keeps_graphs(sim.device) and sim.settings.contact_passes == 1 and not touches_itself_alone(sim)


def told_at_end(sim: Simulation) -> dict[str, wp.array]:
    """Where the device has, by name, what the host has to know of a step that it may have ended by itself: the report's
    figures, and what effects measure. All that is read together is waited for once."""
    return {**figures(sim), "went": sim.went}


def end_if_well(sim: Simulation, harmless: float, conclude: Callable[[Simulation], None]) -> None:
    """For the device: check x and `conclude` the step, if the correction has ended as it should; led astray by no more
    than the cloth has at the speed `harmless` [m/s]."""
    tears = sim.tears

    def end() -> None:
        look_over(sim)
        sim.progress.if_sound(sim.work.hits, sim.pairs, conclude_and_measure)

    def conclude_and_measure() -> None:
        conclude(sim)
        measure_for_report(sim)
        for measure in sim.stages.measure:
            measure(sim)

    sim.progress.if_ended_well(math.inf if tears is None else tears.beyond, sim.mass_told, harmless, end)
