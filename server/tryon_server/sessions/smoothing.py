"""The filter between a tracker and the physics: as steady as its noise asks for while the body rests, quick while it
moves.

After the One-Euro filter (Casiez, Roussel and Vogel 2012): a low-pass whose cutoff grows with the speed, here of every
joint's place and of every joint's turn for itself. Ours differs in two things. The cutoff at rest is no setting: it
follows from the noise that the filter finds in the stream, and is none where there is none. And only a speed that the
noise does not explain counts. The low-pass has two equal stages, which leave of the same noise less speed than one.

The noise is read off third differences: of white noise s a coordinate their variance is 20 s^2, while those of a limb
that swings to and fro once a second over half a metre, told 60 times a second, are a quarter of a millimetre.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Smoothing:
    """Settings of the filter.

    With these, white noise of 3 mm and half a degree in every joint at 60 Hz leaves the skin of a body at rest with 7
    mm/s RMS, of 1400, and a walk without noise comes through with 3 mm RMS of lag
    (tests/server/sessions/test_smoothing.py prints both).

    Attributes:
        place_unrest: speed that noise may leave in a place at rest [m/s].
        place_gain: cutoff that a speed adds, as far as noise does not explain it [Hz per m/s].
        turn_unrest: speed that noise may leave in a turn at rest [rad/s].
        turn_gain: the same for turns [Hz per rad/s].
        speed_cutoff: of the speeds themselves [Hz].
        certainty: a speed counts as far as it is so many times what noise alone would show.
        noise_rise, noise_fall: times in which the noise is found to have grown and fallen [s].
        forget_seconds: after a silence this long the filter begins anew [s].
    """

    place_unrest: float = 3e-3
    place_gain: float = 60.0
    turn_unrest: float = 6e-3
    turn_gain: float = 36.0
    speed_cutoff: float = 4.0
    certainty: float = 2.5
    noise_rise: float = 1.0
    noise_fall: float = 0.5
    forget_seconds: float = 0.5


DEFAULT_SMOOTHING = Smoothing()

LONGEST_INTERVAL = 0.1  # s; differences over longer ones say nothing of the noise
THIRD_DIFFERENCE = 20.0  # variance of white noise's third difference over its own: 1 + 9 + 9 + 1


class _Noise:
    """Standard deviation a coordinate of the white noise on K tracks, from their ways between samples."""

    def __init__(self, count: int, settings: Smoothing) -> None:
        self._settings = settings
        self._ways: list[Array] = []  # the last two, (K, 3)
        self._seconds = 0.0
        self._variance = np.zeros(count)

    def next(self, way: Array, dt: float) -> Array:
        """(K,) after a further way (K, 3), gone in ``dt`` s."""
        if dt > LONGEST_INTERVAL:
            self._ways = []
        if len(self._ways) == 2:
            third = way - 2.0 * self._ways[1] + self._ways[0]
            found = (third * third).sum(axis=1) / (3 * THIRD_DIFFERENCE)
            self._seconds += dt
            within = np.where(found > self._variance, self._settings.noise_rise, self._settings.noise_fall)
            share = np.minimum(dt / np.minimum(within, self._seconds), 1.0)
            self._variance = self._variance + share * (found - self._variance)
        self._ways = [*self._ways[-1:], way]
        return np.sqrt(self._variance)

    def put(self, joints: npt.NDArray[np.bool_]) -> None:
        """The ways of these joints were none."""
        self._ways = [np.where(joints[:, None], 0.0, way) for way in self._ways]


class _Filter(ABC):
    """Two equal low-pass stages over K values; what a value, a way and a step between two are is the subclasses'."""

    def __init__(self, settings: Smoothing, unrest: float, gain: float) -> None:
        self._settings, self._unrest, self._gain = settings, unrest, gain
        self._previous: Array | None = None

    def next(self, values: Array, dt: float) -> Array:
        """The filtered values, ``dt`` s after the last ones."""
        settings = self._settings
        if self._previous is None:
            self._previous = self._first = self._second = values
            self._speed = np.zeros((len(values), 3))
            self._noise = _Noise(len(values), settings)
            return values
        way = self._way(self._previous, values)
        self._previous = values
        noise = np.sqrt(3.0) * self._noise.next(way, dt)
        quickly = _share(settings.speed_cutoff, dt)
        self._speed = self._speed + quickly * (way / dt - self._speed)
        explained = settings.certainty * noise / dt * quickly * np.sqrt(2.0 / (2.0 - quickly))
        moving = np.maximum(np.sqrt((self._speed * self._speed).sum(axis=1)) - explained, 0.0)
        share = _faster(_steady_share(noise, self._unrest * dt), self._gain * moving, dt)[:, None]
        self._first = self._step(self._first, values, share)
        self._second = self._step(self._second, self._first, share)
        return self._second

    def put(self, joints: npt.NDArray[np.bool_], values: Array) -> None:
        """Have these joints be as ``values`` says, without having moved there."""
        if self._previous is None:
            return
        rows = joints[:, None]
        self._previous = np.where(rows, values, self._previous)
        self._first, self._second = np.where(rows, values, self._first), np.where(rows, values, self._second)
        self._speed = np.where(rows, 0.0, self._speed)
        self._noise.put(joints)

    @abstractmethod
    def _way(self, a: Array, b: Array) -> Array:
        """(K, 3) from a to b."""

    @abstractmethod
    def _step(self, a: Array, b: Array, share: Array) -> Array:
        """From a to b by this share (K, 1) of the way."""


class PlaceFilter(_Filter):
    """Filters (K, 3) m."""

    def __init__(self, settings: Smoothing) -> None:
        super().__init__(settings, settings.place_unrest, settings.place_gain)

    def _way(self, a: Array, b: Array) -> Array:
        return b - a

    def _step(self, a: Array, b: Array, share: Array) -> Array:
        return a + share * (b - a)


class TurnFilter(_Filter):
    """Filters (K, 4) unit quaternions x, y, z, w."""

    def __init__(self, settings: Smoothing) -> None:
        super().__init__(settings, settings.turn_unrest, settings.turn_gain)

    def _way(self, a: Array, b: Array) -> Array:
        return _between(a, b)

    def _step(self, a: Array, b: Array, share: Array) -> Array:
        return _towards(a, b, share)


def _steady_share(noise: Array, way: float) -> Array:
    """How much of the way to its input a stage goes at rest, (K,).

    White noise of length n leaves steps of n (2 a^3 / (2 - a)^3)^(1/2) behind two stages of share a: twice the
    difference of their output's variance, a^4 (1 + r^2) / (1 - r^2)^3 with r = 1 - a, and covariance,
    a^4 2 r / (1 - r^2)^3. Here a is such that they are ``way``.
    """
    ratio = np.power(way / np.sqrt(2.0) / np.maximum(noise, 1e-12), 2.0 / 3.0)
    return np.minimum(2.0 * ratio / (1.0 + ratio), 1.0)


def _faster(share: Array, cutoff: Array, dt: float) -> Array:
    """The share of a low-pass whose cutoff is so much higher [Hz]."""
    rest = np.maximum(1.0 - share, 1e-12)
    reach = share / rest + 2.0 * np.pi * cutoff * dt
    return reach / (1.0 + reach)


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
