"""How a GPU extends the list of candidates by itself, where the correction leads vertices out of the region.

For the host to do it the loop ends, is read, and is launched again, which takes longer than what a few vertices need of
a search. So the loop has it on a condition, for each direction and for the way to the trial once. What it does not do
the loop ends for as before: where that was not enough, or there was no room, where the list is empty or CROWDED, or
where the trial is further off than is worth a search.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.contact import bounds, broad_phase, found
from tryon_solver.linalg.device_loop import keeps_graphs
from tryon_solver.linalg.launch import launch
from tryon_solver.stepping.progress import (
    EXTENDING,
    FURTHER,
    GOING_ON,
    LEAVING,
    SEARCHES,
    TRIAL,
    UNFITTED,
    WANTS_SEARCH,
)
from tryon_solver.stepping.search import (
    CROWDED,
    FURTHER_EDGES,
    PER_EDGE,
    distrust_list,
    found_of,
    scope,
    search_slack,
)

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation
    from tryon_solver.stepping.progress import Outcome

wp.set_module_options({"enable_backward": False})

LISTED = "listed"  # among what is read with the loop's end: how long the list is


@wp.kernel
def decide_kernel(
    listed: wp.array(dtype=wp.int32),
    starting: int,
    cloth_count: float,
    edge: float,
    crowded: float,
    per_edge: float,
    most_edges: float,
    state: wp.array(dtype=wp.int32),
    lengths: wp.array(dtype=wp.float32),
):
    """Is the list to be extended, and by how much further at most (search.py: a_few_edges)?"""
    size = float(listed[0])
    state[EXTENDING] = 0
    wanted = state[GOING_ON] == 1 and state[LEAVING] > 0 and state[SEARCHES] > 0
    near = starting == 0 or lengths[TRIAL] <= most_edges * edge
    if wanted and near and size > 0.0 and size <= crowded * cloth_count:
        state[EXTENDING] = 1
        reached_sq = size / (per_edge * cloth_count)
        room = (crowded * cloth_count - size) / (per_edge * float(state[LEAVING]))
        further = wp.sqrt(reached_sq + room) - wp.sqrt(reached_sq)
        lengths[FURTHER] = wp.min(most_edges, further) * edge


@wp.kernel
def judge_kernel(fits: wp.array(dtype=wp.int32), state: wp.array(dtype=wp.int32)):
    """Where there was no room nothing goes on before the host has made some."""
    state[SEARCHES] = state[SEARCHES] - 1
    if fits[0] == 0:
        state[UNFITTED] = 1
        state[WANTS_SEARCH] = 1
        state[GOING_ON] = 0


def extends_by_itself(sim: Simulation) -> bool:
    """Does the loop that is launched next, or is being recorded, extend the list?"""
    in_graph = keeps_graphs(sim.device) or bool(wp.get_device(sim.device).is_capturing)
    return in_graph and bool(sim.touching) and not sim.candidates.idle


def extend_if_leaving(sim: Simulation, direction: wp.array, starting: bool) -> None:
    """For the device: where `direction` takes vertices out of the region, as has been counted, grant them the way and
    extend the list, if it does that by itself; and count anew. `starting`: it is the way to the trial."""
    if not extends_by_itself(sim):
        return
    state, work, progress = sim.state, sim.work, sim.progress

    def extend() -> None:
        sim.region.grant(state.x, direction, work.alpha, search_slack(sim), progress.further)
        broad_phase.launch_extension(sim.candidates, scope(sim, state.x))
        wp.copy(sim.x_listed, state.x)
        bounds.count_leaving(state.x, direction, work.alpha, sim.region, progress.leaving)
        launch(judge_kernel, 1, [sim.candidates.fits], [progress.state], device=sim.device)

    lengths = [float(sim.cloth_count), sim.mean_edge, float(CROWDED), float(PER_EDGE), FURTHER_EDGES]
    told = [sim.candidates.count, int(starting), *lengths]
    launch(decide_kernel, 1, told, [progress.state, progress.lengths], device=sim.device)
    wp.capture_if(progress.extending, extend)


def note_extensions(sim: Simulation, allowed: int, outcome: Outcome) -> None:
    """Know what a loop that was `allowed` so many searches has made of the list."""
    made = allowed - outcome.searches
    if made > 0:
        sim.candidates.know_size(int(outcome.figures[LISTED][0]))
        sim.searches += made
        distrust_list(sim)


def make_room_for_extension(sim: Simulation) -> None:
    """Extend the list by what the loop found and had no room for. Waits for the device."""
    counts = found.counted(found_of(sim))
    broad_phase.settle(sim.candidates, scope(sim, sim.x_listed), counts)
