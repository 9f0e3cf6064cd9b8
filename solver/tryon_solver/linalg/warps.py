"""What the 32 threads of a GPU that run in step tell each other out of their registers; all of them have to be there.

Elsewhere a thread is alone, and what is said of all is said of it.
"""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False})

WARP = 32  # threads that run in step


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __shfl_sync(0xffffffffu, value, lane);
#else
    return value;
#endif
""")
def value_of_lane(value: float, lane: int) -> float:  # type: ignore[empty-body]
    """The value that the thread `lane` of the 32 has."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __shfl_sync(0xffffffffu, value, lane);
#else
    return value;
#endif
""")
def number_of_lane(value: int, lane: int) -> int:  # type: ignore[empty-body]
    """The same of whole numbers."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    for (int apart = 16; apart > 0; apart >>= 1)
        value = fminf(value, __shfl_xor_sync(0xffffffffu, value, apart));
#endif
    return value;
""")
def least_of_warp(value: float) -> float:  # type: ignore[empty-body]
    """The least of the 32 threads' values."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return 32;
#else
    return 1;
#endif
""")
def lanes_of_warp() -> int:  # type: ignore[empty-body]
    """How many threads run in step."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return threadIdx.x & 31;
#else
    return 0;
#endif
""")
def lane_of_warp() -> int:  # type: ignore[empty-body]
    """Which of them this one is."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    const int lane = threadIdx.x & 31;
    int upto = value;
    for (int apart = 1; apart < 32; apart <<= 1) {
        const int before = __shfl_up_sync(0xffffffffu, upto, apart);
        if (lane >= apart)
            upto += before;
    }
    return upto - value;
#else
    return 0;
#endif
""")
def sum_of_lanes_before(value: int) -> int:  # type: ignore[empty-body]
    """The sum of the values of all lanes before this one."""


@wp.func_native("""
    int lane = 0;
#if defined(__CUDA_ARCH__)
    for (int further = 16; further > 0; further >>= 1)
        if (__shfl_sync(0xffffffffu, begin, lane + further) <= number)
            lane += further;
#endif
    return lane;
""")
def lane_that_has(begin: int, number: int) -> int:  # type: ignore[empty-body]
    """The last lane whose `begin` is not above `number`, which is not below 0; from lane to lane `begin` ascends, from
    0."""


@wp.func
def free_slots(counts: wp.array(dtype=wp.int32), place: int, wanted: int) -> int:  # type: ignore[valid-type]
    """The first of so many free slots of the list whose length is counts[place], which grows by what all lanes want."""
    before = sum_of_lanes_before(wanted)
    all_want = number_of_lane(before + wanted, lanes_of_warp() - 1)
    first = int(0)
    if lane_of_warp() == 0 and all_want > 0:
        first = wp.atomic_add(counts, place, all_want)
    return number_of_lane(first, 0) + before
