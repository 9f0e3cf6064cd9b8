"""Cloth that touches nothing but itself goes as one to where forces balance, before a step looks for contact and at its
end.

A motion that all vertices have in common brings no two of them nearer, and changes nothing of what they do to each
other: of the incremental potential E along it there is left what acts from outside, inertia, drag and what holds
vertices in place, with the sum d of these on the diagonal of the step's matrices. So the cloth goes from x by

    c = -sum_i dE/dx_i / sum_i d_i,

Newton's step, exact but for wind, whose d is an upper bound: E never rises. What rests where forces balance stays.

At the start it goes from where a body that it does not touch may have carried it; the region's anchors go along. Cloth
that falls freely goes a decimetre in a step; with the region in which candidates are known left behind, every vertex is
granted that way to any side, all pairs of triangles are candidates, and what is not granted is lost to the fall. Not
where c is within the SHARE of what the search has to spare anyhow.

At the end, since contact stops vertices one by one, and what a budget then leaves undone is momentum that comes from
nowhere: two cloths that stick to each other went off at 170 m/s.

A body that the cloth may touch does not come along. So beside one this is done where, before the cloth goes, along its
way and there, the box around all that it may reach within its region is apart from the body's likewise by more than
contact reaches: then no stencil of both is in question, and the list is complete without any. Ours.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.as_one import sum_up
from tryon_solver.linalg.launch import launch
from tryon_solver.stepping.gradient import elastic_gradient
from tryon_solver.stepping.record import as_one
from tryon_solver.stepping.search import KEPT_APART, follow, search_slack

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

SHARE = 0.5  # of the search's slack


@wp.kernel
def spread_diagonal_kernel(diagonal: wp.array(dtype=wp.float32), spread_out: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    spread_out[i] = wp.vec3(diagonal[i])


@wp.kernel
def surround_kernel(
    cloth_count: int,
    anchor: wp.array(dtype=wp.vec3),
    budget: wp.array(dtype=wp.float32),
    boxes: wp.array(dtype=wp.vec3),
):
    """Largest x and largest -x of the balls of the cloth's region, then of the body's."""
    i = wp.tid()
    side = wp.where(i < cloth_count, 0, 2)
    grown = wp.vec3(budget[i])
    wp.atomic_max(boxes, side, anchor[i] + grown)
    wp.atomic_max(boxes, side + 1, grown - anchor[i])


@wp.func
def are_apart(boxes: wp.array(dtype=wp.vec3), way: wp.vec3, reach: float) -> bool:
    """Are they by more than `reach` [m], wherever on its way the cloth is?"""
    above = -boxes[3] - wp.max(boxes[0], boxes[0] + way)
    below = wp.min(-boxes[1], way - boxes[1]) - boxes[2]
    return KEPT_APART * wp.length(wp.max(wp.max(above, below), wp.vec3())) > reach


@wp.kernel
def tell_apart_kernel(boxes: wp.array(dtype=wp.vec3), reach: float, apart_out: wp.array(dtype=wp.int32)):
    apart_out[0] = wp.where(are_apart(boxes, wp.vec3(), reach), 1, 0)


@wp.kernel
def find_way_kernel(
    least: float,
    slowest: float,
    dt: wp.array(dtype=wp.float32),
    total: wp.array(dtype=wp.vec3),
    stiffness: wp.array(dtype=wp.vec3),
    boxes: wp.array(dtype=wp.vec3),
    reach: float,
    way_out: wp.array(dtype=wp.vec3),
):
    """-total/stiffness where that is longer than `least` and `slowest` dt, and keeps the boxes apart; the three of
    `stiffness` are equal."""
    way = -total[0] / stiffness[0][0]
    if wp.length(way) <= wp.max(least, slowest * dt[0]) or not are_apart(boxes, way, reach):
        way = wp.vec3()
    way_out[0] = way


@wp.kernel
def go_along_kernel(way: wp.array(dtype=wp.vec3), x: wp.array(dtype=wp.vec3), anchor: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    x[i] = x[i] + way[0]
    anchor[i] = anchor[i] + way[0]


class Coasting:
    """`total` (1,) N of dE/dx, `stiffness` (1,) N/m, thrice, and the `way` (1,) m; `boxes` (4,) m as `surround_kernel`
    has them, infinitely far away where there is no body, and whether they are `apart` (1,) int32."""

    def __init__(self, device: str) -> None:
        self.total, self.stiffness, self.way = (wp.zeros(1, dtype=wp.vec3, device=device) for _ in range(3))
        self.boxes = wp.full(4, wp.vec3(-math.inf), dtype=wp.vec3, device=device)
        self.apart = wp.ones(1, dtype=wp.int32, device=device)


def may_coast(sim: Simulation) -> bool:
    """May the cloth touch itself?"""
    return sim.cloth in sim.touching


def coast(sim: Simulation) -> None:
    """Take x, and x_feasible with it, as one to where forces balance, when these are known for the step."""
    if may_coast(sim):
        where_apart(sim, lambda: go_to_balance(sim, least=SHARE * search_slack(sim)))
        wp.copy(sim.state.x_feasible, sim.state.x)


def keep_momentum(sim: Simulation) -> None:
    """Take x as one to where forces balance, where a correction has ended further off than its tolerance."""
    if may_coast(sim):
        go = partial(go_to_balance, sim, slowest=sim.settings.correction_tolerance)
        as_one(sim, "keep_momentum", lambda: where_apart(sim, go))


def where_apart(sim: Simulation, go: Callable[[], None]) -> None:
    """Launch `go` unless there is a body in reach that the cloth may touch."""
    if len(sim.touching) == 1:
        go()
        return
    coasting, region, device = sim.coasting, sim.region, sim.device
    coasting.boxes.fill_(wp.vec3(-math.inf))
    balls = [sim.cloth_count, region.anchor, region.budget]
    launch(surround_kernel, sim.all_count, balls, [coasting.boxes], device=device)
    launch(tell_apart_kernel, 1, [coasting.boxes, reach_of(sim)], [coasting.apart], device=device)
    wp.capture_if(coasting.apart, go)


def reach_of(sim: Simulation) -> float:
    """How far contact reaches [m]: that of cloth with a body or with itself, whichever is more."""
    return max(surface.reach for surface in sim.touching)


def go_to_balance(sim: Simulation, least: float = 0.0, slowest: float = 0.0) -> None:
    """Move the cloth in x by c, and the region's anchors, if that is longer than `least` [m] and faster than `slowest`
    [m/s]."""
    work, count, device, coasting = sim.work, sim.cloth_count, sim.device, sim.coasting
    elastic_gradient(sim, sim.state.x, work.gradient)
    sum_up(work.gradient, count, coasting.total)
    spread = work.total[:count]
    launch(spread_diagonal_kernel, count, [work.diagonal], [spread], device=device)
    sum_up(spread, count, coasting.stiffness)
    seen = [least, slowest, sim.state.dt, coasting.total, coasting.stiffness, coasting.boxes, reach_of(sim)]
    launch(find_way_kernel, 1, seen, [coasting.way], device=device)
    launch(go_along_kernel, count, [coasting.way], [sim.state.x, sim.region.anchor], device=device)
    follow(sim, near=False)
