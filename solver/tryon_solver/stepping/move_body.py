"""Moving the body: carry, kinematic sub-steps, and a feasible state at the new pose."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import warp as wp

from tryon_solver.geometry import rigid
from tryon_solver.linalg.clear import clear
from tryon_solver.linalg.read_back import read
from tryon_solver.stepping.carry_once import carry_once, looks_ahead, set_out_and_go
from tryon_solver.stepping.leap import feel_motion, join_motion
from tryon_solver.stepping.record import as_one
from tryon_solver.stepping.search import search_slack

if TYPE_CHECKING:
    from tryon_solver.body.posed import PosedBody
    from tryon_solver.simulation import PoseInterval, Simulation


def move_body(sim: Simulation, interval: PoseInterval, solve_freely: Callable[[Simulation], None]) -> None:
    """Take the body from its pose to the interval's end pose; leaves a feasible state (x, collision surface).

    First the root's rigid motion for everybody: a common rigid motion creates no contact. Then, in sub-steps, the rest
    of the motion along one field for cloth and surface, as far as it is proven free. Where it isn't, the surface lags.
    A step has so many sub-steps at most: a pose further away than they reach is come to in the next ones.

    A GPU that finds all of a sub-step's motion free may take it and `solve_freely` at once, of which `sim.under_way`
    tells.
    """
    sim.pace.begin_step(interval.left)
    sim.listed, sim.under_way = False, False
    sim.counters.asked, sim.counters.behind = None, 0.0
    if sim.body is None:
        go_alone(sim)
    else:
        go_with_body(sim, sim.body, interval.end, lambda: begin_solve(sim, solve_freely))
    sim.searches = 0
    if not sim.under_way:
        as_one(sim, "come_along" if sim.comes_along else "arrive", lambda: arrive(sim))
    sim.tell_cycles(sim.pace.cycles())


def go_alone(sim: Simulation) -> None:
    """Where there is no body: let pieces that nothing else touches go their ways, as far as these are proven free."""
    depart(sim)
    flight = sim.flight
    if flight is None:
        return

    def set_off() -> None:
        flight.set_off(sim)
        sim.work.direction.zero_()
        flight.take_way(sim)

    as_one(sim, "set_off", set_off)
    if flight.under_way:
        carry_once(sim, last=True, sight=None)


def go_with_body(sim: Simulation, body: PosedBody, stance: Any, begin: Callable[[], None]) -> None:
    """Go with the body to the stance, in sub-steps. Where one is enough and all of its motion is free, a GPU goes and
    begins what follows before the host knows."""
    settings, moving, start = sim.settings, body.moving, body.pose
    before, end = body.transforms(), moving.transforms(stance)
    root = end[0] @ rigid.inverse(before[0])
    before = root @ before
    take_motion(sim, root, before, end, stance)
    if sim.flight is not None:
        sim.flight.look_about(sim)
    sight = None
    if goes_on(sim, before, end):
        sight, sim.under_way, travel = set_out_and_go(sim, lambda: set_out(sim), begin)
    else:
        as_one(sim, "be_brought_along" if sim.comes_along else "set_out", lambda: set_out(sim))
        travel = float(read(sim.largest_out)[0][0])
    count = max(1, math.ceil(travel / settings.substep_travel))
    short = count > settings.most_substeps
    if short:
        count, share = settings.most_substeps, settings.most_substeps / count
        asked = body.skin_next.numpy().copy()
        stance = moving.part_way(start, stance, share)
        end = moving.transforms(stance)
        moving.take(end, stance)
        moving.write(body.skin_next)
        sim.counters.asked, sim.counters.behind = asked, farthest(asked, body.skin_next.numpy())
    body.reached = stance, end
    in_parts = count > 1 or short
    if sim.lead is not None and in_parts:
        sim.lead.begin_in_parts(sim, count)
    for k in range(1, count + 1):
        if sim.under_way:
            break
        part, after = stance, end
        if k < count:
            part = moving.between(start, stance, k / count)
            after = moving.transforms(part)
            after = end[0] @ rigid.inverse(after[0]) @ after
        if in_parts:
            take_motion(sim, root, before, after, part)
            as_one(sim, "set_out_in_part", lambda: set_out_in_part(sim))
            sight = None
        carry_once(sim, k == count, sight)
        before = after
    sim.counters.substeps += count
    sim.substeps = count


def begin_solve(sim: Simulation, solve_freely: Callable[[Simulation], None]) -> None:
    """For the device: what follows once cloth and surface have gone with the body."""
    arrive(sim)
    solve_freely(sim)


def arrive(sim: Simulation) -> None:
    """For the device: cloth and surface are where the body has taken them, and the step begins there."""
    if sim.lead is not None:
        sim.lead.part(sim)
    if sim.body is not None:
        if sim.halving is not None:
            sim.halving.measure(sim.state.x_committed, sim.state.x)
        limit_return(sim)
        if sim.comes_along:
            join_motion(sim)
        else:
            feel_motion(sim)
        if sim.flight is not None:
            sim.flight.keep_start(sim)
    wp.copy(sim.state.x_feasible, sim.state.x)


def farthest(a: np.ndarray, b: np.ndarray) -> float:
    """Largest distance [m] of vertices (B, 3) m of the same number."""
    return float(np.linalg.norm(a.astype(np.float64) - b, axis=1).max())


def take_motion(sim: Simulation, root: np.ndarray, before: np.ndarray, after: np.ndarray, stance: object) -> None:
    """Let the body's motion be, as of what sets out next, that from `before` to `after` (J, 4, 4), world from rest,
    with the same root, beside the `root`'s (4, 4), which is everybody's; `stance` is the body's after it."""
    body = sim.body
    assert body is not None
    body.moving.take(after, stance)
    body.carry.take(root, after @ rigid.inverse(before))


def depart(sim: Simulation) -> None:
    """Keep where the step starts."""
    for start in (sim.state.x_committed, sim.state.x_start):
        wp.copy(start, sim.state.x)


def go_along(sim: Simulation) -> None:
    """For the device: the root's motion for everybody, once it is known who flies."""
    state, body = sim.state, sim.body
    assert body is not None
    body.carry.fetch()
    depart(sim)
    if sim.flight is not None:
        sim.flight.set_off(sim)
    anchors = (sim.region.anchor,) if sim.touching else ()
    for places in (state.x, body.skin_now, *anchors):
        body.carry.move_along(places)
    body.carry.set_places(state.x, sim.settings.carry_none)


def set_out(sim: Simulation) -> None:
    """For the device: the root's motion, and what comes of the rest of it."""
    go_along(sim)
    set_displacement(sim)
    if sim.flight is not None:
        sim.flight.feel_beside(sim)
        sim.flight.take_way(sim)
    if sim.lead is not None:
        sim.lead.set_out(sim)
    measure_travel(sim)


def set_out_in_part(sim: Simulation) -> None:
    """For the device: what comes of a part of it; who flies goes all of its way in the first."""
    assert sim.body is not None
    sim.body.carry.fetch()
    set_displacement(sim)
    if sim.flight is not None:
        sim.flight.take_way(sim)
    if sim.lead is not None:
        sim.lead.set_out_in_part(sim)


def set_displacement(sim: Simulation) -> None:
    """Put into `direction` where the body's motion takes cloth and surface, and into `skin_next` the skin after it."""
    body, work, settings = sim.body, sim.work, sim.settings
    assert body is not None
    body.moving.write(body.skin_next)
    body.carry.find_field(sim.state.x, settings.carry_full, settings.carry_none, work.direction)
    body.carry.move_surface(body.skin_now, body.skin_next, work.direction)


def measure_travel(sim: Simulation) -> None:
    """Put into `largest_out` how far skin near the cloth is moved relative to the root, at most [m]."""
    body = sim.body
    assert body is not None
    clear(sim.largest_out)
    body.carry.find_travel(body.skin_now, body.skin_next, sim.largest_out)


def goes_on(sim: Simulation, before: np.ndarray, end: np.ndarray) -> bool:
    """Is it as good as known, on a GPU, that the motion from joint transforms (J, 4, 4) to others takes one sub-step
    and a search? The last one took one, and the list of before is not for a body that moves."""
    alike = sim.substeps == 1 and not sim.comes_along
    return alike and looks_ahead(sim) and bool(np.abs(end - before).max() > search_slack(sim))


def limit_return(sim: Simulation) -> None:
    """Where the surface is drawn in the coming step, to the skin at no more than `return_speed`, and how firmly."""
    assert sim.body is not None
    sim.body.limit_return(sim.settings, sim.state)
