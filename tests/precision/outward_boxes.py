"""Trees over boxes for a solver in float64: Warp's are float32, so boxes are rounded outwards, by a little more than
rounding takes.

What a tree finds is measured again before it counts, so that a box too large by a rounding changes nothing else.
"""

from __future__ import annotations

import numpy as np
import warp as wp

SHARE = 2.0**-22  # twice the spacing of float32


class OutwardTree:
    """In place of wp.Bvh: over `lower`, `upper` (F,) vec3d m, read again at each `refit`."""

    def __init__(self, lower: wp.array, upper: wp.array) -> None:
        self._boxes = lower, upper
        self._rounded = tuple(wp.empty(len(lower), dtype=wp.vec3f, device=lower.device) for _ in range(2))
        self._round()
        self._tree = wp.Bvh(*self._rounded)

    @property
    def id(self) -> int:
        """What kernels take."""
        return int(self._tree.id)

    def refit(self) -> None:
        """Follow the boxes."""
        self._round()
        self._tree.refit()

    def _round(self) -> None:
        for box, rounded, sign in zip(self._boxes, self._rounded, (-1.0, 1.0)):
            values = box.numpy()
            rounded.assign((values + sign * SHARE * np.abs(values)).astype(np.float32))


@wp.func
def below(v: wp.vec3d) -> wp.vec3f:
    """A float32 vector that is less."""
    return wp.vec3f(v - wp.float64(SHARE) * wp.abs(v))


@wp.func
def above(v: wp.vec3d) -> wp.vec3f:
    """A float32 vector that is more."""
    return wp.vec3f(v + wp.float64(SHARE) * wp.abs(v))
