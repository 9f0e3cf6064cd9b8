"""Sums to which many threads add, the same in whatever order they do.

A GPU's threads come in another order in every run, and a sum of rounded numbers depends on it. One of whole numbers
does not. So there what is added is rounded first to whole multiples of a quantum, and these are added: as exactly as
float32 holds what is added, where that is 2^24 quanta or more. A sum beyond the largest would come out wrong; none
comes near: below a gap's floor the barrier's force grows no more than linearly (contact/pairs.py). On a processor,
whose one thread adds in order, `whole` has no places, and what is added goes straight into the floats it is meant for.
"""

from __future__ import annotations

from functools import cached_property

import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})

QUANTA = wp.constant(2.0**36)  # in 1 N or 1 m: quanta of 1.5e-11, and sums up to 1.3e8
STIFF_QUANTA = wp.constant(2.0**20)  # in 1 N/m: quanta of 1e-6, and sums up to 8.8e12


@wp.func
def whole_of(value: float, quanta: float) -> wp.int64:
    """The nearest whole number of quanta."""
    return wp.int64(wp.rint(value * quanta))


@wp.func
def add(sums: wp.array(dtype=wp.vec3), whole: wp.array(dtype=wp.int64), i: int, value: wp.vec3):
    """sums[i] += value: where `whole` has places only once they are settled."""
    if whole.shape[0] == 0:
        wp.atomic_add(sums, i, value)
    else:
        for k in range(3):
            wp.atomic_add(whole, 3 * i + k, whole_of(value[k], QUANTA))


@wp.func
def add_number(sums: wp.array(dtype=wp.float32), whole: wp.array(dtype=wp.int64), i: int, value: float):
    """The same of numbers, one place each."""
    if whole.shape[0] == 0:
        wp.atomic_add(sums, i, value)
    else:
        wp.atomic_add(whole, i, whole_of(value, QUANTA))


@wp.func
def place_of(i: int, n: int, m: int) -> int:
    """Of the number in row n and column m >= n of block i."""
    return 6 * i + 2 * n + m - wp.where(n == 2, 1, 0)


@wp.func
def add_matrix(blocks: wp.array(dtype=wp.mat33), whole: wp.array(dtype=wp.int64), i: int, value: wp.mat33):
    """The same of symmetric blocks [N/m], six places each."""
    if whole.shape[0] == 0:
        wp.atomic_add(blocks, i, value)
    else:
        for n in range(3):
            for m in range(3):
                if m >= n:
                    wp.atomic_add(whole, place_of(i, n, m), whole_of(value[n, m], STIFF_QUANTA))


@wp.func
def taken(whole: wp.array(dtype=wp.int64), i: int) -> wp.vec3:
    """What was added at i, which is cleared."""
    total = wp.vec3()
    if whole.shape[0] > 0:
        for k in range(3):
            total[k] = float(whole[3 * i + k]) / QUANTA
            whole[3 * i + k] = wp.int64(0)
    return total


@wp.kernel
def settle_kernel(whole: wp.array(dtype=wp.int64), sums_out: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    sums_out[i] = sums_out[i] + taken(whole, i)


@wp.kernel
def settle_numbers_kernel(whole: wp.array(dtype=wp.int64), sums_out: wp.array(dtype=wp.float32)):
    i = wp.tid()
    sums_out[i] = sums_out[i] + float(whole[i]) / QUANTA
    whole[i] = wp.int64(0)


@wp.kernel
def settle_blocks_kernel(whole: wp.array(dtype=wp.int64), blocks_out: wp.array(dtype=wp.mat33)):
    i = wp.tid()
    total = wp.mat33()
    for n in range(3):
        for m in range(3):
            if m >= n:
                at = place_of(i, n, m)
                total[n, m] = float(whole[at]) / STIFF_QUANTA
                total[m, n] = total[n, m]
                whole[at] = wp.int64(0)
    blocks_out[i] = blocks_out[i] + total


def places(count: int, device: str) -> wp.array:
    """(count,) int64, all zero, for what many threads add; none on a processor."""
    return wp.zeros(0 if wp.get_device(device).is_cpu else count, dtype=wp.int64, device=device)


class OrderFreeSums:
    """What threads add to vectors, numbers and blocks of up to `count` places, which is zero between launches.

    A kernel gets the array that the sum is meant for and `vectors`, `numbers` or `blocks`, adds by the functions above,
    and is followed by `settle`, `settle_numbers` or `settle_blocks` of that array. Each has room once it was first
    asked for: who adds to it asks as a simulation is built, for a graph may take no memory.
    """

    def __init__(self, count: int, device: str) -> None:
        self._count, self._device = count, device

    @cached_property
    def vectors(self) -> wp.array:
        """(3 count,) int64."""
        return places(3 * self._count, self._device)

    @cached_property
    def numbers(self) -> wp.array:
        """(count,) int64."""
        return places(self._count, self._device)

    @cached_property
    def blocks(self) -> wp.array:
        """(6 count,) int64."""
        return places(6 * self._count, self._device)

    def make_room(self) -> tuple[wp.array, wp.array, wp.array]:
        """Have all three."""
        return self.vectors, self.numbers, self.blocks

    def settle(self, sums_out: wp.array) -> None:
        """sums (vec3) += what was added, over their length."""
        self._settle(settle_kernel, self.vectors, sums_out)

    def settle_numbers(self, sums_out: wp.array) -> None:
        """The same of float32."""
        self._settle(settle_numbers_kernel, self.numbers, sums_out)

    def settle_blocks(self, blocks_out: wp.array) -> None:
        """The same of mat33."""
        self._settle(settle_blocks_kernel, self.blocks, blocks_out)

    @staticmethod
    def _settle(kernel: wp.Kernel, whole: wp.array, out: wp.array) -> None:
        if len(whole):
            launch(kernel, len(out), [whole], [out], device=out.device)
