"""Preconditioned conjugate gradients (Saad 2003, algorithm 9.1) on a PairedMatrix: block-Jacobi and a coarse level.

Unknowns that nothing couples to others, most of a body's, are solved for at once and left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from tryon_solver.linalg import pcg_alone, pcg_together
from tryon_solver.linalg.aggregates import Aggregates
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.paired_matrix import PairedMatrix
from tryon_solver.linalg.pcg_together import RING, SUMS, TAKEN
from tryon_solver.linalg.vectors import PARTS, dot

wp.set_module_options({"enable_backward": False})


@dataclass
class ConjugateGradients:
    """Scratch of one solver of fixed size."""

    residual: wp.array
    preconditioned: wp.array
    direction: wp.array
    both: wp.array  # (2 count,) vec4, as in pcg_together.py; and so
    spread: wp.array  # float32, as in pcg_together.py
    product: wp.array
    pulled: wp.array  # vec4, what pairs add to the product, as in pcg_together.py; or so:
    pulled_whole: wp.array  # int64
    sums: wp.array  # int64, as in pcg_together.py
    parts: wp.array  # float32, as in pcg_together.py
    coupled: wp.array  # (count,) int32
    squares: wp.array  # float32, as in pcg_together.py
    first: wp.array  # (1,) float32, <g, D^-1 g> of the gradient solved for last
    state: wp.array  # (3,) int32, as in pcg_together.py
    direction_four: wp.array  # (count,) vec4, as in pcg_alone.py, in one half of `both`
    product_four: wp.array  # the same, in the other
    single: wp.array  # (1,) vec3, in the beginning of `preconditioned`, which is free between solves

    @staticmethod
    def allocate(count: int, rows: int, width: int, device: str, repeatable: bool) -> ConjugateGradients:
        """For `count` unknowns, of which the first `rows` have rows of `width` blocks in the matrix. On a GPU what they
        find repeats bit for bit if they are `repeatable`; on a processor it always does."""
        pulled = pcg_together.pulled_of(count, rows)

        def vectors() -> wp.array:
            return wp.zeros(count, dtype=wp.vec3, device=device)

        preconditioned, both = vectors(), wp.zeros(2 * count, dtype=wp.vec4, device=device)
        return ConjugateGradients(
            vectors(),
            preconditioned,
            vectors(),
            both,
            wp.zeros(9 * rows * (width - 1), dtype=wp.float32, device=device),
            vectors(),
            wp.zeros(0 if repeatable else pulled, dtype=wp.vec4, device=device),
            wp.zeros(3 * pulled if repeatable else 0, dtype=wp.int64, device=device),
            wp.zeros(int(SUMS), dtype=wp.int64, device=device),
            wp.zeros(max(pcg_together.parts_of(count), PARTS), dtype=wp.float32, device=device),
            wp.zeros(count, dtype=wp.int32, device=device),
            wp.zeros(int(RING), dtype=wp.float32, device=device),
            wp.zeros(1, dtype=wp.float32, device=device),
            wp.zeros(3, dtype=wp.int32, device=device),
            both[:count],
            both[count:],
            preconditioned[:1],
        )

    def taken(self) -> int:
        """How many iterations the last solve took. Waits for the device."""
        return int(self.state.numpy()[TAKEN])


@wp.kernel
def precondition_kernel(
    blocks: wp.array(dtype=wp.mat33), gradient: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.vec3)
):
    """out = D^-1 g"""
    i = wp.tid()
    out[i] = blocks[i] * gradient[i]


def preconditioned_norm_sq(cg: ConjugateGradients, blocks: wp.array, gradient: wp.array, out: wp.array) -> None:
    """out[0] = <g, D^-1 g> with `blocks` the inverse diagonal blocks D^-1."""
    launch(precondition_kernel, len(gradient), [blocks, gradient], [cg.preconditioned], device=gradient.device)
    dot(gradient, cg.preconditioned, out, cg.parts)


def solve(
    cg: ConjugateGradients,
    matrix: PairedMatrix,
    blocks: wp.array,
    gradient: wp.array,
    solution_out: wp.array,
    at_most: int,
    tolerance: float,
    aggregates: Aggregates,
) -> None:
    """Solve A p = -gradient from zero in at most `at_most` iterations; `blocks` (A,) mat33 is D^-1, and `aggregates`
    are the level beside it, of whichever matrix they took last.

    Stops when <r, z> of the preconditioned residual z has fallen below tolerance^2 of the first <r, D^-1 r>. The device
    decides when to stop, and the host reads nothing where the launches are recorded for a graph.
    """
    if wp.get_device(gradient.device).is_cpu:
        launch(
            pcg_alone.solve_kernel,
            1,
            [matrix, blocks, gradient, at_most, tolerance, aggregates.of, aggregates.factor],
            [
                aggregates.moves,
                cg.coupled,
                solution_out,
                cg.residual,
                cg.preconditioned,
                cg.direction_four,
                cg.product_four,
                cg.first,
                cg.state,
            ],
            device=gradient.device,
        )
        return
    pcg_together.solve(
        matrix,
        blocks,
        aggregates,
        gradient,
        solution_out,
        cg.residual,
        cg.direction,
        cg.both,
        cg.spread,
        cg.product,
        cg.pulled,
        cg.pulled_whole,
        cg.coupled,
        cg.sums,
        cg.parts,
        cg.first,
        cg.squares,
        cg.state,
        at_most,
        tolerance,
    )
