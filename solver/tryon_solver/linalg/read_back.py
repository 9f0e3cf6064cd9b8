"""Reading small arrays back to the host: all that is wanted at a time with one wait for the device.

An array's own `numpy()` allocates page-locked memory, copies, and waits, each time: on a GPU that is longer than most
kernels take.
"""

from __future__ import annotations

import threading

import numpy as np
import warp as wp


class Landing(threading.local):
    """Page-locked memory of a thread, kept from reading to reading: `kept` by the place of an array among those read
    together, and its type. Each is as long as the longest that was read there."""

    def __init__(self) -> None:
        self.kept: dict[tuple[int, type], tuple[wp.array, np.ndarray]] = {}

    def place(self, number: int, array: wp.array) -> tuple[wp.array, np.ndarray]:
        """Memory for the array, that is the so-manieth of a reading, as the device and as the host see it."""
        key = number, array.dtype
        if key not in self.kept or len(self.kept[key][0]) < len(array):
            memory = wp.empty(len(array), dtype=array.dtype, device="cpu", pinned=True)
            self.kept[key] = memory, memory.numpy()
        return self.kept[key]


LANDING = Landing()


def read(*arrays: wp.array) -> list[np.ndarray]:
    """Copies of the arrays, of one dimension and all on one device, as they are when it has done what it was told.

    They are the caller's for good, no views of what is still written to. Never for a graph that is being captured:
    nothing has happened there that could be waited for.
    """
    device = wp.get_device(arrays[0].device)
    if device.is_cpu:
        wait(device)
        return [array.numpy().copy() for array in arrays]
    landed = []
    for number, array in enumerate(arrays):
        memory, seen = LANDING.place(number, array)
        wp.copy(memory, array)  # goes on by itself where the memory is page-locked, in the order of the launches
        landed.append(seen[: len(array)])
    wait(device)
    return [seen.copy() for seen in landed]


def wait(device: wp.Device) -> None:
    """Until the device has done what it was told; a CPU has. All waits of a frame are here, so they can be counted."""
    if device.is_cuda:
        wp.synchronize_stream(device)
