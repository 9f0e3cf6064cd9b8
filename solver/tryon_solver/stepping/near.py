"""Ending the correction where it is near enough to balance: what `Settings.accuracy` asks for, or else
`Settings.correction_nearness`.

Newton's direction leads to where the step balances, as far as conjugate gradients got and the energy is quadratic: its
RMS length over the cloth, times SCALE, is how far that is. SCALE was fitted by steps of 1/60 s: the median, over
garments and motions, of the true error after such a correction over what it was asked for is kept under 1 there; in
steps of 1/30 s it came to 1.6 (METHOD.md section 14). Where directions have not become shorter for PATIENCE
iterations, or, while they are too long for the report to be silent, for PERSISTENCE, none that follows can be hoped
to.

A preset asks for the energy, too: what the cloth would lose on the way by the quadratic model, 1/2 |g . p| of Newton's
direction p, is no more than CALM times 1/2 M nearness^2. In stiff modes much of it lies within little way. And its own
end is another for cloth that hangs still. There every step is near, and by what each leaves undone the cloth would be
seen to tremble: so it has to be near by the way that the step goes, too, beside the body's, OF_WAY of it (METHOD.md
section 14 has what other shares do). And the direction has to be taken, and the one before it: what contact withheld
is left undone as well, in an impact most of it, and what it withheld of the one before is held (hold.py), so that the
direction says nothing of it.

Under a deadline a correction goes on while there is time, however near it is. The last iteration in time, or a late
one, ends it where it is near enough by a coarse measure, `Settings.late_nearness` (stepping/pace.py). Ours.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.advice import FAR
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import dot, dots, subtract
from tryon_solver.stepping.progress import (
    APART,
    BEYOND,
    ENOUGH,
    IN_TIME,
    LAST_ONE,
    LEFT,
    SHORTEST,
    SINCE,
    WITHHELD,
    WITHIN,
)

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

SCALE = 2.0
SHORTER = wp.constant(0.7)  # times the shortest before it, a direction is a gain
PATIENCE = wp.constant(8)  # iterations without one; and
PERSISTENCE = wp.constant(24)  # so many where none has come nearer than
FAR_OFF = wp.constant(FAR)  # times the accuracy that was asked for, beyond which the report says so
CALM = wp.constant(20.0)  # times the energy at the preset's nearness, less than that left to lose is near enough
OF_WAY = 0.3  # share of the step's way that is near enough


@wp.kernel
def compare_kernel(
    nearness: float,
    scale: float,
    of_way: float,
    count: int,
    dt: wp.array(dtype=wp.float32),
    squared: wp.array(dtype=wp.float32),
    way_squared: wp.array(dtype=wp.float32),
    slope: wp.array(dtype=wp.float32),
    mass: wp.array(dtype=wp.float32),
    state_out: wp.array(dtype=wp.int32),
    lengths_out: wp.array(dtype=wp.float32),
):
    off = scale * wp.sqrt(squared[0] / float(count))
    way = wp.sqrt(way_squared[0] / float(count))
    near = nearness * dt[0]
    enough = wp.min(near, of_way * way)
    calm = -slope[0] <= CALM * mass[0] * nearness * nearness
    state_out[APART] = wp.where(off <= near and calm, WITHIN, BEYOND)
    state_out[LAST_ONE] = wp.where(off <= enough and calm, 1, 0)
    lengths_out[ENOUGH] = enough


@wp.kernel
def compare_withheld_kernel(
    scale: float,
    count: int,
    squared: wp.array(dtype=wp.float32),
    lengths: wp.array(dtype=wp.float32),
    state: wp.array(dtype=wp.int32),
):
    withheld = scale * wp.sqrt(squared[0] / float(count))
    if wp.max(withheld, lengths[WITHHELD]) > lengths[ENOUGH]:
        state[LAST_ONE] = 0
    lengths[WITHHELD] = withheld


@wp.kernel
def compare_asked_kernel(
    accuracy: wp.array(dtype=wp.float32),
    squared: wp.array(dtype=wp.float32),
    count: int,
    scale: float,
    state: wp.array(dtype=wp.int32),
    lengths: wp.array(dtype=wp.float32),
):
    length = wp.sqrt(squared[0] / float(count))
    state[SINCE] = state[SINCE] + 1
    if length < SHORTER * lengths[SHORTEST]:
        lengths[SHORTEST] = length
        state[SINCE] = 0
    patience = wp.where(scale * lengths[SHORTEST] > FAR_OFF * accuracy[0], PERSISTENCE, PATIENCE)
    state[LAST_ONE] = wp.where(scale * length <= accuracy[0] or state[SINCE] >= patience, 1, 0)


@wp.kernel
def compare_late_kernel(
    nearness: float,
    dt: wp.array(dtype=wp.float32),
    squared: wp.array(dtype=wp.float32),
    count: int,
    scale: float,
    state: wp.array(dtype=wp.int32),
):
    """Of an iteration that is the last in time, or late."""
    if state[IN_TIME] <= 1 and scale * wp.sqrt(squared[0] / float(count)) <= nearness * dt[0]:
        state[LAST_ONE] = 1


@wp.kernel
def make_last_kernel(state: wp.array(dtype=wp.int32)):
    if state[LAST_ONE] == 1:
        state[LEFT] = 0


def measure_nearness(sim: Simulation, by_preset: bool) -> None:
    """Tell whether the iteration whose direction was found is to be the correction's last, and whether it begins
    further from balance than is near enough: by the accuracy that is asked for, or else, if these count (`by_preset`),
    by the preset's nearness, and when a deadline's time is over by that of the late."""
    settings, state, work, n = sim.settings, sim.state, sim.work, sim.cloth_count
    nearness, told = settings.correction_nearness, sim.progress.state
    direction, squared, way_squared = work.direction[:n], work.scalars[0], work.scalars[1]
    if settings.accuracy is not None:
        dot(direction, direction, squared, work.parts)
        asked = [sim.accuracy, squared, n, SCALE]
        launch(compare_asked_kernel, 1, asked, [told, sim.progress.lengths], device=sim.device)
    elif by_preset and nearness is not None and settings.deadline is None:
        way = work.total[:n]  # which is free until the move
        subtract(state.x[:n], state.x_feasible[:n], way)
        slope = work.scalars[2]
        along = work.gradient, work.direction, slope
        dots([(direction, direction, squared), (way, way, way_squared), along], work.parts)
        enough = [nearness, SCALE, OF_WAY, n, state.dt, squared, way_squared, slope, sim.mass_told]
        launch(compare_kernel, 1, enough, [told, sim.progress.lengths], device=sim.device)
    if by_preset and settings.deadline is not None:
        if settings.accuracy is None:
            sim.progress.last_one.zero_()
            dot(direction, direction, squared, work.parts)
        late = [settings.late_nearness, state.dt, squared, n, SCALE]
        launch(compare_late_kernel, 1, late, [told], device=sim.device)


def make_last_if_near(sim: Simulation) -> None:
    """Let the iteration whose direction was just taken, as far as it is free, be the correction's last if it is near
    enough."""
    settings, work, n = sim.settings, sim.work, sim.cloth_count
    told = sim.progress.state
    if settings.accuracy is None and settings.deadline is None:
        if settings.correction_nearness is None:
            return
        withheld, squared = work.direction[:n], work.scalars[0]  # which is free until the next
        subtract(work.wanted[:n], work.total[:n], withheld)
        dot(withheld, withheld, squared, work.parts)
        launch(compare_withheld_kernel, 1, [SCALE, n, squared, sim.progress.lengths], [told], device=sim.device)
    launch(make_last_kernel, 1, [], [told], device=sim.device)
