"""Moving the body: carry, kinematic sub-steps, and a feasible state at the new pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.body import carry as carrying
from tryon_solver.body.pose import Pose, world_from_rest
from tryon_solver.contact import bounds, candidates
from tryon_solver.contact.deflect import deflect

if TYPE_CHECKING:
    from tryon_solver.simulation import PoseInterval, Simulation


FILTER_ROUNDS = 4  # of turning a motion aside before it is shortened for good
HELD_GAP = 0.3  # share of the activation distance that the carried motion leaves: room to slide for cloth in a fold


def move_body(sim: Simulation, interval: PoseInterval) -> None:
    """Take the body from its pose to the interval's end pose; leaves a feasible state (x, collision surface).

    Every sub-step: the root's rigid motion for everybody (a common rigid motion creates no contact), then the rest of
    the motion along one field for cloth and surface, as far as it is proven free. Where it isn't, the surface lags.
    """
    state, settings = sim.state, sim.settings
    sim.dt = interval.dt
    wp.copy(state.x_start, state.x)
    if sim.body is not None:
        assert sim.scene.body is not None
        assert interval.start is not None
        assert interval.end is not None
        carrying.set_weights(
            sim.body.carry,
            state.x,
            state.x[sim.cloth_count :],
            sim.cloth_count,
            settings.carry_full,
            settings.carry_none,
        )
        before = world_from_rest(sim.scene.body, interval.start)
        count = substep_count(sim, before, interval.end)
        for k in range(1, count + 1):
            pose = interval.end if k == count else Pose.interpolate(interval.start, interval.end, k / count)
            after = world_from_rest(sim.scene.body, pose)
            carry_once(sim, before, after, pose)
            before = after
        sim.counters.substeps += count
        limit_return(sim, interval.dt)
    wp.copy(state.x_feasible, state.x)


def substep_count(sim: Simulation, before: np.ndarray, end: Pose) -> int:
    """Sub-steps so that no skin near the cloth moves further than `substep_travel` m relative to the root in one."""
    body = sim.body
    assert body is not None
    after = world_from_rest(body.skinning.model, end)
    body.skinning.run(end, body.skin_next)
    sim.largest_out.zero_()
    wp.launch(
        carrying.travel_kernel,
        sim.body_count,
        [body.carry.near, wp.mat44(*(after[0] @ np.linalg.inv(before[0])).ravel()), body.skin_now, body.skin_next],
        [sim.largest_out],
        device=sim.device,
    )
    travel = float(sim.largest_out.numpy()[0])
    return int(np.clip(np.ceil(travel / sim.settings.substep_travel), 1, sim.settings.most_substeps))


def carry_once(sim: Simulation, before: np.ndarray, after: np.ndarray, pose: Pose) -> None:
    """One kinematic sub-step."""
    state, work, body, device = sim.state, sim.work, sim.body, sim.device
    assert body is not None
    motions = after @ np.linalg.inv(before)
    root = wp.mat44(*motions[0].ravel())
    wp.launch(carrying.rigid_kernel, sim.all_count, [root], [state.x], device=device)
    wp.launch(carrying.rigid_kernel, sim.body_count, [root], [body.skin_now], device=device)
    body.carry.motions.assign((motions @ np.linalg.inv(motions[0])).astype(np.float32))
    body.skinning.run(pose, body.skin_next)
    wp.launch(
        carrying.field_kernel,
        sim.cloth_count,
        [body.carry.weights, body.carry.motions, state.x],
        [work.direction],
        device=device,
    )
    wp.launch(
        carrying.surface_kernel,
        sim.body_count,
        [sim.cloth_count, body.skin_now, body.skin_next],
        [work.direction],
        device=device,
    )
    if sim.touching:
        filter_motion(sim)
    else:
        work.alpha.fill_(1.0)
    wp.launch(bounds.move_kernel, sim.all_count, [state.x, work.direction, work.alpha], [state.x], device=device)
    wp.copy(body.skin_now, body.skin_next)


def filter_motion(sim: Simulation) -> None:
    """Make the motion in `direction` free of contact: turn it aside where it would close a gap, shorten what is left.

    A round looks only at the stencils whose relative motion could bring them together, which proves a motion that is
    then taken as it is. A motion that had to be changed is looked at afresh in the next round, since changing it
    changes its neighbours' relative motion. Should the rounds not suffice, all that could meet under any shortening is
    searched.
    """
    work, settings = sim.work, sim.settings
    reach = max(sim.contact.sizes.xi_body, sim.contact.sizes.xi_self)
    for _ in range(FILTER_ROUNDS):
        work.alpha.fill_(1.0)
        find(sim, reach, 0.0, relative=True)
        if shorten(sim) == 0:
            return
        turn_aside(sim)
        work.alpha.fill_(1.0)
        shorten(sim)
        wp.launch(scale_by_kernel, sim.all_count, [work.alpha], [work.direction], device=sim.device)
    slack = settings.search_slack
    candidates.sweep(sim.inner, sim.state.x, work.direction, slack)
    find(sim, reach, slack, relative=False)
    turn_aside(sim)
    bounds.stay_in_boxes(sim.state.x, work.direction, sim.inner, work.alpha)
    shorten(sim)


@wp.kernel
def scale_by_kernel(alpha: wp.array(dtype=wp.float32), direction: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    direction[i] = alpha[i] * direction[i]


def turn_aside(sim: Simulation) -> None:
    """Deflect `direction` where it would close a gap among the candidates."""
    deflect(
        sim.candidates,
        sim.cloth_count,
        sim.contact.sizes,
        sim.state.x,
        sim.work.direction,
        sim.largest(sim.work.direction),
        sim.work.changed,
        sim.deflection,
        sim.work.hits,
        sim.settings.deflection_passes,
        HELD_GAP * sim.settings.d_hat,
    )


def find(sim: Simulation, reach: float, slack: float, relative: bool) -> None:
    """Candidates within `reach` m for motions within `slack` m of the one in `direction` from x."""
    candidates.sweep(sim.boxes, sim.state.x, sim.work.direction, 0.5 * reach + slack)
    candidates.find(
        sim.candidates,
        sim.cloth,
        sim.touching,
        sim.boxes,
        sim.group,
        sim.state.x,
        sim.work.direction,
        reach + 2 * slack,
        relative=relative,
    )


def shorten(sim: Simulation) -> int:
    """Shrink `alpha` until the motion is proven free; returns the passes that shortened something."""
    return bounds.shorten(
        sim.candidates,
        sim.cloth_count,
        sim.contact.sizes,
        sim.state.x,
        sim.work.direction,
        sim.largest(sim.work.direction),
        sim.work.alpha,
        sim.work.changed,
        sim.work.hits,
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
    wp.launch(
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
