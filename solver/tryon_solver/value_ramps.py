"""Values of effects on their way to others, in a running simulation: an effect comes in, changes and goes gently.

What acts at full strength at once sets the whole garment in motion in one step, which takes several times as many
iterations. So the values that contributions read (plan.py) go from where they are to where they are wanted in equal
shares of simulated time, as an edit's rest shape does (live_edit.py), or from none with a power of it
(effect_words/gentle.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.effect_words.gentle import root
from tryon_solver.simulation import Simulation


@dataclass(frozen=True)
class _Way:
    """From `start` at the time `begun` [s] to `end`, in `seconds`; from or to none with this `power` of time."""

    start: np.ndarray
    end: np.ndarray
    begun: float
    seconds: float
    power: float

    def at(self, time: float) -> np.ndarray:
        share = (time - self.begun) / self.seconds
        if share >= 1.0:
            return self.end
        first, last = root(self.start, self.power), root(self.end, self.power)
        return root(first + (last - first) * share, 1.0 / self.power)

    def left(self, time: float) -> float:
        return max(0.0, self.begun + self.seconds - time)


class ValueRamps:
    """The ways of one garment's values. Whoever drives the simulation calls `before_frame` before each `advance`, and
    goes on doing so with another simulation of the same garment."""

    def __init__(self) -> None:
        self._ways: dict[tuple[str, str], _Way] = {}

    def write(self, simulation: Simulation, name: str, values: Mapping[str, np.ndarray]) -> None:
        """Have the effect's values be these at once; what is not in the plan has none."""
        self.forget(name)
        for value, array in _values_of(simulation, name).items():
            if value in values:
                array.assign(values[value])

    def lead(
        self,
        simulation: Simulation,
        name: str,
        values: Mapping[str, np.ndarray],
        seconds: float,
        power: float = 1.0,
    ) -> None:
        """Have the effect's values go from what they are to these, in so many simulated seconds, 0: at once; from or to
        none with this power of time."""
        if seconds == 0.0:
            self.write(simulation, name, values)
            return
        for value, array in _values_of(simulation, name).items():
            if value in values:
                now = array.numpy().copy()  # of a CPU it is the array itself
                end = values[value].astype(now.dtype)
                self._ways.pop((name, value), None)
                if not np.array_equal(now, end):
                    self._ways[name, value] = _Way(now, end, simulation.state.time, seconds, power)

    def now(self, simulation: Simulation, name: str) -> dict[str, np.ndarray]:
        """The effect's values as they are; none of one that is not in the plan."""
        return {value: array.numpy().copy() for value, array in _values_of(simulation, name).items()}

    def forget(self, name: str) -> None:
        """The effect's values stay what they are."""
        self._ways = {key: way for key, way in self._ways.items() if key[0] != name}

    def before_frame(self, simulation: Simulation, time: float) -> None:
        """Have values be what they should be at the frame's time [s]; what sleeps is woken for them."""
        if not self._ways:
            return
        simulation.wake()
        for (name, value), way in self._ways.items():
            array = _values_of(simulation, name).get(value)
            if array is not None:
                array.assign(way.at(time))
        self._ways = {key: way for key, way in self._ways.items() if way.left(time) > 0.0}

    def left(self, simulation: Simulation) -> float:
        """For how many simulated seconds some value is still on its way."""
        return max((way.left(simulation.state.time) for way in self._ways.values()), default=0.0)


def _values_of(simulation: Simulation, name: str) -> Mapping[str, wp.array]:
    return next((c.values for c in simulation.plan.contributions if c.name == name), {})
