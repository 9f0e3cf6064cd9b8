"""Launches that do not need each other, which a GPU may run at once.

Most kernels of a frame are shorter than what a GPU takes to begin the next one, and leave most of it idle: of two
chains of such kernels in a graph the shorter one costs next to nothing.
"""

from __future__ import annotations

from collections.abc import Callable

import warp as wp

_beside: dict[str, wp.Stream] = {}  # of each device, what the second of two chains is recorded on


def side_by_side(device: str | wp.Device, first: Callable[[], None], second: Callable[[], None]) -> None:
    """Launch what both launch, neither of which writes what the other one reads or writes. Within a graph that is
    recorded they are two branches of it; there the second must have no conditions, and no other thread may record for
    the device meanwhile. Else one follows the other."""
    on = wp.get_device(device)
    if not (on.is_cuda and on.is_capturing):
        first()
        second()
        return
    main = on.stream
    if on.alias not in _beside:
        _beside[on.alias] = wp.Stream(on)
    beside = _beside[on.alias]
    with wp.ScopedStream(beside):  # which begins after what was launched before
        second()
    first()
    main.wait_stream(beside)
