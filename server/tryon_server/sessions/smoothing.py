"""The filter between a tracker and the physics: steady while the body rests, quick while it moves.

One-Euro filter (Casiez, Roussel and Vogel 2012): a first-order low-pass whose cutoff grows with the speed, here of
every joint's place and of every joint's turn for itself. Followed at a constant speed v, it lags behind by
1 / (2 pi (cutoff + gain v)) s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Smoothing:
    """Settings of the filter.

    With these a place that moves at 2 m/s lags 18 ms behind, and so does a turn of 3.5 rad/s; white noise of 3 mm and
    half a degree of a body at rest at 60 Hz becomes a quarter.

    Attributes:
        place_cutoff: of a place at rest [Hz].
        place_gain: what a speed adds to that [Hz per m/s].
        turn_cutoff: of a turn at rest [Hz].
        turn_gain: what a speed adds to that [Hz per rad/s].
        speed_cutoff: of the speeds themselves [Hz].
        forget_seconds: after a silence this long the filter begins anew [s].
    """

    place_cutoff: float = 1.0
    place_gain: float = 4.0
    turn_cutoff: float = 1.0
    turn_gain: float = 2.2
    speed_cutoff: float = 4.0
    forget_seconds: float = 0.5


DEFAULT_SMOOTHING = Smoothing()


class _LowPass:
    """Time step and previous values; ``first`` until the first value."""

    def __init__(self) -> None:
        self.previous: Array | None = None
        self.smooth: Array | None = None
        self.speed: Array | None = None


class PlaceFilter:
    """Filters (K, 3) m."""

    def __init__(self, settings: Smoothing) -> None:
        self._settings = settings
        self._state = _LowPass()

    def next(self, places: Array, dt: float) -> Array:
        """The filtered places, ``dt`` s after the last ones."""
        state, settings = self._state, self._settings
        if state.previous is None or state.smooth is None or state.speed is None:
            state.previous, state.smooth, state.speed = places, places, np.zeros_like(places)
            return places
        state.speed = state.speed + _share(settings.speed_cutoff, dt) * ((places - state.previous) / dt - state.speed)
        state.previous = places
        pace = np.sqrt((state.speed * state.speed).sum(axis=1))
        share = _share(settings.place_cutoff + settings.place_gain * pace, dt)
        state.smooth = state.smooth + share[:, None] * (places - state.smooth)
        return state.smooth

    def put(self, joints: npt.NDArray[np.bool_], places: Array) -> None:
        """Have these joints stand where ``places`` (K, 3) says, without having moved there."""
        state = self._state
        if state.previous is None or state.smooth is None or state.speed is None:
            return
        rows = joints[:, None]
        state.previous, state.smooth = np.where(rows, places, state.previous), np.where(rows, places, state.smooth)
        state.speed = np.where(rows, 0.0, state.speed)


class TurnFilter:
    """Filters (K, 4) unit quaternions x, y, z, w."""

    def __init__(self, settings: Smoothing) -> None:
        self._settings = settings
        self._state = _LowPass()

    def next(self, turns: Array, dt: float) -> Array:
        """The filtered turns, ``dt`` s after the last ones."""
        state, settings = self._state, self._settings
        if state.previous is None or state.smooth is None or state.speed is None:
            state.previous, state.smooth, state.speed = turns, turns, np.zeros((len(turns), 3))
            return turns
        speed = _between(state.previous, turns) / dt
        state.speed = state.speed + _share(settings.speed_cutoff, dt) * (speed - state.speed)
        state.previous = turns
        pace = np.sqrt((state.speed * state.speed).sum(axis=1))
        share = _share(settings.turn_cutoff + settings.turn_gain * pace, dt)
        state.smooth = _towards(state.smooth, turns, share[:, None])
        return state.smooth

    def put(self, joints: npt.NDArray[np.bool_], turns: Array) -> None:
        """Have these joints stand as ``turns`` (K, 4) says, without having turned there."""
        state = self._state
        if state.previous is None or state.smooth is None or state.speed is None:
            return
        rows = joints[:, None]
        state.previous, state.smooth = np.where(rows, turns, state.previous), np.where(rows, turns, state.smooth)
        state.speed = np.where(rows, 0.0, state.speed)


def _share(cutoff: npt.ArrayLike, dt: float) -> Array:
    """How much of the way to the newest value a low-pass of this cutoff [Hz] goes in ``dt`` s."""
    reach = 2.0 * np.pi * np.asarray(cutoff, dtype=np.float64) * dt
    return reach / (1.0 + reach)


def _between(a: Array, b: Array) -> Array:
    """(K, 3) rad: the turns from a to b in the world, as axis times angle; exact to first order in the angle, which is
    what a speed between two poses needs."""
    vector = a[:, 3:] * b[:, :3] - b[:, 3:] * a[:, :3] - np.cross(b[:, :3], a[:, :3])
    same = np.where((a * b).sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    return 2.0 * same * vector


def _towards(a: Array, b: Array, share: Array) -> Array:
    """From a to b by this share (K, 1) of the chord, on the unit sphere."""
    near = np.where((a * b).sum(axis=1, keepdims=True) < 0.0, -b, b)
    turns = a + share * (near - a)
    return turns / np.sqrt((turns * turns).sum(axis=1, keepdims=True))
