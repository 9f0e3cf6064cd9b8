"""Places in the order of a curve that fills space: those that follow each other are near each other, as a rule."""

from __future__ import annotations

import numpy as np

BITS = 10  # of a coordinate: a thousandth of the box


def order_along_curve(places: np.ndarray) -> np.ndarray:
    """(K,) int32: the order of `places` (K, 3) along a Z-shaped curve (Morton 1966, "A computer oriented geodetic data
    base"), whose numbers are the coordinates' bits in turn."""
    lowest = places.min(axis=0)
    side = max(float((places.max(axis=0) - lowest).max()), 1e-12)
    cells = ((places - lowest) / side * ((1 << BITS) - 1)).astype(np.int64)
    numbers = np.zeros(len(places), np.int64)
    for bit in range(BITS):
        for axis in range(3):
            numbers |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(numbers, kind="stable").astype(np.int32)
