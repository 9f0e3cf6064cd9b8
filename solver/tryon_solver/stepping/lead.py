"""Cloth that goes on beside the body as it went in the last two steps is led there before the step is solved.

The body's motion takes cloth along; what cloth does beside that, as all of a shirt does in a jump, is left to the
solve. But where all vertices of cloth that may touch itself go half an edge, the balls in which contact is looked for
hold every vertex's neighbours, hundreds of thousands of candidates, and Newton's method begins an edge from balance. So
what is expected of the solve is added to the body's motion, along which all move at once, what is met is searched for
and stopped before, and neighbours stay as near as they are.

Expected is what the last step's solve did, as far as it did so in the step before, too: a blow is over. It is smoothed,
since what a budget has left undone differs from vertex to vertex, and led so would grow from step to step. What is
within LED_FROM is left out: balls cover that anyway, and cloth that rests, or follows the body, is led nowhere. Nobody
is led in cloth that is too stiff for its mesh and the step: what leading strains a little begins the solve too far
from balance there. Where the step starts and what it is solved for does not change, only where its solve begins. Ours.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.launch import launch

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

LED_FROM = 0.16  # of the cloth's mean edge
LED_UP_TO = 1.0e6  # k dt^2/(rho a^2), of a mesh whose edges are a: what a strained edge resists, by its inertia
SMOOTHED = 4  # times, over each vertex's neighbours: after fewer a sheet that slides is led out of its shape


@wp.func
def as_much(then: float, now: float) -> float:
    """Of what the last step, of `then` s, did, what one of `now` s does: in a longer one no more; 0 if it is not known.
    """
    if then > 0.0:
        return wp.min(now / then, 1.0)
    return 0.0


@wp.kernel
def usual_kernel(
    solved: wp.array(dtype=wp.vec3),
    before: wp.array(dtype=wp.vec3),
    then: wp.array(dtype=wp.float32),
    now: wp.array(dtype=wp.float32),
    longest: float,
    usual_out: wp.array(dtype=wp.vec3),
):
    """What was done in both steps; nothing, where this one is over the `longest`, s, in which anybody is led."""
    i = wp.tid()
    both = float(0.0)
    if now[0] <= longest and wp.length_sq(solved[i]) > 0.0:
        both = wp.clamp(wp.dot(before[i], solved[i]) / wp.length_sq(solved[i]), 0.0, 1.0)
    usual_out[i] = as_much(then[0], now[0]) * both * solved[i]


@wp.kernel
def smooth_kernel(
    columns: wp.array2d(dtype=wp.int32), usual: wp.array(dtype=wp.vec3), smooth_out: wp.array(dtype=wp.vec3)
):
    """The mean over the row's columns: the vertex itself and its neighbours."""
    i = wp.tid()
    total = usual[i]
    count = float(1.0)
    for k in range(columns.shape[1]):
        j = columns[i, k]
        if j != i:  # which fills rows up
            total += usual[j]
            count += 1.0
    smooth_out[i] = total / count


@wp.kernel
def lead_kernel(
    usual: wp.array(dtype=wp.vec3),
    solved: wp.array(dtype=wp.vec3),
    then: wp.array(dtype=wp.float32),
    now: wp.array(dtype=wp.float32),
    led_count: int,
    least: float,
    x: wp.array(dtype=wp.vec3),
    way_out: wp.array(dtype=wp.vec3),
    expected_out: wp.array(dtype=wp.vec3),
    carried_out: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
):
    """Who flies has `solved` nothing, and is led nowhere, whoever a button may join him to."""
    i = wp.tid()
    led = wp.vec3()
    if i < led_count and wp.length_sq(solved[i]) > 0.0:
        far = wp.length(usual[i])
        if far > least:
            led = (1.0 - least / far) * usual[i]
    way_out[i] = led
    expected_out[i] = as_much(then[0], now[0]) * solved[i] - led
    carried_out[i] = x[i] + direction[i]
    direction[i] = direction[i] + led


@wp.kernel
def lead_in_part_kernel(
    way: wp.array(dtype=wp.vec3),
    share: wp.array(dtype=wp.float32),
    carried: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    carried[i] = carried[i] + direction[i]
    direction[i] = direction[i] + share[0] * way[i]


@wp.kernel
def part_kernel(way: wp.array(dtype=wp.vec3), x: wp.array(dtype=wp.vec3), carried: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    led = way[i]
    taken = float(0.0)
    if wp.length_sq(led) > 0.0:
        taken = wp.clamp(wp.dot(x[i] - carried[i], led) / wp.length_sq(led), 0.0, 1.0)
    carried[i] = x[i] - taken * led


class Lead:
    """Of all A vertices: the `way` (A,) m that each is led in this step, and `expected` (A,) m, what its solve is to
    add.

    By the last step, whose `solved` the simulation has, and the one before: `time` (1,) s is how long the last one was,
    0 if nobody may be led by it; `before` (A,) m is the `solved` of the one before, 0 if that was none to go by, of
    which `known` tells while there is no last one yet. A step of several sub-steps leads by a `share` (1,) of the way
    in each. `stiffness` [1/s^2] is k/(rho a^2) of the cloth, where that is largest, so that nobody is led in a step
    over the `longest` [s]."""

    def __init__(self, count: int, stiffness: float, device: str) -> None:
        def vectors() -> wp.array:
            return wp.zeros(count, dtype=wp.vec3, device=device)

        self.way, self.expected, self.before = vectors(), vectors(), vectors()
        self.time, self.share = (wp.zeros(1, dtype=wp.float32, device=device) for _ in range(2))
        self.known = False
        self.longest = math.sqrt(LED_UP_TO / stiffness) if stiffness > 0.0 else math.inf

    def set_out(self, sim: Simulation) -> None:
        """For the device: let `direction` (A,) m, the body's motion from x, lead the cloth, too; `x_carried` (A,) m is
        where it would come to without. Nobody is led who comes along."""
        state, count = sim.state, 0 if sim.comes_along else sim.cloth_count
        usual, smooth = sim.work.product, sim.work.residual  # free between steps
        done = [sim.solved, self.before, self.time, state.dt, self.longest]
        launch(usual_kernel, count, done, [usual], device=sim.device)
        for _ in range(SMOOTHED):
            launch(smooth_kernel, count, [sim.hessian_rows.columns, usual], [smooth], device=sim.device)
            usual, smooth = smooth, usual
        known = [usual, sim.solved, self.time, state.dt, count, LED_FROM * sim.mean_edge, state.x]
        outputs = [self.way, self.expected, sim.x_carried, sim.work.direction]
        launch(lead_kernel, sim.all_count, known, outputs, device=sim.device)

    def begin_in_parts(self, sim: Simulation, parts: int) -> None:
        """As if nobody had set out from x: so many parts do."""
        self.share.fill_(1.0 / parts)
        wp.copy(sim.x_carried, sim.state.x)

    def set_out_in_part(self, sim: Simulation) -> None:
        """For the device: the same of a part."""
        outputs = [sim.x_carried, sim.work.direction]
        launch(lead_in_part_kernel, sim.all_count, [self.way, self.share], outputs, device=sim.device)

    def part(self, sim: Simulation) -> None:
        """For the device: let `x_carried` be where the body alone has taken everybody: x less what of its way each was
        led, as far as that can be told. Of a motion that was turned aside or stopped, what x lacks along the way is
        taken for a lack of being led, whichever of the two fell short."""
        launch(part_kernel, sim.all_count, [self.way, sim.state.x], [sim.x_carried], device=sim.device)

    def look_back(self, sim: Simulation) -> None:
        """There will be another `solved`, of this step."""
        if self.known:
            wp.copy(self.before, sim.solved)
        else:
            self.before.zero_()
        wp.copy(self.time, sim.state.dt)
        self.known = True

    def forget(self) -> None:
        """Nobody is led until two more steps are known."""
        self.time.zero_()
        self.known = False

    def begin_as(self, worn: Lead | None) -> None:
        """Begin where cloth that is `worn` has ended a step."""
        if worn is not None:
            wp.copy(self.before, worn.before)
            wp.copy(self.time, worn.time)
            self.known = worn.known
