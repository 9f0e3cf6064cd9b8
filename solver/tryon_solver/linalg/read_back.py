"""Reading small arrays back to the host: all that is wanted at a time with one wait for the device.

An array's own `numpy()` allocates page-locked memory, copies, and waits, each time: on a GPU that is longer than most
kernels take. A copy by itself takes 5 us there, ten of them as long as a launch or two of what they tell of: so one
launch writes all words, wherever they are, to memory of the host that the device sees.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})

WORD = 4  # bytes, of which all that is read has a whole number
PAGES_KEPT = 32  # of arrays that were read together: other meshes and lists have others


@wp.func_native("""
    return reinterpret_cast<const int*>(place)[number];
""")
def word_at(place: wp.uint64, number: int) -> int:  # type: ignore[empty-body]
    """The so-manieth word of what is there."""


@wp.kernel
def gather_kernel(
    places: wp.array(dtype=wp.uint64), ends: wp.array(dtype=wp.int32), words_out: wp.array(dtype=wp.int32)
):
    """The words of several arrays, one after the other."""
    word = wp.tid()
    k = int(0)
    begun = int(0)
    while word >= ends[k]:
        begun = ends[k]
        k += 1
    words_out[word] = word_at(places[k], word - begun)


@dataclass(frozen=True)
class Page:
    """Arrays that are read together: `places` (K,) uint64, where the device has them, and `ends` (K,) int32, how many
    words they and those before them take; `shapes`, what they are to the host."""

    places: wp.array
    ends: wp.array
    words: int
    shapes: tuple[tuple[slice, np.dtype[Any], tuple[int, ...]], ...]

    @staticmethod
    def of(arrays: Sequence[wp.array]) -> Page:
        """Of contiguous arrays of whole words."""
        shapes, ends = [], [0]
        for array in arrays:
            kind = np.dtype(wp.dtype_to_numpy(getattr(array.dtype, "_wp_scalar_type_", array.dtype)))
            shape = (*array.shape, *getattr(array.dtype, "_shape_", ()))
            words = int(np.prod(shape)) * kind.itemsize // WORD
            shapes.append((slice(ends[-1], ends[-1] + words), kind, shape))
            ends.append(ends[-1] + words)
        device = arrays[0].device
        places: wp.array = wp.array([array.ptr for array in arrays], dtype=wp.uint64, device=device)
        return Page(places, wp.array(ends[1:], dtype=wp.int32, device=device), ends[-1], tuple(shapes))


class Landing(threading.local):
    """Page-locked memory of a thread, kept from reading to reading, as long as the longest of them: `memory` has it by
    device, and how that sees it, and how the host does."""

    def __init__(self) -> None:
        self.memory: dict[str, tuple[wp.array, wp.array, np.ndarray]] = {}
        self.pages: dict[tuple[Any, ...], Page] = {}
        self.events: dict[str, wp.Event] = {}

    def page(self, arrays: Sequence[wp.array]) -> Page:
        """Of these arrays."""
        key = tuple((array.ptr, array.dtype, array.shape) for array in arrays)
        if key not in self.pages:
            if len(self.pages) >= PAGES_KEPT:
                self.pages.clear()
            self.pages[key] = Page.of(arrays)
        return self.pages[key]

    def room(self, device: wp.Device, words: int) -> tuple[wp.array, np.ndarray]:
        """Memory for so many words, as the device and as the host see it."""
        if device.alias not in self.memory or len(self.memory[device.alias][2]) < words:
            memory = wp.empty(words, dtype=wp.int32, device="cpu", pinned=True)
            of_device: wp.array = wp.array(ptr=memory.ptr, dtype=wp.int32, shape=(words,), device=device)
            self.memory[device.alias] = memory, of_device, memory.numpy()
        return self.memory[device.alias][1:]

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
        self._read: wp.Event | None = None
        if self.device.is_cpu:
            return
        self._page = LANDING.page(arrays)
        memory, self._seen = LANDING.room(self.device, self._page.words)
        given = [self._page.places, self._page.ends]
        launch(gather_kernel, self._page.words, given, [memory], device=self.device)
        self._read = LANDING.event(self.device)
        wp.get_stream(self.device).record_event(self._read)

    def end(self) -> list[np.ndarray]:
        """Wait, and have them."""
        wait(self.device, self._read)
        if self._read is None:
            return [array.numpy().copy() for array in self.arrays]
        seen = self._seen[: self._page.words].copy()
        return [seen[words].view(kind).reshape(shape) for words, kind, shape in self._page.shapes]


def wait(device: wp.Device, event: wp.Event | None = None) -> None:
    """Until the device has done what it was told, or the event has happened; a CPU has. All waits of a frame are here,
    so they can be counted."""
    if event is not None:
        wp.synchronize_event(event)
    elif device.is_cuda:
        wp.synchronize_stream(device)
