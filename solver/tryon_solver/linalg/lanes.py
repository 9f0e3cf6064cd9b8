"""Rows of a sparse matrix, and other long sums, shared by neighbouring threads of a GPU.

A thread that goes along a row alone waits for memory as often as the row is long, and a garment's rows are too few to
hide that. Threads that add up what they found must be there together, so launches fill up their last block.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.blocks import BLOCK

wp.set_module_options({"enable_backward": False})

LANES = 4  # threads to a row on a GPU; a power of two, at most the 32 that run in step


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    for (int apart = 2; apart > 0; apart >>= 1)
        value += __shfl_xor_sync(0xffffffffu, value, apart, 4);
#endif
    return value;
""")
def sum_of_lanes(value: float) -> float:  # type: ignore[empty-body]
    """The sum over LANES neighbouring threads of a GPU, in each of them; elsewhere the value itself."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    for (int apart = 2; apart > 0; apart >>= 1)
        value = fminf(value, __shfl_xor_sync(0xffffffffu, value, apart, 4));
#endif
    return value;
""")
def least_of_lanes(value: float) -> float:  # type: ignore[empty-body]
    """The least of LANES neighbouring threads' values, likewise."""


def lanes_of(device: str) -> int:
    """How many threads share a row."""
    return LANES if wp.get_device(device).is_cuda else 1


def shares_of(rows: int, lanes: int) -> int:
    """So many threads' shares of rows, and those that fill up the last block."""
    return -(-lanes * rows // BLOCK) * BLOCK
