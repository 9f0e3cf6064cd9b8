"""What a scene that touches nothing has in place of contact's lists: none are in them, and none will ever be.

The steps ask how many candidates and pairs there are, on the host and on the device, and have nothing to do with them
where there are none. So what they ask is here, and contact itself stays out of such a scene.
"""

from __future__ import annotations

import numpy as np
import warp as wp


class NoCandidates:
    """In place of contact's `Candidates`."""

    size = 0
    idle = True
    places = ()

    def begin_anew(self) -> None:
        """It takes no room."""


class NoPairs:
    """In place of contact's `ContactPairs`; what kernels are told of them is that there are none."""

    size = 0
    overlapping = 0
    capacity = 0

    def __init__(self, device: str) -> None:
        self.counters = wp.zeros(2, dtype=wp.int32, device=device)
        self.smallest_gap = wp.zeros(2, dtype=wp.float32, device=device)  # m, which nobody reports
        self.ids = wp.zeros(0, dtype=wp.vec4i, device=device)
        self.lam = wp.zeros(0, dtype=wp.vec4, device=device)
        self.normal = wp.zeros(0, dtype=wp.vec3, device=device)
        self.curvature = wp.zeros(0, dtype=wp.float32, device=device)
        self.beside = wp.zeros(0, dtype=wp.mat33, device=device)

    def cover_in_graph(self) -> bool:
        """Is a graph being captured?"""
        return bool(wp.get_device(self.counters.device).is_capturing)

    def know_size(self, counters: np.ndarray) -> int:
        """How many there are, of `counters` (2,) that have been read."""
        return int(counters[0])
