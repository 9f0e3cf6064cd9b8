"""How long a change of an effect's value takes at least, however short its ramp is told: what presses on cloth grows no
faster than the cloth can go along with.

A thousand pascals at once accelerate jersey by 5,500 m/s^2, 1.5 m in a step of 1/60 s. Nothing real does that: a body
of air, a fan, a gust take their time. A step that begins so has all of the garment pushed out of its search's reach,
and so has the next; spread, each is one of a garment in motion. Ours.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tryon_solver.effect_words.rules import Parameters

HARDEST_JERK = 6000.0
"""m/s^3: as fast as a change of pressure has the cloth's acceleration grow, or fall; 28 mm in its first 1/60 s."""


def least_seconds(
    name: str,
    parameters: Parameters,
    start: Mapping[str, np.ndarray],
    end: Mapping[str, np.ndarray],
    areal_density: float,
) -> float:
    """Simulated seconds that the effect's values (worn_effects.values_of) take from `start` to `end`, led in equal
    shares of time, on cloth of `areal_density` kg/m^2: of pressure and wind; 0 of all others."""
    if name == "pressure" and name in start:
        rise = float(np.abs(end["pressure"] - start["pressure"]).max())
    elif name == "wind" and "velocity" in start:
        # pressure goes by the square of the speed: where that is highest it grows fastest
        by, fastest = end["velocity"] - start["velocity"], max(_speed(start["velocity"]), _speed(end["velocity"]))
        rise = parameters["density"] * parameters["broadside"] * fastest * _speed(by)
    else:
        return 0.0
    return rise / (areal_density * HARDEST_JERK)


def _speed(velocity: np.ndarray) -> float:
    return float(np.linalg.norm(velocity.astype(np.float64)))
