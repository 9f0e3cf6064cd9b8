"""A move of the correction that went too far along a way that leads down first comes back to where it stops descending.

Newton's model has no fourth powers, cloth that turns has: a triangle turned by an angle along straight lines is longer
by its square, and what that costs the cloth is the fourth power of the move. The barrier and the strain limit are
steeper still. Directions that each mend what the one before has overdone and overdo it themselves go on for ever, and
who ends with such a one leaves the cloth with energy that nobody has put into it.

The potential's slope along the move m is known where it begins, a = -g0 . m > 0, and b = g1 . m where it ends, since
the gradient is needed there anyway. In between, with s from 0 to 1, the slope is taken to be Newton's line and a cube,

    f(s) = -a (1 - s) + b s^3,

which meets both; where b > 2 a its integral over the move is above 0, so the potential has risen. x goes back along
the move to f(s) = 0. That way has been proven free (bounds.py). A move that leads uphill from its beginning, as
deflection can make it, goes on, for it is the way that contact leaves; but it goes no further than where the cube is
as much as the line, b s^3 = |a| (1 - s): what rises beyond is no contact's doing. The first FREE moves of a correction
may rise: one takes the cloth to where it turns to, and what it overdoes the next one mends, where steps so short that
nothing is overdone would never come there; b is seldom over 10 a there. One that led to over 30 a, as a stiff spring
does that swings past its middle, comes back as well: of what hundreds of times the slope has done, nothing is mended.
Where a is less than the cloth's energy at the speed CALM, the step began in balance but for a blow to come, of which a
says nothing. The last move, which has none after it, is always looked at like all others. Slopes alone are asked,
since what friction takes has no potential. Line searches by slopes: Nocedal and Wright 2006, section 3.1; those that
let first steps rise: Chamberlain et al. 1982. Ours.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import dots
from tryon_solver.stepping.progress import FOUND, LEFT, SLOPE

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

FREE = wp.constant(1)  # moves of a correction that may rise
RISEN = wp.constant(2.0)  # times the slope it began with, against it: the move has led uphill
CALM = 0.1  # m/s
BEYOND_MENDING = wp.constant(30.0)  # times it, by the next move, what one that may rise has done
ROUNDS = wp.constant(8)  # of Newton's method from above, for a cubic's only root


@wp.func
def share_of_way(a: float, b: float) -> float:
    """s in (0, 1] at which -a (1 - s) + b s^3 = 0, for a, b > 0."""
    s = wp.min(wp.pow(a / b, 1.0 / 3.0), 1.0)
    for _ in range(ROUNDS):
        s -= (b * s * s * s + a * s - a) / (3.0 * b * s * s + a)
    return s


@wp.kernel
def judge_kernel(
    counters: wp.array(dtype=wp.int32),
    room: int,
    mass: wp.array(dtype=wp.float32),
    calm: float,
    there: wp.array(dtype=wp.float32),
    state: wp.array(dtype=wp.int32),
    lengths: wp.array(dtype=wp.float32),
    share_out: wp.array(dtype=wp.float32),
    overshot_out: wp.array(dtype=wp.int32),
):
    """Where there are more pairs than room the slope at the end is unknown: nothing is said of it. With less
    to lose than what the cloth's `mass` (1,) kg has at the speed `calm` m/s, a first move may do anything."""
    a = wp.abs(lengths[SLOPE])  # against it where contact has turned the move uphill
    b = there[0]
    first = state[FOUND] <= FREE and state[LEFT] > 0
    most = wp.where(first, BEYOND_MENDING, RISEN)
    least = wp.where(first, 0.5 * mass[0] * calm * calm, 0.0)
    overshot_out[0] = wp.where(counters[0] <= room and a > least and b > most * a, 1, 0)
    if overshot_out[0] == 1:
        share_out[0] = share_of_way(a, b)


@wp.kernel
def retreat_kernel(share: wp.array(dtype=wp.float32), x_before: wp.array(dtype=wp.vec3), x: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    x[i] = x_before[i] + share[0] * (x[i] - x_before[i])


def measure_slopes(sim: Simulation, there: wp.array) -> None:
    """Of the potential where the move ends: along it, into `there`, and along what nothing stopped (stride.py)."""
    work = sim.work
    slopes = (work.total, there), (work.direction, work.scalars[2])
    dots([(work.gradient, way, slope) for way, slope in slopes], work.parts)


def retreat_if_overshot(sim: Simulation, measure: Callable[[], None], come_back: Callable[[], None]) -> None:
    """Look at the move `total` from `x_searched` to x, whose pairs are collected, and shorten it if it has led uphill.

    `measure` puts the gradient at x into `gradient`; `come_back` collects the pairs once x has been put back.
    """
    progress, work = sim.progress, sim.work
    there, share = work.scalars[0], work.scalars[1]

    def retreat() -> None:
        launch(retreat_kernel, sim.all_count, [share, sim.x_searched], [sim.state.x], device=sim.device)
        come_back()
        measure()

    measure()
    measure_slopes(sim, there)
    judged = [progress.state, progress.lengths, share, progress.overshot]
    told = [sim.pairs.counters, sim.pairs.capacity, sim.mass_told, CALM, there]
    launch(judge_kernel, 1, told, judged, device=sim.device)
    wp.capture_if(progress.overshot, retreat)
