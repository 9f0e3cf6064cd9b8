"""Writing small arrays to the device, over and over.

An array's own `assign` makes an array of the host's first, in memory that a GPU can't fetch by itself: the host waits
for it each time. A copy is a launch of the host's own, beside its graphs.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})

WORD = 4  # bytes, of which all that is uploaded has a whole number


@wp.kernel
def fetch_kernel(words: wp.array(dtype=wp.int32), words_out: wp.array(dtype=wp.int32)):
    k = wp.tid()
    words_out[k] = words[k]


class Upload:
    """What writes to one contiguous array: on a GPU into page-locked memory of the host, which the device sees, and
    from which it is to `fetch` it."""

    def __init__(self, array: wp.array) -> None:
        self.array, self.device = array, wp.get_device(array.device)
        self._staged: tuple[wp.array, np.ndarray, wp.Event] | None = None
        if self.device.is_cuda:
            memory = wp.empty(array.shape, dtype=array.dtype, device="cpu", pinned=True)
            self._staged = memory, memory.numpy(), wp.Event(self.device)
            words = (memory.capacity // WORD,)
            self._words: wp.array = wp.array(ptr=memory.ptr, dtype=wp.int32, shape=words, device=self.device)
            self._words_out: wp.array = wp.array(ptr=array.ptr, dtype=wp.int32, shape=words, device=self.device)

    def write(self, values: np.ndarray) -> None:
        """array[:] = values, of the array's shape, as of the next `fetch`."""
        if self._staged is None:
            self.array.assign(values)
            return
        _, seen, fetched = self._staged
        wp.synchronize_event(fetched)  # what was written before; it has been, as a rule
        seen[...] = values

    def fetch(self) -> None:
        """A launch, for a graph to repeat: the array has what was written last. Not on a condition, where a graph has
        no events: by one, which happens in each of its launches, `write` knows that it may write again."""
        if self._staged is None:
            return
        launch(fetch_kernel, len(self._words), [self._words], [self._words_out], device=self.device)
        stream = wp.get_stream(self.device)
        stream.record_event(self._staged[2], external=stream.is_capturing)
