"""Which way a human's mesh faces and which of its axes runs from side to side, by its shape alone. Ours."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

SOLES = 0.03  # share of the height: below it are the feet
ANKLES = (0.08, 0.12)  # and within these the shins above them
CLEAR = 0.02  # share of the height by which feet must reach out before the shins
STRAIGHT = 0.5  # of that at most may they reach to the side
SAMPLED = 2000  # vertices that are looked at for symmetry


def toes(x: np.ndarray) -> np.ndarray | None:
    """(3,) the axis, level and signed, along which the feet of x (V, 3) m, Y up, point; None where they don't tell."""
    low, height = float(x[:, 1].min()), float(np.ptp(x[:, 1]))
    share = (x[:, 1] - low) / max(height, 1e-12)
    soles, shins = x[share < SOLES], x[(share > ANKLES[0]) & (share < ANKLES[1])]
    if not len(soles) or not len(shins):
        return None
    reach = _middle(soles) - _middle(shins)
    reach[1] = 0.0
    axis = int(np.abs(reach).argmax())
    across = abs(reach[2 - axis])
    if abs(reach[axis]) < CLEAR * height or across > STRAIGHT * abs(reach[axis]):
        return None
    result = np.zeros(3)
    result[axis] = np.sign(reach[axis])
    return result


def unlikeness(x: np.ndarray, axis: int) -> float:
    """How far x (V, 3) is on average from its own mirror image across the middle of an axis, in the units of x."""
    some = x[:: max(1, len(x) // SAMPLED)]
    image = some.copy()
    image[:, axis] = x[:, axis].min() + x[:, axis].max() - image[:, axis]
    return float(cKDTree(some).query(image)[0].mean())


def _middle(x: np.ndarray) -> np.ndarray:
    return (x.min(axis=0) + x.max(axis=0)) / 2
