"""Preconditioned conjugate gradients on vec3 unknowns (Saad 2003, algorithm 9.1), block-Jacobi preconditioner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import warp as wp

from tryon_solver.linalg.vectors import dot

wp.set_module_options({"enable_backward": False})


@dataclass
class ConjugateGradients:
    """Scratch of one solver of fixed size."""

    residual: wp.array
    preconditioned: wp.array
    direction: wp.array
    product: wp.array
    scalars: wp.array  # (6,) float32: <r, z>, the one before, <p, A p>, where <r, z> is small enough, their ratio b,
    # and the first <r, z>, <g, D^-1 g>
    left: wp.array  # (2,) int32: iterations left, 1 while there is more to do
    coupled: wp.array  # (count,) int32: scratch of pcg_alone.py

    @staticmethod
    def allocate(count: int, device: str) -> ConjugateGradients:
        def vectors() -> wp.array:
            return wp.zeros(count, dtype=wp.vec3, device=device)

        return ConjugateGradients(
            vectors(),
            vectors(),
            vectors(),
            vectors(),
            wp.zeros(6, dtype=wp.float32, device=device),
            wp.zeros(2, dtype=wp.int32, device=device),
            wp.zeros(count, dtype=wp.int32, device=device),
        )

    @property
    def first(self) -> wp.array:
        """(1,) <g, D^-1 g> of the gradient solved for last."""
        return self.scalars[5:6]


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
def begin_kernel(
    at_most: int, tolerance: float, scalars: wp.array(dtype=wp.float32), left_out: wp.array(dtype=wp.int32)
):
    scalars[1] = scalars[0]
    scalars[3] = tolerance * tolerance * scalars[0]
    scalars[5] = scalars[0]
    left_out[0] = at_most
    left_out[1] = wp.where(scalars[0] > 0.0 and at_most > 0, 1, 0)


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
        a = scalars[1] / scalars[2]
    solution[i] = solution[i] + a * direction[i]
    r = residual[i] - a * product[i]
    residual[i] = r
    preconditioned_out[i] = blocks[i] * r


@wp.kernel
def go_on_kernel(scalars: wp.array(dtype=wp.float32), left: wp.array(dtype=wp.int32)):
    """b = <r, z> / previous <r, z>; on while <r, z> is large and iterations are left."""
    scalars[4] = wp.where(scalars[1] > 0.0, scalars[0] / scalars[1], 0.0)
    scalars[1] = scalars[0]
    left[0] = left[0] - 1
    left[1] = wp.where(scalars[0] > scalars[3] and left[0] > 0, 1, 0)


@wp.kernel
def turn_kernel(
    scalars: wp.array(dtype=wp.float32), preconditioned: wp.array(dtype=wp.vec3), direction: wp.array(dtype=wp.vec3)
):
    """p = z + b p"""
    i = wp.tid()
    direction[i] = preconditioned[i] + scalars[4] * direction[i]


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
) -> None:
    """Solve A p = -gradient from zero in at most `at_most` iterations; `blocks` (n,) mat33 is D^-1.

    Stops when <r, D^-1 r> has fallen below tolerance^2 of its first value. `multiply(p, product_out)` applies A. In a
    graph the device decides when to stop, and the host reads nothing.
    """
    device, count = gradient.device, len(gradient)
    squared, curvature, more = cg.scalars[0:1], cg.scalars[2:3], cg.left[1:2]

    def iterate() -> None:
        multiply(cg.direction, cg.product)
        dot(cg.direction, cg.product, curvature)
        wp.launch(
            advance_kernel,
            count,
            [blocks, cg.scalars, cg.direction, cg.product],
            [solution_out, cg.residual, cg.preconditioned],
            device=device,
        )
        dot(cg.residual, cg.preconditioned, squared)
        wp.launch(go_on_kernel, 1, [], [cg.scalars, cg.left], device=device)
        wp.launch(turn_kernel, count, [cg.scalars, cg.preconditioned], [cg.direction], device=device)

    wp.launch(
        start_kernel,
        count,
        [blocks, gradient],
        [solution_out, cg.residual, cg.preconditioned, cg.direction],
        device=device,
    )
    dot(cg.residual, cg.preconditioned, squared)
    wp.launch(begin_kernel, 1, [at_most, tolerance], [cg.scalars, cg.left], device=device)
    wp.capture_while(more, iterate)
