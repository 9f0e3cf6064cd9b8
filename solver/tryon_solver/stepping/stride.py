"""How far the correction goes along Newton's direction: as far as the move before it would have had to go.

Newton's matrix is the Hessian made positive semidefinite, triangle by triangle: where a fold is pressed together, which
the whole garment bears but the triangle alone does not, it is several times as stiff as the potential, and near balance
each iteration leaves most of the way, four fifths, to the next. The potential's slope along a move is known where it
began, -a, and where it ended, b; were it a line in between, it would vanish at

    s = a / (a + b)

times the move. Slow iterations go the same way one after the other, so the next direction is taken s times, at least
once and at most MOST times. What is overdone of the other, stiffer ways the next iteration mends, and a move that led
uphill comes back (overshoot.py). It costs two products of vectors, and one with a number. That projected Hessians are
too stiff: Longva et al. 2023; over-relaxation: Saad 2003, section 4.1. Ours.

What contact stops says nothing of stiffness: the slope that is left there is that of the way which is barred. So a and
b are along the move of those vertices alone that went all their way and no other: not of what contact pushed, nor of
what stopped at the region's border, whose slope is that of a way which is not gone yet. After a move that came back
nothing is known, either.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import dots
from tryon_solver.stepping.progress import FREE_SLOPE, STRIDE

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

MOST = wp.constant(3.0)
AS_WANTED = wp.constant(0.01)  # times its way, that a vertex is off it which nothing stopped or pushed


@wp.kernel
def keep_unstopped_kernel(
    wanted: wp.array(dtype=wp.vec3), moved: wp.array(dtype=wp.vec3), unstopped_out: wp.array(dtype=wp.vec3)
):
    i = wp.tid()
    p, m = wanted[i], moved[i]
    unstopped_out[i] = wp.where(wp.length(m - p) <= AS_WANTED * wp.length(p), m, wp.vec3())


@wp.kernel
def choose_kernel(
    counters: wp.array(dtype=wp.int32),
    room: int,
    there: wp.array(dtype=wp.float32),
    overshot: wp.array(dtype=wp.int32),
    lengths: wp.array(dtype=wp.float32),
):
    """Where there are more pairs than room, or the move came back, the slope at the end is unknown, and so is how far
    to go."""
    a = -lengths[FREE_SLOPE]
    b = there[0]
    lengths[STRIDE] = 1.0
    if counters[0] <= room and overshot[0] == 0 and a > 0.0 and b < 0.0:
        lengths[STRIDE] = a / wp.max(a + b, a / MOST)


@wp.kernel
def stride_kernel(lengths: wp.array(dtype=wp.float32), direction: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    direction[i] = lengths[STRIDE] * direction[i]


def note_unstopped(sim: Simulation) -> None:
    """Where the move begins: put what went all its way of `total` into `direction`, which is free by then, and note the
    potential's slope along both."""
    work, progress = sim.work, sim.progress
    launch(keep_unstopped_kernel, sim.all_count, [work.wanted, work.total], [work.direction], device=sim.device)
    slopes = (work.total, progress.slope), (work.direction, progress.free_slope)
    dots([(work.gradient, way, slope) for way, slope in slopes], work.parts)


def choose_stride(sim: Simulation) -> None:
    """Where it ends, unless it came back: by the slope there along what was noted, which overshoot.py measures."""
    pairs, lengths, there = sim.pairs, sim.progress.lengths, sim.work.scalars[2]
    told = [pairs.counters, pairs.capacity, there, sim.progress.overshot]
    launch(choose_kernel, 1, told, [lengths], device=sim.device)


def stride_out(sim: Simulation) -> None:
    """Make the direction as long as was chosen."""
    lengths, direction = sim.progress.lengths, sim.work.direction
    launch(stride_kernel, sim.all_count, [lengths], [direction], device=sim.device)
