"""What steps could not finish: how long a garment stays in its last safe state, and its surface behind the skin."""

from __future__ import annotations

import numpy as np

from harness.recording import Recording


def longest_frozen(record: Recording) -> tuple[float, int]:
    """The longest time [s] without a frame whose steps all counted, and the frame in which it ends."""
    longest, ended, run = 0, 0, 0
    for k, retries in enumerate(record.retries, 1):
        run = run + 1 if retries else 0
        if run > longest:
            longest, ended = run, k
    return longest * record.dt, ended


def void_share(record: Recording) -> tuple[float, int]:
    """The largest share of a second's frames that had a step which did not count, and the last of these frames."""
    wide = min(round(1 / record.dt), len(record.retries))
    if not wide:
        return 0.0, 0
    sums = np.concatenate([[0], np.cumsum(np.array(record.retries) > 0)])
    shares = (sums[wide:] - sums[:-wide]) / wide
    worst = int(np.argmax(shares))
    return float(shares[worst]), worst + wide


def longest_behind(record: Recording, bound: float) -> tuple[float, int]:
    """The longest time [s] for which the surface was farther than `bound` m from where it should be, and its end."""
    return longest_over(record.lag, bound, record.dt)


def longest_over(lags: list[float], bound: float, dt: float) -> tuple[float, int]:
    """The longest time [s] for which `lags`, in m, one a frame, were over `bound` m, and the frame in which it ends."""
    longest, ended, run = 0, 0, 0
    for k, lag in enumerate(lags, 1):
        run = 0 if lag <= bound else run + 1
        if run > longest:
            longest, ended = run, k
    return longest * dt, ended
