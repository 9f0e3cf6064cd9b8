"""Sleep: intervals through which cloth and body stand still are passed over; their only trace is the clock's.

A scene asks for it with the effect Sleep, whose thresholds are used here (METHOD.md section 2).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from tryon_solver.linalg.read_back import read
from tryon_solver.linalg.vectors import dot, find_largest, subtract

if TYPE_CHECKING:
    from tryon_solver.simulation import PoseInterval, Simulation


def awake(sim: Simulation, intervals: Iterable[PoseInterval]) -> Iterator[PoseInterval]:
    """The intervals that are to be simulated, each to be committed before the next is asked for."""
    spec = sim.sleep
    if spec is None:
        yield from intervals
        return
    for interval in intervals:
        if sim.state.asleep:
            if skin_shift(sim, interval.end) <= spec.shift:
                sim.state.time = interval.end_time
                continue
            sim.wake()
        yield interval
        watch(sim, interval.dt)


def watch(sim: Simulation, dt: float) -> None:
    """Count how long nothing has been faster than it may be; fall asleep when that is long enough, at velocity zero."""
    state, work, spec = sim.state, sim.work, sim.sleep
    assert spec is not None
    subtract(state.x, state.x_start, work.total)
    find_largest(work.total, sim.largest_out)
    dot(work.total, work.total, work.scalars[0], work.parts)
    largest, together = (float(found[0]) for found in read(sim.largest_out, work.scalars[0]))
    still = largest <= spec.fastest * dt and together <= sim.cloth_count * (spec.speed * dt) ** 2
    state.still = state.still + dt if still else 0.0
    if still and state.still >= spec.time:
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
