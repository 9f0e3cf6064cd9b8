"""Preconditioned conjugate gradients on vec3 unknowns (Saad 2003, algorithm 9.1), block-Jacobi preconditioner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import warp as wp

from tryon_solver.linalg.vectors import dot

wp.set_module_options({"enable_backward": False})


@dataclass
class ConjugateGradients:
    """Scratch of one solver of fixed size. `blocks` (n,) mat33 inverse diagonal blocks."""

    residual: wp.array
    preconditioned: wp.array
    direction: wp.array
    product: wp.array
    scalars: wp.array  # (4,) float32: <r, z>, previous <r, z>, <p, A p>, first <r, z>

    @staticmethod
    def allocate(count: int, device: str) -> ConjugateGradients:
        def vectors() -> wp.array:
            return wp.zeros(count, dtype=wp.vec3, device=device)

        return ConjugateGradients(
            vectors(), vectors(), vectors(), vectors(), wp.zeros(4, dtype=wp.float32, device=device)
        )


@wp.kernel
def start_kernel(
    blocks: wp.array(dtype=wp.mat33),
    gradient: wp.array(dtype=wp.vec3),
    solution_out: wp.array(dtype=wp.vec3),
    residual_out: wp.array(dtype=wp.vec3),
    preconditioned_out: wp.array(dtype=wp.vec3),
    direction_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    r = -gradient[i]
    z = blocks[i] * r
    solution_out[i] = wp.vec3()
    residual_out[i] = r
    preconditioned_out[i] = z
    direction_out[i] = z


@wp.kernel
def advance_kernel(
    blocks: wp.array(dtype=wp.mat33),
    scalars: wp.array(dtype=wp.float32),
    direction: wp.array(dtype=wp.vec3),
    product: wp.array(dtype=wp.vec3),
    solution: wp.array(dtype=wp.vec3),
    residual: wp.array(dtype=wp.vec3),
    preconditioned_out: wp.array(dtype=wp.vec3),
):
    """x += a p, r -= a A p, z = D^-1 r with a = <r, z>/<p, A p>."""
    i = wp.tid()
    a = float(0.0)
    if scalars[2] > 0.0:
        a = scalars[0] / scalars[2]
    solution[i] = solution[i] + a * direction[i]
    r = residual[i] - a * product[i]
    residual[i] = r
    preconditioned_out[i] = blocks[i] * r


@wp.kernel
def turn_kernel(
    scalars: wp.array(dtype=wp.float32), preconditioned: wp.array(dtype=wp.vec3), direction: wp.array(dtype=wp.vec3)
):
    """p = z + b p with b = <r, z> / previous <r, z>."""
    i = wp.tid()
    b = float(0.0)
    if scalars[1] > 0.0:
        b = scalars[0] / scalars[1]
    direction[i] = preconditioned[i] + b * direction[i]


@wp.kernel
def precondition_kernel(
    blocks: wp.array(dtype=wp.mat33), gradient: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.vec3)
):
    """out = D^-1 g"""
    i = wp.tid()
    out[i] = blocks[i] * gradient[i]


def preconditioned_norm_sq(cg: ConjugateGradients, blocks: wp.array, gradient: wp.array) -> float:
    """<g, D^-1 g> with `blocks` the inverse diagonal blocks D^-1."""
    wp.launch(precondition_kernel, len(gradient), [blocks, gradient], [cg.preconditioned], device=gradient.device)
    dot(gradient, cg.preconditioned, cg.scalars[0:1])
    return float(cg.scalars.numpy()[0])


def solve(
    cg: ConjugateGradients,
    multiply: Callable[[wp.array, wp.array], None],
    blocks: wp.array,
    gradient: wp.array,
    solution_out: wp.array,
    at_most: int,
    tolerance: float,
) -> int:
    """Solve A p = -gradient from zero; returns the iterations taken.

    Stops when <r, D^-1 r> has fallen below tolerance^2 of its first value. `multiply(p, product_out)` applies A.
    """
    device, count = gradient.device, len(gradient)
    current, previous, curvature = cg.scalars[0:1], cg.scalars[1:2], cg.scalars[2:3]
    wp.launch(
        start_kernel,
        count,
        [blocks, gradient],
        [solution_out, cg.residual, cg.preconditioned, cg.direction],
        device=device,
    )
    dot(cg.residual, cg.preconditioned, current)
    first = float(current.numpy()[0])
    if first <= 0.0:
        return 0
    for done in range(1, at_most + 1):
        multiply(cg.direction, cg.product)
        dot(cg.direction, cg.product, curvature)
        wp.launch(
            advance_kernel,
            count,
            [blocks, cg.scalars, cg.direction, cg.product],
            [solution_out, cg.residual, cg.preconditioned],
            device=device,
        )
        wp.copy(previous, current)
        dot(cg.residual, cg.preconditioned, current)
        if float(current.numpy()[0]) <= tolerance * tolerance * first:
            return done
        wp.launch(turn_kernel, count, [cg.scalars, cg.preconditioned], [cg.direction], device=device)
    return at_most
