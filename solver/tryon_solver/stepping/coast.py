"""Cloth that touches no body goes along its mean motion before a step looks for contact.

A motion that all vertices have in common brings no two of them nearer. Cloth that falls freely goes a decimetre in a
step; with the region in which candidates are known left behind, every vertex is granted that way to any side, all pairs
of triangles are candidates, and what is not granted is lost to the fall. So the step begins from

    x_feasible = x + c,   c = dt (w + (w - w_last)),   w = sum_i m_i (v_i - (x_i - x_start_i)/dt) / sum_i m_i,

x being where a body that it does not touch may have carried it, x_start without one. That is feasible since x is, the
region's anchors with it; w_last is w of the step before, so that what it gains by its weight is in it and cloth that
hangs at rest stays where it is. Not where c is within the SHARE of what the search has to spare anyhow.

Beside a body that the cloth may touch and does not, since no pair at x_feasible is the body's, the mean way is that of
the trial, which all forces have a part in: c = sum_i m_i (x_trial_i - x_feasible_i) / sum_i m_i. It is searched along,
and the cloth goes as one, up to the first impact on the body that it meets there: nothing is strained, and two of its
vertices are as far from each other as before. The list is complete on all of the way, for anchors that ride along as
one: they are put at the share that was taken. The rest of c is the correction's. Not where c is within LEAST_EDGES of
the cloth: that far everyone may be granted to any side, and a correction whose iterations are few does better from
where the step began. Where cloth touches the body, which does not come along, nothing is done. Ours.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.contact import bounds, pairs
from tryon_solver.linalg.as_one import sum_up
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read
from tryon_solver.stepping.search import follow, place_anchors, search_along, search_slack

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

SHARE = 0.5  # of the search's slack
LEAST_EDGES = 0.25  # mean edges of the cloth, beside a body that it may touch


@wp.kernel
def momentum_kernel(
    mass: wp.array(dtype=wp.float64),
    v: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    dt: float,
    share: wp.float64,
    momentum_out: wp.array(dtype=wp.vec3),
):
    """m (v - (x - x_start)/dt) / sum m, x_start to x being the way that the cloth was carried."""
    i = wp.tid()
    momentum_out[i] = wp.float32(share * mass[i]) * (v[i] - (x[i] - x_start[i]) / dt)


@wp.kernel
def foresee_kernel(
    dt: float,
    known: int,
    mean: wp.array(dtype=wp.vec3),
    mean_last: wp.array(dtype=wp.vec3),
    way_out: wp.array(dtype=wp.vec3),
):
    gained = wp.vec3()
    if known == 1:
        gained = mean[0] - mean_last[0]
    way_out[0] = dt * (mean[0] + gained)
    mean_last[0] = mean[0]


@wp.kernel
def go_along_kernel(
    least: float, way: wp.array(dtype=wp.vec3), x: wp.array(dtype=wp.vec3), anchor: wp.array(dtype=wp.vec3)
):
    i = wp.tid()
    if wp.length(way[0]) > least:
        x[i] = x[i] + way[0]
        anchor[i] = anchor[i] + way[0]


@wp.kernel
def weigh_kernel(
    mass: wp.array(dtype=wp.float64),
    way: wp.array(dtype=wp.vec3),
    share: wp.float64,
    weighed_out: wp.array(dtype=wp.vec3),
):
    """m way / sum m"""
    i = wp.tid()
    weighed_out[i] = wp.float32(share * mass[i]) * way[i]


@wp.kernel
def direct_kernel(cloth_count: int, way: wp.array(dtype=wp.vec3), direction_out: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    direction_out[i] = wp.vec3()
    if i < cloth_count:
        direction_out[i] = way[0]


@wp.kernel
def go_kernel(share: float, direction: wp.array(dtype=wp.vec3), x: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    x[i] = x[i] + share * direction[i]


class Coasting:
    """`mean` (1,) m/s and `mean_last`, the same of the step before, if it is `known`; `way` (1,) m, of this step, and
    the `share` (1,) of it that is free."""

    def __init__(self, device: str) -> None:
        self.mean, self.mean_last, self.way = (wp.zeros(1, dtype=wp.vec3, device=device) for _ in range(3))
        self.share = wp.zeros(1, dtype=wp.float32, device=device)
        self.known = False


def coast(sim: Simulation, dt: float) -> None:
    """Take the cloth in x along its mean motion of a step of dt [s], where it may touch nothing but itself."""
    if not is_alone(sim):
        return
    state, count, device, coasting = sim.state, sim.cloth_count, sim.device, sim.coasting
    momentum = sim.work.total[:count]
    weighed = [sim.rest.mass, state.v, state.x_start, state.x, dt, 1.0 / float(sim.mass.sum())]
    launch(momentum_kernel, count, weighed, [momentum], device=device)
    sum_up(momentum, count, coasting.mean)
    seen = [dt, int(coasting.known), coasting.mean]
    launch(foresee_kernel, 1, seen, [coasting.mean_last, coasting.way], device=device)
    coasting.known = True
    least = SHARE * search_slack(sim)
    launch(go_along_kernel, count, [least, coasting.way], [state.x, sim.region.anchor], device=device)


def is_alone(sim: Simulation) -> bool:
    """May the cloth touch itself, and nothing else?"""
    return len(sim.touching) == 1 and sim.touching[0] is sim.cloth


def coast_to_trial(sim: Simulation) -> None:
    """Take the cloth from x_feasible along the mean of `to_trial`, as one and as far as it meets nothing, where it may
    touch a body and does not; what is left of `to_trial` is the rest. The pairs are those at x_feasible again.

    Waits for the device. Not where all would stay within the region of a list without candidates.
    """
    if not sim.touching or is_alone(sim) or sim.pairs.of_body:
        return
    coasting, state, work, count, device = sim.coasting, sim.state, sim.work, sim.cloth_count, sim.device
    if not sim.candidates.size and not bounds.outside(state.x_feasible, sim.to_trial, sim.region, work.hits):
        return
    weighed = work.total[:count]
    launch(weigh_kernel, count, [sim.rest.mass, sim.to_trial, 1.0 / float(sim.mass.sum())], [weighed], device=device)
    sum_up(weighed, count, coasting.way)
    way = read(coasting.way)[0][0]
    if not float(way @ way) > (LEAST_EDGES * sim.mean_edge) ** 2:
        return
    wp.copy(state.x, state.x_feasible)
    launch(direct_kernel, sim.all_count, [count, coasting.way], [work.direction], device=device)
    search_along(sim, state.x, work.direction, 1.0)
    bounds.first_impact(sim.candidates, count, sim.contact.sizes, state.x, work.direction, coasting.share)
    share = float(read(coasting.share)[0][0])
    place_anchors(sim, share)
    for start in (state.x, sim.x_carried):
        launch(go_kernel, count, [share, work.direction], [start], device=device)
    launch(go_kernel, count, [-share, work.direction], [sim.to_trial], device=device)
    follow(sim, near=False)
    wp.copy(state.x_feasible, state.x)
    sim.searches = 0
    pairs.collect(sim.pairs, sim.candidates, sim.contact, state.x_feasible)
    for term in sim.stages.contact:
        term.make_room(sim.pairs)
