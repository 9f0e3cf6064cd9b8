"""The total force that conjugate gradients leave behind when they are cut short, met by moving all of the cloth as one.

Inner forces have no total, so whatever total is left is momentum that comes from nowhere: a budget of a few iterations
stopped a tube in mid-air. One more step, along the uniform move in the direction of that total and as long as is best
for the quadratic, leaves none where inertia alone resists it, and never makes the solution worse where contact does.
"""

from __future__ import annotations

from collections.abc import Callable

import warp as wp

from tryon_solver.linalg.blocks import BLOCK, whole_blocks
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.pcg import ConjugateGradients
from tryon_solver.linalg.vectors import dot

wp.set_module_options({"enable_backward": False})


@wp.kernel
def total_kernel(
    residual: wp.array(dtype=wp.vec3), moving: int, threads: int, total_out: wp.array(dtype=wp.vec3)
):
    """total_out[0] += the sum of the first `moving`"""
    total = wp.vec3()
    for i in range(wp.tid(), moving, threads):
        total += residual[i]
    wp.tile_atomic_add(total_out, wp.tile_sum(wp.tile(total, preserve_type=True)), offset=0)


@wp.kernel
def spread_kernel(total: wp.array(dtype=wp.vec3), moving: int, direction_out: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    direction_out[i] = wp.vec3()
    if i < moving:
        direction_out[i] = total[0]


@wp.kernel
def add_step_kernel(
    slope: wp.array(dtype=wp.float32),
    curvature: wp.array(dtype=wp.float32),
    direction: wp.array(dtype=wp.vec3),
    solution: wp.array(dtype=wp.vec3),
):
    """x += <r, q>/<q, A q> q"""
    i = wp.tid()
    if curvature[0] > 0.0:
        solution[i] = solution[i] + (slope[0] / curvature[0]) * direction[i]


def sum_up(vectors: wp.array, moving: int, total_out: wp.array) -> None:
    """total_out (1,) = the sum of the first `moving`"""
    total_out.zero_()
    threads = whole_blocks(moving)
    launch(total_kernel, threads, [vectors, moving, threads], [total_out], block_dim=BLOCK, device=vectors.device)


def move_as_one(
    cg: ConjugateGradients,
    multiply: Callable[[wp.array, wp.array], None],
    moving: int,
    solution: wp.array,
) -> None:
    """Improve what `pcg.solve` just found by the best step of the first `moving` unknowns along their total residual.

    `multiply` is the matrix of `pcg.solve`, as far as it is not blind to such a move, over as many unknowns as its
    second argument is long. The residual that `cg` keeps is not renewed.
    """
    device, count = solution.device, len(solution)
    slope, curvature = cg.scalars[0:1], cg.scalars[2:3]
    total = cg.preconditioned[0:1]
    sum_up(cg.residual, moving, total)
    launch(spread_kernel, count, [total, moving], [cg.direction], device=device)
    direction, product = cg.direction[:moving], cg.product[:moving]
    multiply(cg.direction, product)
    dot(cg.residual[:moving], direction, slope)
    dot(direction, product, curvature)
    launch(add_step_kernel, count, [slope, curvature, cg.direction], [solution], device=device)
