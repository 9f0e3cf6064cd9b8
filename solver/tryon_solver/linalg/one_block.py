"""Sums by one block of threads: a GPU too adds them in the same order in every run.

Many blocks finish in another order each time, and what they add to a sum is rounded in that order (order_free.py). One
block of a thousand threads sums 20,000 vectors in the time of two launches; what is read of two arrays at once takes it
longer, and is summed in parts (vectors.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})

ONE_BLOCK = 1024  # threads, the most that a GPU's block has


@wp.kernel
def total_kernel(vectors: wp.array(dtype=wp.vec3), many: int, threads: int, total_out: wp.array(dtype=wp.vec3)):
    """total_out[0] = the sum of the first `many`"""
    total = wp.vec3()
    for i in range(wp.tid(), many, threads):
        total += vectors[i]
    whole = wp.tile_sum(wp.tile(total, preserve_type=True))[0]
    if wp.tid() == 0:
        total_out[0] = whole


def launch_one_block(kernel: wp.Kernel, inputs: Sequence[Any], outputs: Sequence[Any], device: Any) -> None:
    """Launch a kernel that sums, by one block; behind its inputs it gets the number of threads, on a processor one."""
    threads = 1 if wp.get_device(device).is_cpu else ONE_BLOCK
    launch(kernel, threads, [*inputs, threads], outputs, block_dim=threads, device=device)


def sum_up(vectors: wp.array, many: int, total_out: wp.array) -> None:
    """total_out (1,) vec3 = the sum of the first `many`"""
    launch_one_block(total_kernel, [vectors, many], [total_out], vectors.device)
