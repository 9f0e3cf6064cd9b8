"""Searching for candidates around the coming motion.

A list found once is complete while every vertex stays within its budget of its anchor (contact/region.py).
One list serves the whole step where it can: the anchors ride along with the body's motion, which cloth and skin take
together, half way to where the solve moved the vertices beside it in the step before; the budgets cover that, and a
slack.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.contact import bounds, broad_phase, candidates, found
from tryon_solver.linalg.read_back import read
from tryon_solver.linalg.vectors import subtract
from tryon_solver.stepping.progress import LEAST

if TYPE_CHECKING:
    from tryon_solver.contact.found import Counts, Found
    from tryon_solver.contact.region import Region
    from tryon_solver.simulation import Simulation

FURTHER_EDGES = 4.0  # of the cloth's mean edge, that the correction has a search reach further, at most: where all go
# far at once, more pairs are in reach than any memory holds; their way is shortened instead
SLACK_EDGES = 0.08  # of the cloth's mean edge: more than that finds fine cloth's neighbours, ring upon ring; and
SLACK_EDGES_ON_GPU = 0.16  # on a GPU, where candidates are cheap
PER_EDGE = 160  # candidates, in a shirt's front and back and the body between them
CROWDED = 1000  # candidates for each vertex of the cloth: a list that is longer is not extended
MANY = 0.02  # share of all vertices: where more fall behind, a search anew lists less than larger balls do
LONGEST_SERVED = 60  # steps, by a list after the one that it was found in
RESTED = 5  # steps in which nobody left his ball, nothing was near, and the cloth went nowhere as one


def search_slack(sim: Simulation) -> float:
    """How far from where it is expected a vertex may go before candidates are searched for again [m]."""
    edges = SLACK_EDGES_ON_GPU if wp.get_device(sim.device).is_cuda else SLACK_EDGES
    return min(sim.settings.search_slack, edges * sim.mean_edge)


def a_few_edges(sim: Simulation, leaving: int) -> float:
    """How much further the correction has a search reach than the one before it, at most [m], for so many vertices that
    leave their balls.

    Stencils within reach grow with its square, PER_EDGE for each that reaches an edge; how far they reach, that length
    of the list tells: where all of a garment goes far at once, no further than the list may grow. A GPU that extends
    the list by itself works it out likewise (extend.py: decide_kernel).
    """
    count, size = sim.cloth_count, sim.candidates.size
    reached_sq, room = size / (PER_EDGE * count), max(CROWDED * count - size, 0)
    further = math.sqrt(reached_sq + room / (PER_EDGE * max(leaving, 1))) - math.sqrt(reached_sq)
    return min(FURTHER_EDGES, further) * sim.mean_edge


def searches_left(sim: Simulation) -> int:
    """How often the step's list may still be extended, by the settings: never, if it is CROWDED.

    Where all of a garment is pushed decimetres at once, as by a storm or a hundred times a balloon's pressure, the
    balls reach everything, and a list of millions is searched for, filtered and followed for minutes. So its vertices
    end at the balls that they have: the next step takes them on.
    """
    if sim.candidates.size > CROWDED * sim.cloth_count:
        return 0
    most = sim.settings.searches_in_step if sim.pace.thorough else sim.settings.searches
    return most - sim.searches


def search_around(sim: Simulation, x: wp.array, direction: wp.array) -> None:
    """Find the candidates of every motion within a slack of the paths from x along `direction`, wherever it stops.

    The slack doubles with every further search of the step: who outgrew it once will again.
    """
    slack = search_slack(sim) * 2**sim.searches
    sim.region.surround(x, direction, slack)
    find(sim, x)


def search_along(sim: Simulation, x: wp.array, direction: wp.array, share: float) -> None:
    """Find the candidates of everything that happens while all vertices go from x along `direction` together; the
    anchors are at its end then.

    Each may be off its place on the way, and at its end, by its slack, and by the `share` of what the solve moved it in
    the last step.
    """
    begin_search(sim)
    launch_search_along(sim, x, direction, share)
    end_search(sim, found.counted(found_of(sim)))


def many(sim: Simulation, leaving: int) -> bool:
    """Do so many vertices leave the region that it is dearer to extend it than to search anew?"""
    return leaving > MANY * sim.all_count


def launch_search_along(sim: Simulation, x: wp.array, direction: wp.array, share: float) -> None:
    """Launch it once it is begun; it is done when `end_search` is told what was counted."""
    accompany(sim, sim.region, x, direction, share)
    launch_search(sim, x)
    sim.region.place_anchors()


def found_of(sim: Simulation) -> Sequence[Found]:
    """What a search of this scene leaves what it found in."""
    return sim.candidates.found[: len(sim.touching)]


def accompany(sim: Simulation, region: Region, x: wp.array, direction: wp.array, share: float) -> None:
    """Let the region be of what goes from x along `direction`, as `search_along` says; its anchors are not placed."""
    region.accompany(sim.cloth_count, x, direction, sim.expected, share, search_slack(sim))


def search_further(sim: Simulation, direction: wp.array, alpha: wp.array, most: float = math.inf) -> None:
    """Raise the budgets of the vertices that `alpha` times `direction` from x takes out of the region, by `most` m at
    most; extend the list.

    The distances must be those at x.
    """
    launch_search_further(sim, direction, alpha, most)
    end_search_further(sim, found.counted(found_of(sim)))


def launch_search_further(
    sim: Simulation, direction: wp.array, alpha: wp.array, most: float = math.inf
) -> None:
    """Launch it; it is done when `end_search_further` is told what was counted."""
    state = sim.state
    if not sim.candidates.size:
        furthest = sim.progress.ways[LEAST]
        sim.region.stay_near(state.x, state.x_feasible, sim.work.least, furthest, search_slack(sim))
    sim.progress.further.fill_(most)
    sim.region.grant(state.x, direction, alpha, search_slack(sim), sim.progress.further)
    broad_phase.launch_extension(sim.candidates, scope(sim, state.x))
    wp.copy(sim.x_listed, state.x)


def end_search_further(sim: Simulation, counts: Sequence[Counts]) -> bool:
    """The list is extended; was there room for all that was counted?"""
    fitted = broad_phase.settle(sim.candidates, scope(sim, sim.x_listed), counts)
    sim.searches += 1
    distrust_list(sim)
    return fitted


def distrust_list(sim: Simulation) -> None:
    """The list serves no further step."""
    sim.list_age, sim.held, sim.rests = LONGEST_SERVED, 0, False


def scope(sim: Simulation, x: wp.array) -> broad_phase.Scope:
    """What is searched: what the cloth may touch, within the region as it is; its vertices are at x (A,) m."""
    return broad_phase.Scope(sim.cloth, sim.touching, sim.region, sim.group, x)


def list_holds(sim: Simulation, x: wp.array, direction: wp.array) -> bool:
    """Is the list of the step before complete for all that go from x along `direction`, wherever they stop? Then its
    distances are measured at x, and nothing is searched. Waits for the device.

    It is as long as every vertex is in its ball: on a body that stands, or whose root alone moves, as the anchors do
    with it (stencils are told by distances, which that leaves as they are), for LONGEST_SERVED steps at most: each
    rounds the anchors once more, and what budgets have grown to would never shrink. So one that was
    extended serves no further step: of what falls or is blown, budgets and list would grow from step to step.

    Nor does it serve where MANY vertices are outside if the solve moves them as it did in the last step.
    """
    if sim.list_age >= LONGEST_SERVED:
        return False
    outside, expected = bounds.outside(x, direction, sim.expected, sim.region)
    if outside or many(sim, expected):
        sim.held, sim.rests = 0, False
        return False
    candidates.measure(sim.candidates, x)
    sim.candidates.look_back()
    sim.list_age += 1
    wp.copy(sim.x_listed, x)
    sim.listed = True
    still = touches_itself_alone(sim) and sim.candidates.idle and not read(sim.coasting.way)[0].any()
    sim.held = sim.held + 1 if still else 0
    sim.rests = sim.held >= RESTED
    return True


def touches_itself_alone(sim: Simulation) -> bool:
    """May the cloth touch itself, and nothing else?"""
    return len(sim.touching) == 1 and sim.touching[0] is sim.cloth


def find(sim: Simulation, x: wp.array) -> None:
    """Fill the candidate list for the region as it is set."""
    begin_search(sim)
    launch_search(sim, x)
    end_search(sim, found.counted(found_of(sim)))


def begin_search(sim: Simulation) -> None:
    """There will be another list, and none until `end_search`."""
    sim.candidates.clear()
    sim.searches += 1
    sim.listed, sim.list_age = True, 0


def launch_search(sim: Simulation, x: wp.array) -> None:
    """Launch it, for the region as it is set; it is done when `end_search` is told what was counted."""
    broad_phase.launch_search(sim.candidates, scope(sim, x))
    wp.copy(sim.x_listed, x)


def end_search(sim: Simulation, counts: Sequence[Counts]) -> bool:
    """The list is filled; was there room for all that was counted? Else nothing was on it until now."""
    fitted = broad_phase.settle(sim.candidates, scope(sim, sim.x_listed), counts)
    sim.candidates.look_back()
    if not sim.candidates.size and sim.cloth not in sim.touching:
        (other,) = sim.touching
        sim.region.part(sim.cloth_count, other.reach.farthest, sim.boxes)
    return fitted


def follow(sim: Simulation, near: bool) -> None:
    """Bring the candidates' distances from where they were last known to x; with `near`, after `list_near`."""
    if not sim.candidates.idle:
        candidates.follow(sim.candidates, sim.x_listed, sim.state.x, near)
        wp.copy(sim.x_listed, sim.state.x)


def remember_solve(sim: Simulation) -> None:
    """What the solve moved in this step beside the carried motion is what the next step's search expects."""
    if sim.lead is not None:
        sim.lead.look_back(sim)
    subtract(sim.state.x, sim.x_carried, sim.solved)
