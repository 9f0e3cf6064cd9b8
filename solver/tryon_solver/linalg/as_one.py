"""The total force that conjugate gradients leave behind when they are cut short, met by moving all of the cloth as one.

Inner forces have no total, so whatever total is left is momentum that comes from nowhere: a budget of a few iterations
stopped a tube in mid-air. So the solution p of A p = -g gets the best of all uniform moves c of the cloth,

    (U^T A U) c = U^T r,   r = -g - A p,   U the N identities one above the other:

a coarse level of three unknowns, solved exactly, in float64. U^T A U is the sum of what is on the diagonal and of each
pair's 3x3 block by the square of its weights' sum over the cloth. Where inertia alone resists, no total is left; on a
floor none along it, however stiff contact is across. One step along r's total, as long as is best, left cloth that
slides down a slope what it had across the slope for its length, and stopped it.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.one_block import launch_one_block, sum_up
from tryon_solver.linalg.paired_matrix import PairedMatrix, pair_count
from tryon_solver.linalg.pcg import ConjugateGradients

wp.set_module_options({"enable_backward": False})

QUANTA = wp.constant(wp.float64(2.0**20))  # in 1 N/m: quanta of 1e-6, and exact sums up to 8.6e9


@wp.kernel
def add_diagonal_kernel(
    diagonal: wp.array(dtype=wp.float32), moving: int, threads: int, coarse_out: wp.array(dtype=wp.mat33d)
):
    """coarse_out[0] += the sum of the first `moving`, times the identity"""
    total = wp.float64(0.0)
    for i in range(wp.tid(), moving, threads):
        total += wp.float64(diagonal[i])
    whole = wp.tile_sum(wp.tile(total))[0]
    if wp.tid() == 0:
        coarse_out[0] = coarse_out[0] + whole * wp.identity(n=3, dtype=wp.float64)


@wp.func
def in_quanta(values: wp.mat33d) -> wp.mat33d:
    """Rounded to whole quanta."""
    rounded = wp.mat33d()
    for n in range(3):
        for k in range(3):
            rounded[n, k] = wp.rint(values[n, k] * QUANTA) / QUANTA
    return rounded


@wp.kernel
def add_pairs_kernel(m: PairedMatrix, moving: int, threads: int, coarse_out: wp.array(dtype=wp.mat33d)):
    """coarse_out[0] += s^2 (curvature n n^T + beside) of each pair, s the sum of its weights over the first `moving`

    On a GPU pairs are listed in any order, and are rounded so that float64 adds them exactly."""
    total = wp.mat33d()
    for c in range(wp.tid(), pair_count(m), threads):
        s = float(0.0)
        for k in range(4):
            if m.ids[c][k] < moving:
                s += m.lam[c][k]
        n = wp.vec3d(m.normal[c])
        beside = wp.mat33d(m.beside[c])
        own = wp.float64(s) * wp.float64(s) * (wp.float64(m.curvature[c]) * wp.outer(n, n) + beside)
        if threads > 1:
            own = in_quanta(own)
        total += own
    whole = wp.tile_sum(wp.tile(total, preserve_type=True))[0]
    if wp.tid() == 0:
        coarse_out[0] = coarse_out[0] + whole


@wp.kernel
def add_move_kernel(
    total: wp.array(dtype=wp.vec3), coarse: wp.array(dtype=wp.mat33d), solution: wp.array(dtype=wp.vec3)
):
    """solution += (U^T A U)^-1 U^T r"""
    i = wp.tid()
    solution[i] = solution[i] + wp.vec3(wp.inverse(coarse[0]) * wp.vec3d(total[0]))


def move_as_one(
    cg: ConjugateGradients, matrix: PairedMatrix, diagonal: wp.array, moving: int, coarse: wp.array, solution: wp.array
) -> None:
    """Improve what `pcg.solve` just found of `matrix` by the best uniform move of the first `moving` unknowns.

    Rows of the matrix sum to zero, so of it there are only the pairs and the `diagonal` (A,) float32 N/m, here without
    what holds single vertices. `coarse` (1,) mat33d is scratch. The residual that `cg` keeps is not renewed.
    """
    device, total = solution.device, cg.single
    sum_up(cg.residual, moving, total)
    coarse.zero_()
    launch_one_block(add_diagonal_kernel, [diagonal, moving], [coarse], device)
    launch_one_block(add_pairs_kernel, [matrix, moving], [coarse], device)
    launch(add_move_kernel, moving, [total, coarse], [solution], device=device)
