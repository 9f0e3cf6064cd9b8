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

from tryon_solver.linalg.blocks import BLOCK, whole_blocks
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.paired_matrix import PairedMatrix, pair_count
from tryon_solver.linalg.pcg import ConjugateGradients

wp.set_module_options({"enable_backward": False})

ADDING = 1024  # threads on a GPU, each of which adds its share to one sum: they wait for each other there


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
def add_diagonal_kernel(
    diagonal: wp.array(dtype=wp.float32), moving: int, threads: int, coarse_out: wp.array(dtype=wp.mat33d)
):
    """coarse_out[0] += the sum of the first `moving`, times the identity"""
    total = wp.float64(0.0)
    for i in range(wp.tid(), moving, threads):
        total += wp.float64(diagonal[i])
    wp.atomic_add(coarse_out, 0, total * wp.identity(n=3, dtype=wp.float64))


@wp.kernel
def add_pairs_kernel(m: PairedMatrix, moving: int, threads: int, coarse_out: wp.array(dtype=wp.mat33d)):
    """coarse_out[0] += s^2 (curvature n n^T + beside) of each pair, s the sum of its weights over the first `moving`"""
    total = wp.mat33d()
    for c in range(wp.tid(), pair_count(m), threads):
        s = float(0.0)
        for k in range(4):
            if m.ids[c][k] < moving:
                s += m.lam[c][k]
        n = wp.vec3d(m.normal[c])
        beside = wp.mat33d(m.beside[c])
        total += wp.float64(s) * wp.float64(s) * (wp.float64(m.curvature[c]) * wp.outer(n, n) + beside)
    wp.atomic_add(coarse_out, 0, total)


@wp.kernel
def add_move_kernel(
    total: wp.array(dtype=wp.vec3), coarse: wp.array(dtype=wp.mat33d), solution: wp.array(dtype=wp.vec3)
):
    """solution += (U^T A U)^-1 U^T r"""
    i = wp.tid()
    solution[i] = solution[i] + wp.vec3(wp.inverse(coarse[0]) * wp.vec3d(total[0]))


def sum_up(vectors: wp.array, moving: int, total_out: wp.array) -> None:
    """total_out (1,) = the sum of the first `moving`"""
    total_out.zero_()
    threads = whole_blocks(moving)
    launch(total_kernel, threads, [vectors, moving, threads], [total_out], block_dim=BLOCK, device=vectors.device)


def move_as_one(
    cg: ConjugateGradients, matrix: PairedMatrix, diagonal: wp.array, moving: int, coarse: wp.array, solution: wp.array
) -> None:
    """Improve what `pcg.solve` just found of `matrix` by the best uniform move of the first `moving` unknowns.

    Rows of the matrix sum to zero, so of it there are only the pairs and the `diagonal` (A,) float32 N/m, here without
    what holds single vertices. `coarse` (1,) mat33d is scratch. The residual that `cg` keeps is not renewed.
    """
    device, total = solution.device, cg.preconditioned[0:1]
    sum_up(cg.residual, moving, total)
    coarse.zero_()
    threads = 1 if wp.get_device(device).is_cpu else ADDING
    launch(add_diagonal_kernel, threads, [diagonal, moving, threads], [coarse], device=device)
    launch(add_pairs_kernel, threads, [matrix, moving, threads], [coarse], device=device)
    launch(add_move_kernel, moving, [total, coarse], [solution], device=device)
