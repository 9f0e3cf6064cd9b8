"""The filter between a tracker and the physics: as steady as its noise asks for while the body rests, quick while it
moves.

After the One-Euro filter (Casiez, Roussel and Vogel 2012): a low-pass whose cutoff grows with the speed, here of every
joint's place and of every joint's turn for itself. Ours differs in two things. The cutoff at rest is no setting: it
follows from the noise that the filter finds in the stream, and is none where there is none. And only a speed that the
noise does not explain counts. The low-pass has two equal stages, which leave of the same noise less speed than one.

The noise is read off third differences: of white noise s a coordinate their variance is 20 s^2, while those of a limb
that swings to and fro once a second over half a metre, told 60 times a second, are a quarter of a millimetre. A
single one counts for no more than a multiple of what was found so far.

Three things bound what a bad tracker can do. A sample that nobody can have reached is held back, and the joint goes on
as it went (sessions/outliers.py). Where the output stays behind the input, the cutoff grows until in a walk it is no
farther behind than stated, whatever the noise. And noise that comes suddenly is believed slowly.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tryon_server.sessions.outliers import Gate, Rows

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Smoothing:
    """Settings of the filter.

    With these, white noise of 3 mm and half a degree in every joint at 60 Hz leaves the skin of a body at rest with 8
    mm/s RMS, of 1300, and a walk without noise comes through with 3 mm RMS of lag
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
        place_speed_max, turn_speed_max: no joint is so quick: a sample that asks for more is held back [m/s, rad/s].
        leap_samples: so many of them in a row that agree are a leap, which is followed; fewer were wrong.
        longest_hold: after so long without a sample that is possible the newest is followed [s].
        noise_jump: a sample's share in the noise's variance is at most so many times the variance found so far,
        place_noise_least, turn_noise_least: or that of this deviation a coordinate [m, rad].
        place_lag, turn_lag: a joint in steady motion is at most so far behind [m, rad],
        place_walk, turn_walk: at these speeds [m/s, rad/s]; at others in proportion, or less.
        lag_cutoff: of the way that the output is behind [Hz].
    """

    place_unrest: float = 3e-3
    place_gain: float = 60.0
    turn_unrest: float = 6e-3
    turn_gain: float = 36.0
    speed_cutoff: float = 4.0
    certainty: float = 3.0
    noise_rise: float = 1.0
    noise_fall: float = 0.5
    forget_seconds: float = 0.5
    place_speed_max: float = 12.0
    turn_speed_max: float = 30.0
    leap_samples: int = 3
    longest_hold: float = 0.25
    noise_jump: float = 9.0
    place_noise_least: float = 1e-3
    turn_noise_least: float = 3e-3
    place_lag: float = 0.1
    turn_lag: float = 0.25
    place_walk: float = 1.4
    turn_walk: float = 2.5
    lag_cutoff: float = 1.0


DEFAULT_SMOOTHING = Smoothing()

LONGEST_INTERVAL = 0.1  # s; differences over longer ones say nothing of the noise
THIRD_DIFFERENCE = 20.0  # variance of white noise's third difference over its own: 1 + 9 + 9 + 1
DIFFERENCED = 4  # samples in a third difference


class _Noise:
    """Standard deviation a coordinate of the white noise on K tracks, from their ways between samples."""

    def __init__(self, count: int, settings: Smoothing, least: float) -> None:
        self._settings, self._least = settings, least
        self._ways: list[Array] = []  # the last two, (K, 3)
        self._seconds = 0.0
        self._variance = np.zeros(count)
        self._plain = np.full(count, DIFFERENCED)

    def next(self, way: Array, dt: float, odd: Rows, restless: Rows) -> Array:
        """(K,) after a further way (K, 3), gone in ``dt`` s. Where it is ``odd`` (K,) it says nothing of the noise,
        unless it is ``restless``."""
        if dt > LONGEST_INTERVAL:
            self._ways = []
        self._plain = np.where(odd, 0, self._plain + 1)
        if len(self._ways) == 2:
            third = way - 2.0 * self._ways[1] + self._ways[0]
            found = (third * third).sum(axis=1) / (3 * THIRD_DIFFERENCE)
            found = np.minimum(found, self._settings.noise_jump * np.maximum(self._variance, self._least**2))
            found = np.where((self._plain >= DIFFERENCED) | restless, found, self._variance)
            self._seconds += dt
            within = np.where(found > self._variance, self._settings.noise_rise, self._settings.noise_fall)
            share = np.minimum(dt / np.minimum(within, self._seconds), 1.0)
            self._variance = self._variance + share * (found - self._variance)
        self._ways = [*self._ways[-1:], way]
        return np.sqrt(self._variance)

    def put(self, joints: Rows) -> None:
        """The ways of these joints say nothing."""
        self._plain = np.where(joints, 0, self._plain)


@dataclass(frozen=True)
class _Kind:
    """The settings that places and turns have each for themselves."""

    unrest: float
    gain: float
    speed_max: float
    noise_least: float
    lag: float
    walk: float


class _Filter(ABC):
    """Two equal low-pass stages over K values; what a value, a way and a step between two are is the subclasses'."""

    def __init__(self, settings: Smoothing, kind: _Kind) -> None:
        self._settings, self._kind = settings, kind
        self._gate = Gate(kind.speed_max, settings.leap_samples, settings.longest_hold, self._distance)
        self._previous: Array | None = None

    def next(self, values: Array, dt: float) -> Array:
        """The filtered values, ``dt`` s after the last ones."""
        settings = self._settings
        if self._previous is None:
            self._told = self._previous = self._first = self._second = values
            self._speed, self._behind = np.zeros((len(values), 3)), np.zeros((len(values), 3))
            self._noise, self._level = _Noise(len(values), settings, self._kind.noise_least), np.zeros(len(values))
            self._gate.next(values, dt, self._level)
            return values
        held, leapt, restless = self._gate.next(values, dt, self._level)
        odd = held | leapt
        self._level = np.sqrt(3.0) * self._noise.next(self._way(self._told, values), dt, odd, restless)
        self._told = values
        ahead = self._speed * dt
        if odd.any():
            values = np.where(held[:, None], self._ahead(self._previous, ahead), values)
            self._put(leapt, values)
        way = np.where(odd[:, None], ahead, self._way(self._previous, values))
        self._previous = values
        quickly = _share(settings.speed_cutoff, dt)
        self._speed = self._speed + quickly * (way / dt - self._speed)
        explained = settings.certainty * self._level / dt * quickly * np.sqrt(2.0 / (2.0 - quickly))
        moving = np.maximum(_length(self._speed) - explained, 0.0)
        cutoff = self._kind.gain * moving + self._catch_up(values, dt)
        share = _faster(_steady_share(self._level, self._kind.unrest * dt), cutoff, dt)[:, None]
        self._first = self._step(self._first, values, share)
        self._second = self._step(self._second, self._first, share)
        return self._second

    def _catch_up(self, values: Array, dt: float) -> Array:
        """(K,) Hz that the cutoff must be higher for the output not to stay behind ``values`` farther than it may.

        Two stages of cutoff f follow a speed v at a distance of 2 v / (2 pi f). The cutoff returned grows from 0, at
        what noise explains of the distance or at half of the one allowed, to what holds the allowed one in a walk.
        """
        slowly = _share(self._settings.lag_cutoff, dt)
        self._behind = self._behind + slowly * (self._way(self._second, values) - self._behind)
        allowed = self._kind.lag
        explained = self._settings.certainty * self._level * np.sqrt(slowly / (2.0 - slowly))
        excess = np.maximum(_length(self._behind) - np.minimum(explained, 0.5 * allowed), 0.0)
        return self._kind.walk / (np.pi * allowed) * excess / (0.5 * allowed)

    def put(self, joints: Rows, values: Array) -> None:
        """Have these joints be as ``values`` says, without having moved there."""
        if self._previous is None:
            return
        self._gate.put(joints, values)
        self._told = np.where(joints[:, None], values, self._told)
        self._put(joints, values)
        self._speed = np.where(joints[:, None], 0.0, self._speed)
        self._noise.put(joints)

    def _put(self, joints: Rows, values: Array) -> None:
        assert self._previous is not None
        rows = joints[:, None]
        self._previous = np.where(rows, values, self._previous)
        self._first, self._second = np.where(rows, values, self._first), np.where(rows, values, self._second)
        self._behind = np.where(rows, 0.0, self._behind)

    @abstractmethod
    def _way(self, a: Array, b: Array) -> Array:
        """(K, 3) from a to b."""

    @abstractmethod
    def _step(self, a: Array, b: Array, share: Array) -> Array:
        """From a to b by this share (K, 1) of the way."""

    @abstractmethod
    def _ahead(self, a: Array, way: Array) -> Array:
        """From a by this way (K, 3)."""

    @abstractmethod
    def _distance(self, a: Array, b: Array) -> Array:
        """(K,) between a and b."""


class PlaceFilter(_Filter):
    """Filters (K, 3) m."""

    def __init__(self, settings: Smoothing) -> None:
        super().__init__(
            settings,
            _Kind(
                unrest=settings.place_unrest,
                gain=settings.place_gain,
                speed_max=settings.place_speed_max,
                noise_least=settings.place_noise_least,
                lag=settings.place_lag,
                walk=settings.place_walk,
            ),
        )

    def _way(self, a: Array, b: Array) -> Array:
        return b - a

    def _step(self, a: Array, b: Array, share: Array) -> Array:
        return a + share * (b - a)

    def _ahead(self, a: Array, way: Array) -> Array:
        return a + way

    def _distance(self, a: Array, b: Array) -> Array:
        return _length(b - a)


class TurnFilter(_Filter):
    """Filters (K, 4) unit quaternions x, y, z, w."""

    def __init__(self, settings: Smoothing) -> None:
        super().__init__(
            settings,
            _Kind(
                unrest=settings.turn_unrest,
                gain=settings.turn_gain,
                speed_max=settings.turn_speed_max,
                noise_least=settings.turn_noise_least,
                lag=settings.turn_lag,
                walk=settings.turn_walk,
            ),
        )

    def _way(self, a: Array, b: Array) -> Array:
        return _between(a, b)

    def _step(self, a: Array, b: Array, share: Array) -> Array:
        return _towards(a, b, share)

    def _ahead(self, a: Array, way: Array) -> Array:
        return _turned(a, way)

    def _distance(self, a: Array, b: Array) -> Array:
        return 2.0 * np.arcsin(np.minimum(0.5 * _length(_between(a, b)), 1.0))


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


def _length(vectors: Array) -> Array:
    """(K,) of (K, 3)."""
    return np.sqrt((vectors * vectors).sum(axis=1))


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


def _turned(a: Array, way: Array) -> Array:
    """From a by the turns ``way`` (K, 3), of which `_between` is the reverse."""
    vector = 0.5 * way
    real = np.sqrt(np.maximum(1.0 - (vector * vector).sum(axis=1, keepdims=True), 0.0))
    turns = np.concatenate(
        [
            real * a[:, :3] + a[:, 3:] * vector + np.cross(vector, a[:, :3]),
            real * a[:, 3:] - (vector * a[:, :3]).sum(axis=1, keepdims=True),
        ],
        axis=1,
    )
    return turns / np.sqrt((turns * turns).sum(axis=1, keepdims=True))
