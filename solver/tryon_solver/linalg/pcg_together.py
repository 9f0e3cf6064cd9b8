"""Conjugate gradients by all threads of a device, two kernels an iteration.

There an iteration's arithmetic is a microsecond or two, and what takes time is one launch waiting for the one before.
So p = z + b p is made where it is multiplied, rows and pairs are multiplied in one launch, and each launch leaves the
sum that the next one needs: a dot product is never a launch of its own. What a sum is added into has been cleared two
launches earlier, in a ring of four, and of the iteration's number each kernel has its own copy, written by the other.
"""

from __future__ import annotations

from collections.abc import Sequence

import warp as wp

from tryon_solver.linalg.blocks import BLOCK, whole_blocks
from tryon_solver.linalg.paired_matrix import PairedMatrix, pair_count, pair_force

wp.set_module_options({"enable_backward": False})

LANES = 8  # threads that multiply a row together on a GPU, of the 32 that run in step: sum_of_lanes
TURNS = 4  # iterations between two looks at whether there is more to do; even, for the two directions to change places

RING = wp.constant(4)
SQUARED = wp.constant(0)  # ring of <r, z>
CURVATURE = wp.constant(4)  # ring of <p, A p>
FIRST_NORM = wp.constant(8)  # <g, D^-1 g>
SCALARS = 9

TAKEN = wp.constant(0)  # iterations finished, for the multiplying kernel
NOW = wp.constant(1)  # the one that is multiplied, for the advancing kernel; -1: none
MORE = wp.constant(2)  # 1 while there is more to do


@wp.kernel
def mark_kernel(m: PairedMatrix, threads: int, coupled_out: wp.array(dtype=wp.int32)):
    for c in range(wp.tid(), pair_count(m), threads):
        for k in range(4):
            coupled_out[m.ids[c][k]] = 1


@wp.kernel
def start_kernel(
    m: PairedMatrix,
    inverse: wp.array(dtype=wp.mat33),
    gradient: wp.array(dtype=wp.vec3),
    coupled: wp.array(dtype=wp.int32),
    threads: int,
    solution_out: wp.array(dtype=wp.vec3),
    residual_out: wp.array(dtype=wp.vec3),
    preconditioned_out: wp.array(dtype=wp.vec3),
    direction_out: wp.array(dtype=wp.vec3),
    product_out: wp.array(dtype=wp.vec3),
    scalars: wp.array(dtype=wp.float32),
    state_out: wp.array(dtype=wp.int32),
):
    first = float(0.0)
    squared = float(0.0)
    for i in range(wp.tid(), inverse.shape[0], threads):
        r = -gradient[i]
        z = inverse[i] * r
        part = wp.dot(r, z)
        first += part
        direction_out[i] = wp.vec3()
        product_out[i] = wp.vec3()
        if i < m.columns.shape[0] or coupled[i] == 1:
            squared += part
            solution_out[i] = wp.vec3()
            residual_out[i] = r
            preconditioned_out[i] = z
        else:
            solution_out[i] = z
            residual_out[i] = wp.vec3()
            preconditioned_out[i] = wp.vec3()
    wp.tile_atomic_add(scalars, wp.tile_sum(wp.tile(first)), offset=FIRST_NORM)
    wp.tile_atomic_add(scalars, wp.tile_sum(wp.tile(squared)), offset=SQUARED)
    if wp.tid() == 0:
        state_out[TAKEN] = 0
        state_out[MORE] = 1


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    for (int apart = 4; apart > 0; apart >>= 1)
        value += __shfl_xor_sync(0xffffffffu, value, apart, 8);
#endif
    return value;
""")
def sum_of_lanes(value: float) -> float:
    """The sum over LANES neighbouring threads of a GPU, in each of them; elsewhere the value itself."""


@wp.kernel
def multiply_kernel(
    m: PairedMatrix,
    lanes: int,
    shares: int,
    at_most: int,
    tolerance: float,
    preconditioned: wp.array(dtype=wp.vec3),
    direction_before: wp.array(dtype=wp.vec3),
    threads: int,
    direction_out: wp.array(dtype=wp.vec3),
    product: wp.array(dtype=wp.vec3),
    scalars: wp.array(dtype=wp.float32),
    state: wp.array(dtype=wp.int32),
):
    """p = z + b p, A p and <p, A p>, if there is anything left to do.

    A row of cloth is shared by `lanes` threads: one alone would wait for memory as often as the row is long. There are
    `shares` of all rows, with those that fill up the last block: who adds up together must be here together.
    """
    thread = wp.tid()
    number = state[TAKEN]
    slot = number % RING
    squared = scalars[SQUARED + slot]
    going_on = number < at_most and squared > tolerance * tolerance * scalars[FIRST_NORM]
    if thread == 0:
        state[NOW] = wp.where(going_on, number, -1)
        state[MORE] = wp.where(going_on, 1, 0)
        scalars[SQUARED + (slot + 2) % RING] = 0.0
        scalars[CURVATURE + (slot + 1) % RING] = 0.0
    if not going_on:
        return
    b = float(0.0)
    if number > 0:
        b = squared / scalars[SQUARED + (slot + 3) % RING]
    rows = m.columns.shape[0]
    others = preconditioned.shape[0] - rows
    part = float(0.0)
    for e in range(thread, shares + others + pair_count(m), threads):
        if e < shares:
            i = e // lanes
            lane = e % lanes
            here = wp.vec3()
            row = wp.vec3()
            if i < rows:
                here = preconditioned[i] + b * direction_before[i]
                # by differences, as in paired_matrix.py
                for k in range(1 + lane, m.columns.shape[1], lanes):
                    j = m.columns[i, k]
                    if j == i:
                        break  # the rest of the row is padding
                    row += m.blocks[i, k] * (preconditioned[j] + b * direction_before[j] - here)
                for k in range(lane, m.far_columns.shape[1], lanes):
                    j = m.far_columns[i, k]
                    if j == i:
                        break
                    row += m.weights[i, k] * (preconditioned[j] + b * direction_before[j] - here)
            row = wp.vec3(sum_of_lanes(row[0]), sum_of_lanes(row[1]), sum_of_lanes(row[2]))
            if lane == 0 and i < rows:
                row += m.diagonal[i] * here
                direction_out[i] = here
                part += wp.dot(here, row)
                wp.atomic_add(product, i, row)
        elif e < shares + others:
            i = rows + e - shares
            here = preconditioned[i] + b * direction_before[i]
            direction_out[i] = here
            row = m.diagonal[i] * here
            part += wp.dot(here, row)
            wp.atomic_add(product, i, row)
        else:
            c = e - shares - others
            v = m.ids[c]
            w = m.lam[c]
            u = wp.vec3()
            for k in range(4):
                u += w[k] * (preconditioned[v[k]] + b * direction_before[v[k]])
            f = pair_force(m, c, u)
            part += wp.dot(u, f)
            for k in range(4):
                wp.atomic_add(product, v[k], w[k] * f)
    wp.tile_atomic_add(scalars, wp.tile_sum(wp.tile(part)), offset=CURVATURE + slot)


@wp.kernel
def advance_kernel(
    inverse: wp.array(dtype=wp.mat33),
    direction: wp.array(dtype=wp.vec3),
    threads: int,
    solution: wp.array(dtype=wp.vec3),
    residual: wp.array(dtype=wp.vec3),
    preconditioned_out: wp.array(dtype=wp.vec3),
    product: wp.array(dtype=wp.vec3),
    scalars: wp.array(dtype=wp.float32),
    state: wp.array(dtype=wp.int32),
):
    """x += a p, r -= a A p, z = D^-1 r and <r, z>, with a = <r, z>/<p, A p>; clears A p."""
    thread = wp.tid()
    number = state[NOW]
    if number < 0:
        return
    slot = number % RING
    a = float(0.0)
    if scalars[CURVATURE + slot] > 0.0:
        a = scalars[SQUARED + slot] / scalars[CURVATURE + slot]
    part = float(0.0)
    for i in range(thread, inverse.shape[0], threads):
        solution[i] = solution[i] + a * direction[i]
        r = residual[i] - a * product[i]
        product[i] = wp.vec3()
        z = inverse[i] * r
        residual[i] = r
        preconditioned_out[i] = z
        part += wp.dot(r, z)
    wp.tile_atomic_add(scalars, wp.tile_sum(wp.tile(part)), offset=SQUARED + (slot + 1) % RING)
    if thread == 0:
        state[TAKEN] = number + 1


def solve(
    matrix: PairedMatrix,
    inverse: wp.array,
    gradient: wp.array,
    solution_out: wp.array,
    residual: wp.array,
    preconditioned: wp.array,
    directions: tuple[wp.array, wp.array],
    product: wp.array,
    coupled: wp.array,
    scalars: wp.array,
    state: wp.array,
    at_most: int,
    tolerance: float,
) -> None:
    """As `pcg.solve`; the arrays behind the solution are its scratch: (A,), `scalars` (SCALARS,), `state` (3,)."""
    device, count, pairs = gradient.device, len(gradient), len(matrix.ids)
    threads = whole_blocks(count)
    lanes = LANES if wp.get_device(device).is_cuda else 1
    rows = len(matrix.columns)
    shares = -(-lanes * rows // BLOCK) * BLOCK
    all_threads = whole_blocks(shares + count - rows + pairs)

    def launch(kernel: wp.Kernel, dim: int, inputs: Sequence[object], outputs: Sequence[object]) -> None:
        wp.launch(kernel, dim, [*inputs, dim], outputs, block_dim=BLOCK, device=device)

    def turn() -> None:
        before, now = directions
        for _ in range(TURNS):
            given = [matrix, lanes, shares, at_most, tolerance, preconditioned, before]
            launch(multiply_kernel, all_threads, given, [now, product, scalars, state])
            kept = [solution_out, residual, preconditioned, product, scalars, state]
            launch(advance_kernel, threads, [inverse, now], kept)
            before, now = now, before

    coupled.zero_()
    scalars.zero_()
    launch(mark_kernel, whole_blocks(pairs), [matrix], [coupled])
    made = [solution_out, residual, preconditioned, directions[0], product, scalars, state]
    launch(start_kernel, threads, [matrix, inverse, gradient, coupled], made)
    wp.capture_while(state[int(MORE) : int(MORE) + 1], turn)
