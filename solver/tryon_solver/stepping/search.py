"""Searching for candidates around the coming motion.

A list found once is complete while every vertex stays within its budget of its anchor (contact/candidates.py: Region).
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
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read
from tryon_solver.linalg.vectors import subtract
from tryon_solver.stepping.progress import LEAST

if TYPE_CHECKING:
    from tryon_solver.contact.candidates import Region
    from tryon_solver.contact.found import Found
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

FURTHER_EDGES = 4.0  # of the cloth's mean edge, that the correction has a search reach further, at most: where all go
# far at once, more pairs are in reach than any memory holds; their way is shortened instead
SLACK_EDGES = 0.08  # of the cloth's mean edge: more than that finds fine cloth's neighbours, ring upon ring; and
SLACK_EDGES_ON_GPU = 0.16  # on a GPU, where candidates are cheap and another search waits for the host
PER_EDGE = 160  # candidates, in a shirt's front and back and the body between them
CROWDED = 1000  # candidates for each vertex of the cloth: a list that is longer is not extended
LONGEST_SERVED = 60  # steps, by a list after the one that it was found in
RESTED = 5  # steps in which nobody left his ball, nothing was near, and the cloth went nowhere as one
KEPT_APART = wp.constant(0.999)  # of the distance of two boxes, for the rounding of their corners
SURFACE_SHARE = 0.25  # of the slack is granted to the collision surface, which seldom leaves the skin


@wp.kernel
def surround_kernel(
    x: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    slack: float,
    centre_out: wp.array(dtype=wp.vec3),
    half_way_out: wp.array(dtype=wp.vec3),
    budget_out: wp.array(dtype=wp.float32),
):
    """A ball around the middle of each way, so that its vertex may stop anywhere on it and stray by the slack."""
    i = wp.tid()
    half = 0.5 * direction[i]
    centre_out[i] = x[i] + half
    half_way_out[i] = wp.vec3()
    budget_out[i] = wp.length(half) + slack


@wp.kernel
def accompany_kernel(
    cloth_count: int,
    x: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    solved: wp.array(dtype=wp.vec3),
    share: float,
    slack: float,
    centre_out: wp.array(dtype=wp.vec3),
    half_way_out: wp.array(dtype=wp.vec3),
    budget_out: wp.array(dtype=wp.float32),
):
    """A ball that moves along the whole way, all vertices' at once, and covers what is expected of the solve."""
    i = wp.tid()
    half = 0.5 * direction[i]
    expected = 0.5 * share * solved[i]
    centre_out[i] = x[i] + half + expected
    half_way_out[i] = half
    granted = slack
    if i >= cloth_count:
        granted = SURFACE_SHARE * slack
    budget_out[i] = wp.length(expected) + granted


@wp.kernel
def raise_kernel(
    x: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    alpha: wp.array(dtype=wp.float32),
    anchor: wp.array(dtype=wp.vec3),
    slack: float,
    most: float,
    budget: wp.array(dtype=wp.float32),
):
    """Who would leave is granted the way there and the slack, `most` at a time."""
    i = wp.tid()
    far = wp.length(x[i] + alpha[i] * direction[i] - anchor[i])
    if far > budget[i]:
        budget[i] = wp.min(far + slack, budget[i] + most)


@wp.kernel
def box_kernel(
    cloth_count: int,
    centre: wp.array(dtype=wp.vec3),
    half_way: wp.array(dtype=wp.vec3),
    boxes: wp.array(dtype=wp.vec3),
):
    """Largest x and largest -x of the cloth's anchors on their ways, then of the others'."""
    i = wp.tid()
    side = wp.where(i < cloth_count, 0, 2)
    way = wp.abs(half_way[i])
    wp.atomic_max(boxes, side, centre[i] + way)
    wp.atomic_max(boxes, side + 1, way - centre[i])


@wp.kernel
def part_kernel(boxes: wp.array(dtype=wp.vec3), reach: float, budget: wp.array(dtype=wp.float32)):
    i = wp.tid()
    between = wp.max(wp.max(-boxes[3] - boxes[0], -boxes[1] - boxes[2]), wp.vec3())
    budget[i] = wp.max(budget[i], 0.5 * (KEPT_APART * wp.length(between) - reach))


@wp.kernel
def stay_near_kernel(
    x: wp.array(dtype=wp.vec3),
    x_feasible: wp.array(dtype=wp.vec3),
    least: wp.array(dtype=wp.vec3),
    lengths: wp.array(dtype=wp.float32),
    anchor: wp.array(dtype=wp.vec3),
    slack: float,
    budget: wp.array(dtype=wp.float32),
):
    """A ball as far as where the vertex is, where the step began and, if there is such, the iterate to go back to."""
    i = wp.tid()
    far = wp.max(wp.length(x[i] - anchor[i]), wp.length(x_feasible[i] - anchor[i]))
    if lengths[LEAST] < wp.inf:
        far = wp.max(far, wp.length(least[i] - anchor[i]))
    budget[i] = wp.min(budget[i], far + slack)


@wp.kernel
def anchor_kernel(
    centre: wp.array(dtype=wp.vec3),
    half_way: wp.array(dtype=wp.vec3),
    anchor_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    anchor_out[i] = centre[i] + half_way[i]


def search_slack(sim: Simulation) -> float:
    """How far from where it is expected a vertex may go before candidates are searched for again [m]."""
    edges = SLACK_EDGES_ON_GPU if wp.get_device(sim.device).is_cuda else SLACK_EDGES
    return min(sim.settings.search_slack, edges * sim.mean_edge)


def a_few_edges(sim: Simulation, leaving: int) -> float:
    """How much further the correction has a search reach than the one before it, at most [m], for so many vertices that
    leave their balls.

    Stencils within reach grow with its square, PER_EDGE for each that reaches an edge; how far they reach, that length
    of the list tells: where all of a garment goes far at once, no further than the list may grow.
    """
    count, size = sim.cloth_count, sim.candidates.size
    reached_sq, room = size / (PER_EDGE * count), max(CROWDED * count - size, 0)
    further = math.sqrt(reached_sq + room / (PER_EDGE * max(leaving, 1))) - math.sqrt(reached_sq)
    return min(FURTHER_EDGES, further) * sim.mean_edge


def searches_left(sim: Simulation) -> int:
    """How often the step's list may still be extended: none of the settings' searches is left of a CROWDED one.

    Where all of a garment is pushed decimetres at once, as by a storm or a hundred times a balloon's pressure, the
    balls reach everything, and a list of millions is searched for, filtered and followed for minutes. So its vertices
    end at the balls that they have: the next step takes them on.
    """
    if sim.candidates.size > CROWDED * sim.cloth_count:
        return 0
    return sim.settings.searches - sim.searches


def search_around(sim: Simulation, x: wp.array, direction: wp.array) -> None:
    """Find the candidates of every motion within a slack of the paths from x along `direction`, wherever it stops.

    The slack doubles with every further search of the step: who outgrew it once will again.
    """
    region = sim.region
    slack = search_slack(sim) * 2**sim.searches
    launch(
        surround_kernel,
        sim.all_count,
        [x, direction, slack],
        [region.centre, region.half_way, region.budget],
        device=sim.device,
    )
    wp.copy(region.anchor, region.centre)
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


def launch_search_along(sim: Simulation, x: wp.array, direction: wp.array, share: float) -> None:
    """Launch it once it is begun; it is done when `end_search` is told what was counted."""
    accompany(sim, sim.region, x, direction, share)
    launch_search(sim, x)
    place_anchors(sim)


def found_of(sim: Simulation) -> Sequence[Found]:
    """What a search of this scene leaves what it found in."""
    return sim.candidates.found[: len(sim.touching)]


def accompany(sim: Simulation, region: Region, x: wp.array, direction: wp.array, share: float) -> None:
    """Let the region be of what goes from x along `direction`, as `search_along` says; its anchors are not placed."""
    launch(
        accompany_kernel,
        sim.all_count,
        [sim.cloth_count, x, direction, sim.solved, share, search_slack(sim)],
        [region.centre, region.half_way, region.budget],
        device=sim.device,
    )


def search_further(sim: Simulation, direction: wp.array, alpha: wp.array, most: float = math.inf) -> None:
    """Raise the budgets of the vertices that `alpha` times `direction` from x takes out of the region, by `most` m at
    most; extend the list.

    The distances must be those at x.
    """
    region = sim.region
    if not sim.candidates.size:
        stay_near(sim)
    launch(
        raise_kernel,
        sim.all_count,
        [sim.state.x, direction, alpha, region.anchor, search_slack(sim), most],
        [region.budget],
        device=sim.device,
    )
    broad_phase.extend(sim.candidates, scope(sim, sim.state.x))
    wp.copy(sim.x_listed, sim.state.x)
    sim.searches += 1
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
    """
    if sim.list_age >= LONGEST_SERVED:
        return False
    if bounds.outside(x, direction, sim.region, sim.work.hits):
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


def end_search(sim: Simulation, counts: Sequence[tuple[int, int]]) -> bool:
    """The list is filled; was there room for all that was counted? Else nothing was on it until now."""
    fitted = broad_phase.settle(sim.candidates, scope(sim, sim.x_listed), counts)
    sim.candidates.look_back()
    if not sim.candidates.size and sim.cloth not in sim.touching:
        part(sim)
    return fitted


def part(sim: Simulation) -> None:
    """Where nothing of body and cloth was found, grant every vertex half of what is between them.

    With D the distance of the box around the cloth's anchors, wherever on their ways, from that around the skin's, no
    stencil is nearer than `reach` while no vertex is further than (D - reach)/2 from its anchor: the list stays empty
    and complete, until something comes so far.
    """
    region, boxes = sim.region, sim.boxes
    (other,) = sim.touching
    boxes.fill_(wp.vec3(-math.inf))
    launch(box_kernel, sim.all_count, [sim.cloth_count, region.centre, region.half_way], [boxes], device=sim.device)
    launch(part_kernel, sim.all_count, [boxes, other.reach], [region.budget], device=sim.device)


def stay_near(sim: Simulation) -> None:
    """Of what `part` has granted leave to each vertex what this step needs: with all of it, who is granted a little
    more comes into reach of all that the two surfaces have."""
    state, region = sim.state, sim.region
    places = [state.x, state.x_feasible, sim.work.least, sim.progress.lengths]
    launch(
        stay_near_kernel,
        sim.all_count,
        [*places, region.anchor, search_slack(sim)],
        [region.budget],
        device=sim.device,
    )


def place_anchors(sim: Simulation) -> None:
    """Put the anchors at the ends of their ways."""
    region = sim.region
    launch(
        anchor_kernel,
        sim.all_count,
        [region.centre, region.half_way],
        [region.anchor],
        device=sim.device,
    )


def follow(sim: Simulation, near: bool) -> None:
    """Bring the candidates' distances from where they were last known to x; with `near`, after `list_near`."""
    if not sim.candidates.idle:
        candidates.follow(sim.candidates, sim.x_listed, sim.state.x, near)
        wp.copy(sim.x_listed, sim.state.x)


def remember_solve(sim: Simulation) -> None:
    """What the solve moved in this step beside the carried motion is what the next step's search expects."""
    subtract(sim.state.x, sim.x_carried, sim.solved)
