"""Reading small arrays back to the host: all that is wanted at a time with one wait for the device.

An array's own `numpy()` allocates page-locked memory, copies, and waits, each time: on a GPU that is longer than most
kernels take.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping

import numpy as np
import warp as wp


class Landing(threading.local):
    """Page-locked memory of a thread, kept from reading to reading: `kept` by the place of an array among those read
    together, and its type. Each is as long as the longest that was read there."""

    def __init__(self) -> None:
        self.kept: dict[tuple[int, type], tuple[wp.array, np.ndarray]] = {}
        self.events: dict[str, wp.Event] = {}

    def place(self, number: int, array: wp.array) -> tuple[wp.array, np.ndarray]:
        """Memory for the array, that is the so-manieth of a reading, as the device and as the host see it."""
        key = number, array.dtype
        if key not in self.kept or len(self.kept[key][0]) < len(array):
            memory = wp.empty(len(array), dtype=array.dtype, device="cpu", pinned=True)
            self.kept[key] = memory, memory.numpy()
        return self.kept[key]

    def event(self, device: wp.Device) -> wp.Event:
        """The device's event of having read."""
        if device.alias not in self.events:
            self.events[device.alias] = wp.Event(device)
        return self.events[device.alias]


LANDING = Landing()


def read(*arrays: wp.array) -> list[np.ndarray]:
    """Copies of the arrays, of one dimension and all on one device, as they are when it has done what it was told.

    They are the caller's for good, no views of what is still written to. Never for a graph that is being captured:
    nothing has happened there that could be waited for.
    """
    return Reading(*arrays).end()


def read_by_name(arrays: Mapping[str, wp.array]) -> dict[str, np.ndarray]:
    """The same of arrays that have names."""
    return dict(zip(arrays, read(*arrays.values()), strict=True))


class Reading:
    """A reading of arrays, as `read` does, that is begun: they are read as they are when the device has done what it
    was told before, and it can be told more before anybody waits. A thread ends one before it begins another."""

    def __init__(self, *arrays: wp.array) -> None:
        self.arrays, self.device = arrays, wp.get_device(arrays[0].device)
        self._landed: list[np.ndarray] = []
        self._read: wp.Event | None = None
        if self.device.is_cpu:
            return
        for number, array in enumerate(arrays):
            memory, seen = LANDING.place(number, array)
            wp.copy(memory, array)  # goes on by itself where the memory is page-locked, in the order of the launches
            self._landed.append(seen[: len(array)])
        self._read = LANDING.event(self.device)
        wp.get_stream(self.device).record_event(self._read)

    def end(self) -> list[np.ndarray]:
        """Wait, and have them."""
        wait(self.device, self._read)
        if self._read is None:
            return [array.numpy().copy() for array in self.arrays]
        return [seen.copy() for seen in self._landed]


def wait(device: wp.Device, event: wp.Event | None = None) -> None:
    """Until the device has done what it was told, or the event has happened; a CPU has. All waits of a frame are here,
    so they can be counted."""
    if event is not None:
        wp.synchronize_event(event)
    elif device.is_cuda:
        wp.synchronize_stream(device)
