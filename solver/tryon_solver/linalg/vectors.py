"""Operations on vec3 arrays whose scalars stay on the device."""

from __future__ import annotations

from collections.abc import Sequence

import warp as wp

from tryon_solver.linalg.blocks import BLOCK, whole_blocks
from tryon_solver.linalg.clear import clear
from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})

PARTS = 512  # of a sum, each by a block of threads, which a single one adds up in order


@wp.func
def slip_of(kick: wp.vec3, hardest: float) -> wp.vec3:
    """What of a change of velocity is not felt (stepping/leap.py)."""
    size = wp.length(kick)
    if size > hardest:
        return (1.0 - (hardest / size) * (hardest / size)) * kick
    return wp.vec3()


@wp.kernel
def add_scaled_kernel(scale: wp.array(dtype=wp.float32), p: wp.array(dtype=wp.vec3), x_out: wp.array(dtype=wp.vec3)):
    """x += scale[0] p"""
    i = wp.tid()
    x_out[i] = x_out[i] + scale[0] * p[i]


@wp.func
def descent_length(slope: float, curvature: float) -> float:
    """Exact minimiser along p of a quadratic: -<g, p> / <p, A p>; zero where p is no direction of descent."""
    if slope < 0.0 and curvature > 0.0:
        return -slope / curvature
    return 0.0


@wp.kernel
def descend_kernel(
    slope: wp.array(dtype=wp.float32),
    curvature: wp.array(dtype=wp.float32),
    p: wp.array(dtype=wp.vec3),
    product: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    gradient: wp.array(dtype=wp.vec3),
    length_out: wp.array(dtype=wp.float32),
):
    """x += a p, g += a A p"""
    i = wp.tid()
    length = descent_length(slope[0], curvature[0])
    x[i] = x[i] + length * p[i]
    gradient[i] = gradient[i] + length * product[i]
    if i == 0:
        length_out[0] = length


@wp.kernel
def subtract_kernel(a: wp.array(dtype=wp.vec3), b: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.vec3)):
    """out = a - b"""
    i = wp.tid()
    out[i] = a[i] - b[i]


@wp.kernel
def move_origin_kernel(by: wp.vec3, x_out: wp.array(dtype=wp.vec3)):
    """x -= by"""
    i = wp.tid()
    x_out[i] = x_out[i] - by


@wp.kernel
def largest_kernel(a: wp.array(dtype=wp.vec3), threads: int, largest_out: wp.array(dtype=wp.float32)):
    """largest_out[0] = max(largest_out[0], |a_i|)"""
    thread = wp.tid()
    longest = float(0.0)
    for i in range(thread, a.shape[0], threads):
        longest = wp.max(longest, wp.length(a[i]))
    of_block = wp.tile_max(wp.tile(longest))[0]
    if thread % wp.block_dim() == 0:
        wp.atomic_max(largest_out, 0, of_block)


@wp.kernel
def largest_number_kernel(values: wp.array(dtype=wp.float32), threads: int, largest_out: wp.array(dtype=wp.float32)):
    """largest_out[0] = max(largest_out[0], values_i)"""
    thread = wp.tid()
    largest = float(0.0)
    for i in range(thread, values.shape[0], threads):
        largest = wp.max(largest, values[i])
    of_block = wp.tile_max(wp.tile(largest))[0]
    if thread % wp.block_dim() == 0:
        wp.atomic_max(largest_out, 0, of_block)


@wp.kernel
def dot_in_parts_kernel(
    a: wp.array(dtype=wp.vec3), b: wp.array(dtype=wp.vec3), threads: int, parts_out: wp.array(dtype=wp.float32)
):
    """parts_out[k] = what block k of threads has of sum_i a_i . b_i"""
    thread = wp.tid()
    part = float(0.0)
    for i in range(thread, a.shape[0], threads):
        part += wp.dot(a[i], b[i])
    of_block = wp.tile_sum(wp.tile(part))[0]
    if thread % wp.block_dim() == 0:
        parts_out[thread // wp.block_dim()] = of_block


@wp.kernel
def sum_parts_kernel(parts: wp.array(dtype=wp.float32), count: int, threads: int, out: wp.array(dtype=wp.float32)):
    """One block: out[0] = the sum of the first `count`, in a fixed order"""
    part = float(0.0)
    for k in range(wp.tid(), count, threads):
        part += parts[k]
    whole = wp.tile_sum(wp.tile(part))[0]
    if wp.tid() == 0:
        out[0] = whole


@wp.kernel
def dots_in_parts_kernel(
    a0: wp.array(dtype=wp.vec3),
    b0: wp.array(dtype=wp.vec3),
    a1: wp.array(dtype=wp.vec3),
    b1: wp.array(dtype=wp.vec3),
    a2: wp.array(dtype=wp.vec3),
    b2: wp.array(dtype=wp.vec3),
    number: int,
    threads: int,
    parts_out: wp.array(dtype=wp.float32),
):
    """The same of the first two or three products: parts_out[3 k], and so on"""
    thread = wp.tid()
    first = float(0.0)
    second = float(0.0)
    third = float(0.0)
    for i in range(thread, a0.shape[0], threads):
        first += wp.dot(a0[i], b0[i])
    for i in range(thread, a1.shape[0], threads):
        second += wp.dot(a1[i], b1[i])
    if number > 2:
        for i in range(thread, a2.shape[0], threads):
            third += wp.dot(a2[i], b2[i])
    first_of_block = wp.tile_sum(wp.tile(first))[0]
    second_of_block = wp.tile_sum(wp.tile(second))[0]
    third_of_block = wp.tile_sum(wp.tile(third))[0]
    if thread % wp.block_dim() == 0:
        part = 3 * (thread // wp.block_dim())
        parts_out[part] = first_of_block
        parts_out[part + 1] = second_of_block
        parts_out[part + 2] = third_of_block


@wp.kernel
def dots_of_parts_kernel(
    parts: wp.array(dtype=wp.float32),
    count: int,
    number: int,
    threads: int,
    out0: wp.array(dtype=wp.float32),
    out1: wp.array(dtype=wp.float32),
    out2: wp.array(dtype=wp.float32),
):
    """One block: the sums of the first `count` threes of parts, in a fixed order"""
    first = float(0.0)
    second = float(0.0)
    third = float(0.0)
    for k in range(wp.tid(), count, threads):
        first += parts[3 * k]
        second += parts[3 * k + 1]
        third += parts[3 * k + 2]
    whole_first = wp.tile_sum(wp.tile(first))[0]
    whole_second = wp.tile_sum(wp.tile(second))[0]
    whole_third = wp.tile_sum(wp.tile(third))[0]
    if wp.tid() == 0:
        out0[0] = whole_first
        out1[0] = whole_second
        if number > 2:
            out2[0] = whole_third


@wp.kernel
def dot_alone_kernel(a: wp.array(dtype=wp.vec3), b: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.float32)):
    """out[0] = sum_i a_i . b_i, by one thread"""
    total = wp.float64(0.0)
    for i in range(a.shape[0]):
        total += wp.float64(wp.dot(a[i], b[i]))
    out[0] = wp.float32(total)


def dot(a: wp.array, b: wp.array, out: wp.array, parts: wp.array) -> None:
    """out[0] = sum_i a_i . b_i, on the device, in a fixed order; `parts` (PARTS,) float32 is scratch."""
    if wp.get_device(a.device).is_cuda:
        # Warp's own needs memory for its partial sums, which the body of a loop in a graph cannot allocate
        threads = min(whole_blocks(len(a)), PARTS * BLOCK)
        launch(dot_in_parts_kernel, threads, [a, b, threads], [parts], block_dim=BLOCK, device=a.device)
        launch(sum_parts_kernel, BLOCK, [parts, threads // BLOCK, BLOCK], [out], block_dim=BLOCK, device=a.device)
    else:
        launch(dot_alone_kernel, 1, [a, b], [out], device=a.device)


def dots(sums: Sequence[tuple[wp.array, wp.array, wp.array]], parts: wp.array) -> None:
    """`dot` of two or three (a, b, out) at once, in as many launches of a GPU as one takes."""
    (a0, b0, out0), (a1, b1, out1), *more = sums
    a2, b2, out2 = more[0] if more else sums[0]
    device = parts.device
    if wp.get_device(device).is_cpu:
        for a, b, out in sums:
            dot(a, b, out, parts)
        return
    threads = min(whole_blocks(max(len(a) for a, _, _ in sums)), PARTS // 3 * BLOCK)
    given = [a0, b0, a1, b1, a2, b2, len(sums), threads]
    launch(dots_in_parts_kernel, threads, given, [parts], block_dim=BLOCK, device=device)
    summed, outs = [parts, threads // BLOCK, len(sums), BLOCK], [out0, out1, out2]
    launch(dots_of_parts_kernel, BLOCK, summed, outs, block_dim=BLOCK, device=device)


def descend(
    p: wp.array,
    product: wp.array,
    x: wp.array,
    gradient: wp.array,
    scalars: Sequence[wp.array],
    parts: wp.array,
) -> None:
    """To the minimum along p (N,) of the quadratic with the `gradient` g (N,) at x and with the `product` A p (N,):
    x += a p and g += a A p. The `scalars` are three, (1,) each, for <g, p>, <p, A p> and a; `parts` is as of `dot`."""
    slope, curvature, length = scalars
    dots([(gradient, p, slope), (p, product, curvature)], parts)
    launch(descend_kernel, len(p), [slope, curvature, p, product], [x, gradient, length], device=p.device)


def find_largest(vectors: wp.array, largest_out: wp.array) -> None:
    """largest_out[0] = max_i |vectors_i|, on the device."""
    clear(largest_out)
    threads = whole_blocks(len(vectors))
    launch(largest_kernel, threads, [vectors, threads], [largest_out], block_dim=BLOCK, device=vectors.device)


def find_largest_number(values: wp.array, largest_out: wp.array) -> None:
    """largest_out[0] = max_i values_i, or 0, on the device."""
    clear(largest_out)
    threads = whole_blocks(len(values))
    launch(largest_number_kernel, threads, [values, threads], [largest_out], block_dim=BLOCK, device=values.device)


def add_scaled(scale: wp.array, p: wp.array, x_out: wp.array) -> None:
    """x += scale[0] p, over the length of p."""
    launch(add_scaled_kernel, len(p), [scale, p], [x_out], device=p.device)


def subtract(a: wp.array, b: wp.array, out: wp.array) -> None:
    """out = a - b, over the length of out."""
    launch(subtract_kernel, len(out), [a, b], [out], device=out.device)


def move_origin(x: wp.array, by: wp.vec3) -> None:
    """x -= by: the same places seen from an origin `by` m away."""
    launch(move_origin_kernel, len(x), [by], [x], device=x.device)
