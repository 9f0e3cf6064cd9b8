"""The Newton matrix of the correction: elastic Hessian at the point, made positive semidefinite, and contact.

Projective dynamics' constant matrix bounds the elastic Hessian from above, by far where triangles are compressed or
turned and where the strain limit is silent: with it the correction's iterations gain under one per cent each. With the
Hessian itself they converge in a handful (METHOD.md section 7 has the figures).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.contact import pooled
from tryon_solver.linalg import block_ell, pcg
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.paired_matrix import PairedMatrix
from tryon_solver.stepping.gradient import add_contact_blocks, invert_blocks_kernel

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})


def linearise(sim: Simulation) -> None:
    """Sum the Hessian at x, with what vertices are held by, and invert its diagonal blocks."""
    rows, work = sim.hessian_rows, sim.work
    sim.triangle_hessian.hessians.zero_()
    for add_triangle_hessian in sim.stages.add_triangle_hessian:
        add_triangle_hessian(sim.state.x, sim.triangle_hessian.hessians)
    sim.triangle_hessian.sum_up(sim.matrices.near_far.near, rows)
    for add_hessian in sim.stages.add_hessian:
        add_hessian(sim.state.x, rows)
    launch(
        block_ell.diagonal_blocks_kernel,
        sim.all_count,
        [rows.blocks, work.diagonal],
        [work.blocks],
        device=sim.device,
    )
    add_contact_blocks(sim, work.blocks)
    if not sim.candidates.idle:
        sim.holding.add(work.blocks)
    launch(invert_blocks_kernel, sim.all_count, [], [work.blocks], device=sim.device)


def newton_matrix(sim: Simulation) -> PairedMatrix:
    """Hessian + contact + what vertices are held by, over cloth and collision surface [N/m], as it stands."""
    rows, far, pairs = sim.hessian_rows, sim.matrices.near_far.far, sim.pairs
    matrix = PairedMatrix()
    matrix.columns, matrix.blocks = rows.columns, rows.blocks
    matrix.far_columns, matrix.weights = far.columns, far.weights
    matrix.diagonal, matrix.held = sim.work.diagonal, sim.work.held
    matrix.count, matrix.ids, matrix.lam = pairs.counters, pairs.ids, pairs.lam
    matrix.normal, matrix.curvature, matrix.beside = pairs.normal, pairs.curvature, pairs.beside
    return matrix


def solve_newton_system(sim: Simulation, at_most: int, anew: bool = True) -> None:
    """`direction` by conjugate gradients from the matrix and the gradient at x as looked around, and from what dyads
    the Hessian has beside the matrix; `cg` keeps what is left. The preconditioner's coarse level is that of this
    matrix, or, if not `anew`, of the one that was solved with before."""
    work, matrix = sim.work, newton_matrix(sim)
    until = at_most, sim.settings.correction_pcg_tolerance
    if anew:
        sim.aggregates.take(matrix, pooled.add_pairs if sim.pairs.size else None)

    def solve(gradient: wp.array, solution_out: wp.array) -> None:
        pcg.solve(sim.cg, matrix, work.blocks, gradient, solution_out, *until, sim.aggregates)

    for dyad in sim.stages.dyads:
        dyad.respond(solve, sim.cg.residual)
    solve(work.gradient, work.direction)
    for dyad in sim.stages.dyads:
        dyad.amend(work.direction, sim.cg.residual)
