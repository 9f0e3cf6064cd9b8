"""Sleep: when nothing moves, nothing is done.

Intervals through which cloth and body stand still are passed over; their only trace is the clock's (METHOD.md
section 2).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.read_back import read
from tryon_solver.linalg.vectors import dot, find_largest, subtract
from tryon_solver.plan import Contribution
from tryon_solver.scene import Sleep

if TYPE_CHECKING:
    from tryon_solver.simulation import PoseInterval, Simulation


def bind(spec: Sleep, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec of no speed that is low enough is idle."""
    return Contribution("sleep", sleep=partial(awake, spec), measure=measure_way)


def measure_way(sim: Simulation) -> None:
    """For the device: how far the step moved a vertex at most [m], and the sum of all ways' squares [m^2]."""
    way = sim.work.total
    subtract(sim.state.x, sim.state.x_start, way)
    find_largest(way, sim.went[:1])
    dot(way, way, sim.went[1:], sim.work.parts)


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
    state = sim.state
    largest, together = map(float, way_of_step(sim))
    still = largest <= spec.fastest * dt and together <= sim.cloth_count * (spec.speed * dt) ** 2
    speed_sq = together / dt**2
    if state.still <= 0.5 * spec.time:
        state.liveliest = max(speed_sq, state.liveliest if state.still else 0.0)
    state.still = state.still + dt if still else 0.0
    if still and state.still >= spec.time and speed_sq <= state.liveliest:
        state.asleep = True
        state.v.zero_()


def way_of_step(sim: Simulation) -> np.ndarray:
    """(2,) as `measure_way` has it, of the step that has ended: a device that ended it by itself has told it."""
    if sim.figures is not None:
        return sim.figures["went"]
    measure_way(sim)
    return read(sim.went)[0]


def skin_shift(sim: Simulation, stance: Any) -> float:
    """Farthest that any point of the skin is at this stance from where it was simulated last [m]."""
    body = sim.body
    if body is None or stance is None:
        return 0.0
    body.moving.take(body.moving.transforms(stance), stance)
    body.moving.write(body.skin_next)
    subtract(body.skin_next, body.skin_now, body.skin_next)
    return sim.largest(body.skin_next)
