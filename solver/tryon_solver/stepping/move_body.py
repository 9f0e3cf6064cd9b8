"""Moving the body: carry, kinematic sub-steps, and a feasible state at the new pose."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.body import carry as carrying
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read
from tryon_solver.stepping.carry_once import carry_once, look_ahead, looks_ahead
from tryon_solver.stepping.leap import feel_motion, join_motion
from tryon_solver.stepping.search import search_slack

if TYPE_CHECKING:
    from tryon_solver.simulation import PoseInterval, Simulation


def move_body(sim: Simulation, interval: PoseInterval) -> None:
    """Take the body from its pose to the interval's end pose; leaves a feasible state (x, collision surface).

    First the root's rigid motion for everybody: a common rigid motion creates no contact. Then, in sub-steps, the rest
    of the motion along one field for cloth and surface, as far as it is proven free. Where it isn't, the surface lags.
    A step has so many sub-steps at most: a pose further away than they reach is come to in the next ones.
    """
    state, settings, body = sim.state, sim.settings, sim.body
    sim.pace.begin_step(interval.left)
    sim.listed = False
    sim.counters.asked, sim.counters.behind = None, 0.0
    for start in (state.x_committed, state.x_start):
        wp.copy(start, state.x)
    if body is not None:
        assert interval.end is not None
        moving = body.moving
        start, stance = body.pose, interval.end
        before, end = body.transforms(), moving.transforms(stance)
        motion = end[0] @ np.linalg.inv(before[0])
        root = wp.mat44(*motion.ravel())
        launch(carrying.rigid_kernel, sim.all_count, [root], [state.x], device=sim.device)
        launch(carrying.rigid_kernel, sim.body_count, [root], [body.skin_now], device=sim.device)
        if sim.touching:
            launch(carrying.rigid_kernel, sim.all_count, [root], [sim.region.anchor], device=sim.device)
        before = motion @ before
        carrying.set_places(body.carry, state.x, settings.carry_none)
        set_displacement(sim, before, end, stance)
        measure_travel(sim)
        sight = None
        if goes_on(sim, before, end):
            sight, travel = look_ahead(sim, 1.0)
        else:
            travel = float(read(sim.largest_out)[0][0])
        count = max(1, math.ceil(travel / settings.substep_travel))
        short = count > settings.most_substeps
        if short:
            count, share = settings.most_substeps, settings.most_substeps / count
            asked = body.skin_next.numpy().copy()
            stance = moving.part_way(start, stance, share)
            end = moving.transforms(stance)
            moving.write(end, stance, body.skin_next)
            sim.counters.asked, sim.counters.behind = asked, farthest(asked, body.skin_next.numpy())
        body.reached = stance, end
        count = sim.pace.substeps(count)
        for k in range(1, count + 1):
            part, after = stance, end
            if k < count:
                part = moving.between(start, stance, k / count)
                after = moving.transforms(part)
                after = end[0] @ np.linalg.inv(after[0]) @ after
            if count > 1 or short:
                set_displacement(sim, before, after, part)
                sight = None
            carry_once(sim, k == count, sight)
            before = after
        sim.counters.substeps += count
        sim.substeps = count
        limit_return(sim, interval.dt)
        if sim.comes_along:
            join_motion(sim, interval.dt)
        else:
            feel_motion(sim, interval.dt)
    sim.searches = 0
    wp.copy(state.x_feasible, state.x)
    sim.most_cycles.fill_(sim.pace.cycles())


def farthest(a: np.ndarray, b: np.ndarray) -> float:
    """Largest distance [m] of vertices (B, 3) m of the same number."""
    return float(np.linalg.norm(a.astype(np.float64) - b, axis=1).max())


def set_displacement(sim: Simulation, before: np.ndarray, after: np.ndarray, stance: object) -> None:
    """Put into `direction` where the body's motion takes cloth and surface, and into `skin_next` the skin after it.

    `before`, `after` (J, 4, 4) world from rest, with the same root; `stance` the body's after the motion.
    """
    body, work, settings, device = sim.body, sim.work, sim.settings, sim.device
    assert body is not None
    body.moving.write(after, stance, body.skin_next)
    motions = after @ np.linalg.inv(before)
    full, none = settings.carry_full, settings.carry_none
    carrying.find_field(body.carry, motions, sim.state.x, full, none, work.direction)
    launch(
        carrying.surface_kernel,
        sim.body_count,
        [sim.cloth_count, body.skin_now, body.skin_next],
        [work.direction],
        device=device,
    )


def measure_travel(sim: Simulation) -> None:
    """Put into `largest_out` how far skin near the cloth is moved relative to the root, at most [m]."""
    body = sim.body
    assert body is not None
    sim.largest_out.zero_()
    launch(
        carrying.travel_kernel,
        sim.body_count,
        [body.carry.near, body.skin_now, body.skin_next],
        [sim.largest_out],
        device=sim.device,
    )


def goes_on(sim: Simulation, before: np.ndarray, end: np.ndarray) -> bool:
    """Is it as good as known, on a GPU, that the motion from joint transforms (J, 4, 4) to others takes one sub-step
    and a search? The last one took one, and the list of before is not for a body that moves."""
    return sim.substeps == 1 and looks_ahead(sim) and bool(np.abs(end - before).max() > search_slack(sim))


@wp.kernel
def limit_return_kernel(
    cloth_count: int,
    longest: float,
    hold: float,
    firmness: float,
    x: wp.array(dtype=wp.vec3),
    skin: wp.array(dtype=wp.vec3),
    target_out: wp.array(dtype=wp.vec3),
    hold_out: wp.array(dtype=wp.float32),
):
    j = wp.tid()
    lag = skin[j] - x[cloth_count + j]
    size = wp.length(lag)
    hold_out[j] = hold + firmness * size
    if size > longest:
        lag = (longest / size) * lag
    target_out[j] = x[cloth_count + j] + lag


def limit_return(sim: Simulation, dt: float) -> None:
    """Where the surface is drawn in the coming step, to the skin at no more than `return_speed`, and how firmly."""
    body, settings = sim.body, sim.settings
    assert body is not None
    launch(
        limit_return_kernel,
        sim.body_count,
        [
            sim.cloth_count,
            settings.return_speed * dt,
            settings.skin_hold,
            settings.skin_firmness,
            sim.state.x,
            body.skin_now,
        ],
        [sim.state.skin, sim.state.hold],
        device=sim.device,
    )
