"""What comes to rest: how fast it still moves, what it does asleep, and how it wakes."""

from __future__ import annotations

import numpy as np

from harness.recording import Recording


def restless(record: Recording, quiet: float | None) -> float | None:
    """RMS speed [m/s] of the frame in which the cloth moves most, from `quiet` s on; None where that is not asked."""
    if quiet is None or record.failure or (first := round(quiet / record.dt)) >= record.frames:
        return None
    return max(rms_speed(record, k) for k in range(first + 1, record.frames + 1))


def rms_speed(record: Recording, k: int) -> float:
    """RMS over the vertices [m/s] of the way from the frame before to frame k."""
    return float(np.sqrt((way(record, k) ** 2).sum(1).mean())) / record.dt


def fastest_on_waking(record: Recording) -> float | None:
    """Speed [m/s] of the fastest vertex in any first frame after sleep; None where nothing woke."""
    woke = [k for k in range(2, len(record.asleep) + 1) if record.asleep[k - 2] and not record.asleep[k - 1]]
    if not woke:
        return None
    return max(float(np.linalg.norm(way(record, k), axis=1).max()) for k in woke) / record.dt


def moved_asleep(record: Recording) -> list[float]:
    """1 for each frame after the start that is one of sleep, follows one, and is not its bytes or cost a step."""
    found = []
    for k, asleep in enumerate(record.asleep, 1):
        follows = k > 1 and asleep and record.asleep[k - 2]
        found.append(float(follows and (record.cloth[k] is not record.cloth[k - 1] or record.worked[k - 1] > 0)))
    return found


def way(record: Recording, k: int) -> np.ndarray:
    """(N, 3) m from the frame before to frame k."""
    return record.cloth[k].astype(np.float64) - record.cloth[k - 1]
