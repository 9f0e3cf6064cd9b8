"""Whether vectors are numbers at all."""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read

wp.set_module_options({"enable_backward": False})


@wp.kernel
def finite_kernel(x: wp.array(dtype=wp.vec3), counter_out: wp.array(dtype=wp.int32)):
    i = wp.tid()
    if not (wp.isfinite(x[i][0]) and wp.isfinite(x[i][1]) and wp.isfinite(x[i][2])):
        wp.atomic_add(counter_out, 0, 1)


def count_not_finite(x: wp.array, counter_out: wp.array) -> None:
    """counter (1,) int32 = how many of x (A,) vec3 have a coordinate that is not a finite number"""
    counter_out.zero_()
    launch(finite_kernel, len(x), [x], [counter_out], device=x.device)


def is_finite(x: wp.array, counter: wp.array) -> bool:
    """Is every coordinate of x (A,) vec3 a finite number? Waits for the device; `counter` (1,) int32 is scratch."""
    count_not_finite(x, counter)
    return int(read(counter)[0][0]) == 0
