"""Sleep: when nothing moves, nothing is done.

Intervals through which cloth and body stand still are passed over; their only trace is the clock's (METHOD.md
section 2).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.read_back import read
from tryon_solver.linalg.vectors import dot, find_largest, subtract
from tryon_solver.plan import Contribution
from tryon_solver.scene import Sleep

if TYPE_CHECKING:
    from tryon_solver.simulation import PoseInterval, Simulation


def bind(spec: Sleep, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec of no speed that is low enough is idle."""
    return Contribution("sleep", sleep=partial(awake, spec))


def awake(spec: Sleep, sim: Simulation, intervals: Iterable[PoseInterval]) -> Iterator[PoseInterval]:
    """The intervals that are to be simulated, each to be committed before the next is asked for."""
    for interval in intervals:
        if sim.state.asleep:
            if skin_shift(sim, interval.end) <= spec.shift:
                sim.state.time = interval.end_time
                continue
            sim.wake()
        yield interval
        watch(spec, sim, interval.dt)


def watch(spec: Sleep, sim: Simulation, dt: float) -> None:
    """Count how long nothing has been faster than it may be; fall asleep when that is long enough, at velocity zero.
    Not while it becomes faster all the time, as what begins to fall does."""
    state, work = sim.state, sim.work
    subtract(state.x, state.x_start, work.total)
    find_largest(work.total, sim.largest_out)
    dot(work.total, work.total, work.scalars[0], work.parts)
    largest, together = (float(found[0]) for found in read(sim.largest_out, work.scalars[0]))
    still = largest <= spec.fastest * dt and together <= sim.cloth_count * (spec.speed * dt) ** 2
    speed_sq = together / dt**2
    if state.still <= 0.5 * spec.time:
        state.liveliest = max(speed_sq, state.liveliest if state.still else 0.0)
    state.still = state.still + dt if still else 0.0
    if still and state.still >= spec.time and speed_sq <= state.liveliest:
        state.asleep = True
        state.v.zero_()


def skin_shift(sim: Simulation, stance: Any) -> float:
    """Farthest that any point of the skin is at this stance from where it was simulated last [m]."""
    body = sim.body
    if body is None or stance is None:
        return 0.0
    body.moving.take(body.moving.transforms(stance), stance)
    body.moving.write(body.skin_next)
    subtract(body.skin_next, body.skin_now, body.skin_next)
    return sim.largest(body.skin_next)
