"""Slots of a list that threads append to.

Additions to one counter wait for each other on a GPU, and a search of 20,000 vertices has a million of them. Threads
that run in step and ask at once therefore ask together (Adinets 2014, warp-aggregated atomics).
"""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    const unsigned together = __activemask();
    const int lane = threadIdx.x & 31;
    const int asking = __ffs(together) - 1;
    int first = 0;
    if (lane == asking)
        first = atomicAdd(counts.data + place, __popc(together));
    first = __shfl_sync(together, first, asking);
    return first + __popc(together & ((1u << lane) - 1u));
#else
    return counts.data[place]++;
#endif
""")
def next_slot(counts: wp.array(dtype=wp.int32), place: int) -> int:  # type: ignore[empty-body, valid-type]
    """The next free slot of the list whose length is counts[place], which grows by one; of 1D launches."""
