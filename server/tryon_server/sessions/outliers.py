"""Samples of a tracker that ask for a speed nobody reaches: a slip, which is dropped, or a leap, which is followed.

Which of the two it is shows in the samples after it. Those of a slip come back to where the wearer was; those of a
leap (the tracker has found the wearer again, or measures from another origin now) agree with it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Rows = npt.NDArray[np.bool_]

SHORTEST_INTERVAL = 0.01  # s; times of capture may be off by so much, and a speed over less says nothing
NOISE_REACH = 3.0 * np.sqrt(2.0)  # lengths of noise by which two samples of one place differ once in 10^5 times


class Gate:
    """Holds back what K tracks can't have done.

    Args:
        speed_max: a speed nobody reaches [m/s or rad/s].
        leap_samples: so many samples in a row that agree with each other, the first included, are a leap.
        longest_hold: after so long without a sample that is possible the newest is a leap, whatever it is [s].
        distance: (K,) between two arrays of K values [m or rad].
    """

    def __init__(
        self, speed_max: float, leap_samples: int, longest_hold: float, distance: Callable[[Array, Array], Array]
    ) -> None:
        self._speed_max, self._leap_samples, self._longest_hold = speed_max, leap_samples, longest_hold
        self._distance = distance
        self._good: Array | None = None

    def next(self, values: Array, dt: float, noise: Array) -> tuple[Rows, Rows, Rows]:
        """Which of the values (K, n), ``dt`` s after the last ones, are held back, which have leapt, and which are
        restless: out of reach like the one before, but not in accord with it, as much noise is. Each (K,).

        ``noise``: length of the noise in each track, (K,) m or rad; two samples may differ by it besides.
        """
        if self._good is None:
            self._good = self._last = values
            self._since, self._held = np.zeros(len(values)), np.zeros(len(values), dtype=np.int64)
            none = np.zeros(len(values), dtype=np.bool_)
            return none, none, none
        self._since = self._since + dt
        slack = NOISE_REACH * noise
        possible = self._within(self._good, values, self._since, slack)
        agrees = self._within(self._last, values, np.full(len(values), dt), slack)
        restless = ~possible & ~agrees & (self._held > 0)
        held = np.where(agrees, self._held + 1, 1)
        leapt = ~possible & ((held >= self._leap_samples) | (self._since > self._longest_hold))
        taken = possible | leapt
        self._good, self._last = np.where(taken[:, None], values, self._good), values
        self._since, self._held = np.where(taken, 0.0, self._since), np.where(taken, 0, held)
        return ~taken, leapt, restless

    def put(self, joints: Rows, values: Array) -> None:
        """These joints are as ``values`` says."""
        if self._good is None:
            return
        self._good = np.where(joints[:, None], values, self._good)
        self._last = np.where(joints[:, None], values, self._last)
        self._since, self._held = np.where(joints, 0.0, self._since), np.where(joints, 0, self._held)

    def _within(self, a: Array, b: Array, seconds: Array, slack: Array) -> Rows:
        return self._distance(a, b) <= self._speed_max * np.maximum(seconds, SHORTEST_INTERVAL) + slack
