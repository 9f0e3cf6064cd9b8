"""Writing small arrays to the device, over and over.

An array's own `assign` makes an array of the host's first, in memory that a GPU can't fetch by itself: the host waits
for it each time.
"""

from __future__ import annotations

import numpy as np
import warp as wp


class Upload:
    """What writes to one array: on a GPU through page-locked memory, which it fetches in the order of the launches."""

    def __init__(self, array: wp.array) -> None:
        self.array = array
        self._staged: tuple[wp.array, np.ndarray, wp.Event] | None = None
        if wp.get_device(array.device).is_cuda:
            memory = wp.empty(array.shape, dtype=array.dtype, device="cpu", pinned=True)
            self._staged = memory, memory.numpy(), wp.Event(array.device)

    def write(self, values: np.ndarray) -> None:
        """array[:] = values, of the array's shape, as of the launches that follow."""
        if self._staged is None:
            self.array.assign(values)
            return
        memory, seen, fetched = self._staged
        wp.synchronize_event(fetched)  # the one before; it has been, as a rule
        seen[...] = values
        wp.copy(self.array, memory)
        wp.get_stream(self.array.device).record_event(fetched)
