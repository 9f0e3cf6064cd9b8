"""How a change of an effect's value goes at least, however short its ramp is told: no faster than cloth goes along.

A thousand pascals at once accelerate jersey by 5,500 m/s^2, 1.5 m in a step of 1/60 s. Nothing real does that: a body
of air, a fan, a gust take their time. A step that begins so has all of the garment pushed out of its search's reach,
and so has the next. Cloth that hangs loose is taut after some centimetres, and from then on more pressure hardly moves
it: so what presses goes by the cube of time from none, and back likewise. A weight that turns takes as long as a
pressure that accelerates cloth by as much as the two differ. A line of elastic has its ends drawn together as by a hand
on a drawstring. Ours.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tryon_solver.effect_words.rules import Parameters

HARDEST_PRESS = 8000.0
"""m/s^5: what presses accelerates cloth by no more than this times the cube of the time since it began to, by gravity's
acceleration after 0.1 s, and by 5,500 m/s^2 after 0.9 s."""
QUICKEST_DRAW = 1.0
"""m/s: no faster does an elastic's length at rest change."""
POWERS: Mapping[str, float] = {"pressure": 3.0, "wind": 1.5}
"""With which power of time an effect's values go from none; of a wind, which presses by the square of its speed, half
of what a pressure has."""


def root(values: np.ndarray, power: float) -> np.ndarray:
    """What goes in equal shares of time where values go with this power of it: the root of each, with its sign."""
    return np.sign(values) * np.abs(values) ** (1.0 / power)


def least_seconds(
    name: str,
    parameters: Parameters,
    start: Mapping[str, np.ndarray],
    end: Mapping[str, np.ndarray],
    areal_density: float,
    lengths: np.ndarray,
) -> float:
    """Simulated seconds that the effect's values (worn_effects.values_of) take from `start` to `end` by its power of
    time, on cloth of `areal_density` kg/m^2; `lengths` (L,) m of elastic's lines in the pattern. 0 of all others."""
    if name == "elastic" and "ratio" in start:
        return float((np.abs(end["ratio"] - start["ratio"]) * lengths).max(initial=0.0)) / QUICKEST_DRAW
    if name == "gravity" and "acceleration" in start:
        turn = end["acceleration"].astype(np.float64) - start["acceleration"].astype(np.float64)
        return float(np.cbrt(np.linalg.norm(turn) / HARDEST_PRESS))
    if name == "pressure" and "pressure" in start:
        pascals, value = 1.0, "pressure"
    elif name == "wind" and "velocity" in start:
        pascals, value = 0.5 * parameters["density"] * parameters["broadside"], "velocity"
    else:
        return 0.0
    way = root(end[value].astype(np.float64), POWERS[name]) - root(start[value].astype(np.float64), POWERS[name])
    return float(np.linalg.norm(way)) * float(np.cbrt(pascals / (areal_density * HARDEST_PRESS)))
