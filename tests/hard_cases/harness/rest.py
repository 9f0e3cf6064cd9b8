"""What comes to rest: how fast it still moves, what it does asleep, and how it wakes."""

from __future__ import annotations

import numpy as np

from harness.recording import Recording

STILL = 1e-3  # m/s RMS: what is slower may fall asleep,
STILL_FOR = 0.4  # s before it does


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


def asleep_too_soon(record: Recording) -> list[float]:
    """RMS speed [m/s] of the fastest frame in the `STILL_FOR` s before each that is the first of a sleep; else 0.

    Whatever was awake for no longer than that has not been still at all: that is told as infinite.
    """
    before, found = round(STILL_FOR / record.dt), []
    for k, asleep in enumerate(record.asleep, 1):
        falls = asleep and not (k > 1 and record.asleep[k - 2])
        awake = k > before and not any(record.asleep[k - 1 - before : k - 1])
        speeds = [speed(record, frame) for frame in range(k - before, k)] if falls and awake else []
        found.append(max(speeds, default=np.inf) if falls else 0.0)
    return found


def speed(record: Recording, k: int) -> float:
    """RMS over the vertices [m/s], of the way to frame k or of the velocities in it, whichever is larger."""
    return max(rms_speed(record, k), float(np.sqrt(2 * record.kinetic[k] / record.total_mass)))


def longest_unmoved(record: Recording) -> tuple[float, int]:
    """The longest time [s] that cloth not said to be asleep was left as it was though it had been moving, and the
    frame in which that ends."""
    longest, ended, run, moving = 0, 0, 0, False
    for k, unmoved in enumerate(record.unmoved, 1):
        if not unmoved or record.asleep[k - 1]:
            run, moving = 0, rms_speed(record, k) > STILL
            continue
        moving = moving or record.kinetic[k] > 0.5 * record.total_mass * STILL**2
        run += 1
        if moving and run > longest:
            longest, ended = run, k
    return longest * record.dt, ended


def way(record: Recording, k: int) -> np.ndarray:
    """(N, 3) m from the frame before to frame k."""
    return record.cloth[k].astype(np.float64) - record.cloth[k - 1]
