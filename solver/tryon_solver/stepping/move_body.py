"""Moving the body: carry, kinematic sub-steps, and a feasible state at the new pose."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.body import carry as carrying
from tryon_solver.contact import bounds, candidates
from tryon_solver.contact.deflect import deflect
from tryon_solver.linalg.device_loop import NUMBER
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read
from tryon_solver.stepping.leap import feel_motion
from tryon_solver.stepping.record import as_one
from tryon_solver.stepping.search import follow, list_holds, place_anchors, search_along, search_further

if TYPE_CHECKING:
    from tryon_solver.simulation import PoseInterval, Simulation


FILTER_ROUNDS = 4  # of turning a motion aside and searching further, before it is shortened for good
HELD_GAP = 0.3  # share of the activation distance that the carried motion leaves: room to slide for cloth in a fold


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
        launch(carrying.rigid_kernel, sim.all_count, [root], [sim.region.anchor], device=sim.device)
        before = motion @ before
        carrying.set_places(body.carry, state.x, settings.carry_none)
        set_displacement(sim, before, end, stance)
        travel = largest_travel(sim)
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
            carry_once(sim, last=k == count)
            before = after
        sim.counters.substeps += count
        limit_return(sim, interval.dt)
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


def largest_travel(sim: Simulation) -> float:
    """How far skin near the cloth is moved relative to the root, at most [m]."""
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
    return float(read(sim.largest_out)[0][0])


def carry_once(sim: Simulation, last: bool) -> None:
    """One kinematic sub-step along `direction`. The search of the last one is for the rest of the step as well."""
    state, work, body, device = sim.state, sim.work, sim.body, sim.device
    assert body is not None
    work.alpha.fill_(1.0)
    if sim.touching:
        if not list_holds(sim, state.x, work.direction):
            search_along(sim, state.x, work.direction, 1.0 if last else 0.0)
            place_anchors(sim, 1.0)
        if sim.candidates.size:
            filter_motion(sim)
    launch(bounds.move_kernel, sim.all_count, [state.x, work.direction, work.alpha], [state.x], device=device)
    if sim.touching:
        follow(sim, near=False)
    wp.copy(body.skin_now, body.skin_next)


def filter_motion(sim: Simulation) -> None:
    """Make the motion in `direction` free of contact: turn it aside where it would close a gap, shorten what is left.

    Who is held back falls behind its anchor; where it falls out of the region, the search goes further and the motion
    is looked at again. In the end, if need be, the search covers any shortening of the motion.
    """
    work = sim.work
    for _ in range(FILTER_ROUNDS):
        work.alpha.fill_(1.0)
        held, leaving = shortened(sim)
        if leaving:
            search_further(sim, work.direction, work.alpha)
        elif not held:
            return
        turn_aside(sim)
    work.alpha.fill_(1.0)
    if shortened(sim)[1]:
        for alpha in (0.0, 1.0):
            work.alpha.fill_(alpha)
            search_further(sim, work.direction, work.alpha)
        shorten(sim)


def turn_aside(sim: Simulation) -> None:
    """Deflect `direction` where it could close a gap; who cannot collide has no say in it."""
    sizes = sim.contact.sizes
    candidates.list_closing(sim.candidates, sim.work.direction, max(sizes.xi_body, sizes.xi_self))
    deflect(
        sim.candidates,
        True,
        sim.cloth_count,
        sizes,
        sim.state.x,
        sim.work.direction,
        sim.work.changed,
        sim.deflection,
        sim.work.passes,
        sim.settings.deflection_passes,
        HELD_GAP * sim.settings.d_hat,
    )


def shortened(sim: Simulation) -> tuple[int, int]:
    """Shrink `alpha` until the motion is proven free; returns the passes that shortened something, and how many
    vertices leave the region by what is left. Waits for the device."""
    state, work = sim.state, sim.work

    def look() -> None:
        shorten(sim)
        bounds.count_leaving(state.x, work.direction, work.alpha, sim.region, work.hits)

    as_one(sim, "shortened", look)
    passes, leaving = read(work.passes.state, work.hits)
    return int(passes[NUMBER]), int(leaving[0])


def shorten(sim: Simulation) -> None:
    """Shrink `alpha` until the motion is proven free."""
    bounds.shorten(
        sim.candidates,
        False,
        sim.cloth_count,
        sim.contact.sizes,
        sim.state.x,
        sim.work.direction,
        sim.work.alpha,
        sim.work.changed,
        sim.work.passes,
    )


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
