"""Cloth that touches itself alone goes along its mean motion before a step looks for contact.

A motion that all vertices have in common brings no two of them nearer. Cloth that falls freely goes a decimetre in a
step; with the region in which candidates are known left behind, every vertex is granted that way to any side, all pairs
of triangles are candidates, and what is not granted is lost to the fall. So the step begins from

    x_feasible = x + c,   c = dt (w + (w - w_last)),   w = sum_i m_i (v_i - (x_i - x_start_i)/dt) / sum_i m_i,

x being where a body that it does not touch may have carried it, x_start without one. That is feasible since x is, the
region's anchors with it; w_last is w of the step before, so that what it gains by its weight is in it and cloth that
hangs at rest stays where it is. Not where c is within the SHARE of what the search has to spare anyhow, and not where
cloth touches a body, which does not come along. Ours.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.as_one import sum_up
from tryon_solver.linalg.launch import launch
from tryon_solver.stepping.search import search_slack

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

SHARE = 0.5  # of the search's slack


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


class Coasting:
    """`mean` (1,) m/s and `mean_last`, the same of the step before, if it is `known`; `way` (1,) m, of this step."""

    def __init__(self, device: str) -> None:
        self.mean, self.mean_last, self.way = (wp.zeros(1, dtype=wp.vec3, device=device) for _ in range(3))
        self.known = False


def coast(sim: Simulation, dt: float) -> None:
    """Take the cloth in x along its mean motion of a step of dt [s], where it may touch nothing but itself."""
    if len(sim.touching) != 1 or sim.touching[0] is not sim.cloth:
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
