"""What a step's time is told by."""

from __future__ import annotations

import time
from collections.abc import Callable

import warp as wp


def clock_of(device: str) -> Callable[[], float]:
    """Seconds: on a CPU those of processor time, which others at work there do not lengthen, of all of this process's
    threads; of a GPU those of the wall, once it has been waited for."""
    if device == "cpu":
        return time.process_time

    def waited() -> float:
        wp.synchronize_device(device)
        return time.perf_counter()

    return waited
