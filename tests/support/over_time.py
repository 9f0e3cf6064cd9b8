"""Figures of a whole run: trembling, and how far a loop of the garment moves on the body."""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfiltfilt

TREMBLING_ABOVE = 8.0  # Hz
SETTLING = 0.5  # s after the body stops, not counted
SHORTEST_WINDOW = 0.5  # s that must be left to measure in


def trembling(cloth: np.ndarray, fps: float) -> float | None:
    """RMS [m/s] over vertices and time of the velocity above 8 Hz, from 0.5 s on; None when too little time is left.

    `cloth` (T, N, 3) m from the frame in which the body stops. Butterworth of order 4, run forth and back.
    """
    squares = _fast_squares(cloth, fps)
    return None if squares is None else float(np.sqrt(squares.mean()))


def worst_trembling(cloth: np.ndarray, fps: float, window: float = 1.0) -> float | None:
    """The same of the worst `window` s there are; of all the time where that is shorter."""
    squares = _fast_squares(cloth, fps)
    if squares is None:
        return None
    wide = min(round(window * fps), len(squares))
    sums = np.concatenate([[0.0], np.cumsum(squares)])
    return float(np.sqrt((sums[wide:] - sums[:-wide]).max() / wide))


def _fast_squares(cloth: np.ndarray, fps: float) -> np.ndarray | None:
    """(T',) mean over vertices of the squared velocity above 8 Hz [m^2/s^2], from 0.5 s on; None of too little time."""
    skipped = round(SETTLING * fps)
    if len(cloth) - 1 - skipped < SHORTEST_WINDOW * fps or fps <= 2 * TREMBLING_ABOVE:
        return None
    velocity = np.diff(np.asarray(cloth, np.float64), axis=0) * fps
    fast = sosfiltfilt(butter(4, TREMBLING_ABOVE, "high", fs=fps, output="sos"), velocity, axis=0)[skipped:]
    return (fast**2).sum(-1).mean(1)


def travel(points: np.ndarray) -> np.ndarray:
    """(V,) m: largest distance between any two places of each point; `points` (T, V, 3) m."""
    out = np.zeros(points.shape[1])
    for place in points:
        np.maximum(out, np.linalg.norm(points - place, axis=2).max(0), out=out)
    return out
