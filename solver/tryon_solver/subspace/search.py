"""Reduced L-BFGS: quasi-Newton directions in the subspace, prefactorised first Hessian.

Two-loop recursion (Nocedal and Wright 2006, algorithm 7.4) over reduced vectors (basis_count x 3). The first inverse
Hessian is the explicit inverse of the reduced rest matrix (Li et al. 2023); contact enters through the
pairs. Within a time step the quadratic model is frozen, so the pairs are kept for the whole step and forgotten at its
end. One block of threads does a whole recursion: each thread owns a stride of the vector and only sums are shared.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.linalg.ell import EllMatrix, multiply_wide
from tryon_solver.linalg.launch import launch_blocks

wp.set_module_options({"enable_backward": False})

BLOCK = 128  # threads to ROWS rows of the inverse
ROWS = wp.constant(4)
ALONE = 512  # threads of what a single block does
Totals = wp.types.vector(length=12, dtype=wp.float32)  # of ROWS rows, three each
SMALLEST_CURVATURE = 1.0e-30  # <s, y> [J] below which a pair is rounding, and far below which its inverse overflows


@dataclass
class ReducedSearch:
    """The subspace of one garment and its search history.

    `prolong` (N x M) and `restrict` (M x N) ELL rows; `inverse` (M, M) float32 [m/N]; history of `memory` pairs.
    """

    prolong: EllMatrix
    restrict: EllMatrix
    inverse: wp.array
    steps: wp.array  # (memory, M) vec3, s_k [m]
    changes: wp.array  # (memory, M) vec3, y_k [N]
    rho: wp.array  # (memory,) 1/<s_k, y_k>
    scratch: wp.array  # (memory,) the recursion's alphas
    reduced_gradient: wp.array
    half: wp.array
    direction: wp.array
    memory: int
    stored: int = 0

    @property
    def size(self) -> int:
        """Number of bases M."""
        return self.restrict.row_count

    @staticmethod
    def build(basis: object, inverse: np.ndarray, memory: int, device: str) -> ReducedSearch:
        """`basis` scipy (N, M), rows sum to one; `inverse` (M, M) of B^T H B."""
        matrix = basis
        size = inverse.shape[0]

        def vectors(*shape: int) -> wp.array:
            return wp.zeros(shape, dtype=wp.vec3, device=device)

        return ReducedSearch(
            EllMatrix.from_scipy(matrix, device),
            EllMatrix.from_scipy(matrix.T, device),  # type: ignore[attr-defined]
            wp.array(inverse, dtype=wp.float32, device=device),
            vectors(memory, size),
            vectors(memory, size),
            wp.zeros(memory, dtype=wp.float32, device=device),
            wp.zeros(memory, dtype=wp.float32, device=device),
            vectors(size),
            vectors(size),
            vectors(size),
            memory,
        )


@wp.kernel
def first_loop_kernel(
    gradient: wp.array(dtype=wp.vec3),
    steps: wp.array2d(dtype=wp.vec3),
    changes: wp.array2d(dtype=wp.vec3),
    rho: wp.array(dtype=wp.float32),
    stored: int,
    newest: int,
    scratch_out: wp.array(dtype=wp.float32),
    q_out: wp.array(dtype=wp.vec3),
):
    """q = g, then newest to oldest: alpha_k = rho_k <s_k, q>, q -= alpha_k y_k."""
    _block, thread = wp.tid()
    size = gradient.shape[0]
    memory = steps.shape[0]
    stride = wp.block_dim()
    i = int(thread)
    while i < size:
        q_out[i] = gradient[i]
        i += stride
    for age in range(stored):
        k = (newest - age + memory) % memory
        partial = float(0.0)
        i = thread
        while i < size:
            partial += wp.dot(steps[k, i], q_out[i])
            i += stride
        total = wp.tile_sum(wp.tile(partial))
        alpha = rho[k] * total[0]
        if thread == 0:
            scratch_out[k] = alpha
        i = thread
        while i < size:
            q_out[i] = q_out[i] - alpha * changes[k, i]
            i += stride


@wp.kernel
def apply_inverse_kernel(
    inverse: wp.array2d(dtype=wp.float32), q: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.vec3)
):
    """out = Hhat^-1 q, ROWS of it by a block of threads: what is as large as a GPU's cache comes no faster than many
    reads are under way at once, and q is read once for all of them."""
    block, thread = wp.tid()
    size = q.shape[0]
    stride = wp.block_dim()
    total = Totals()
    k = int(thread)
    while k < size:
        here = q[k]
        for n in range(ROWS):
            weight = inverse[wp.min(ROWS * block + n, size - 1), k]
            for axis in range(3):
                total[3 * n + axis] = total[3 * n + axis] + weight * here[axis]
        k += stride
    of_rows = wp.tile_sum(wp.tile(total, preserve_type=True))[0]
    if thread == 0:
        for n in range(ROWS):
            if ROWS * block + n < size:
                out[ROWS * block + n] = wp.vec3(of_rows[3 * n], of_rows[3 * n + 1], of_rows[3 * n + 2])


@wp.kernel
def second_loop_kernel(
    steps: wp.array2d(dtype=wp.vec3),
    changes: wp.array2d(dtype=wp.vec3),
    rho: wp.array(dtype=wp.float32),
    scratch: wp.array(dtype=wp.float32),
    stored: int,
    newest: int,
    r_out: wp.array(dtype=wp.vec3),
):
    """Oldest to newest: beta = rho_k <y_k, r>, r += (alpha_k - beta) s_k; then r = -r, the direction."""
    _block, thread = wp.tid()
    size = r_out.shape[0]
    memory = steps.shape[0]
    stride = wp.block_dim()
    i = int(thread)
    for young in range(stored):
        k = (newest - (stored - 1 - young) + memory) % memory
        partial = float(0.0)
        i = thread
        while i < size:
            partial += wp.dot(changes[k, i], r_out[i])
            i += stride
        total = wp.tile_sum(wp.tile(partial))
        weight = scratch[k] - rho[k] * total[0]
        i = thread
        while i < size:
            r_out[i] = r_out[i] + weight * steps[k, i]
            i += stride
    i = thread
    while i < size:
        r_out[i] = -r_out[i]
        i += stride


@wp.kernel
def remember_kernel(
    length: wp.array(dtype=wp.float32),
    direction: wp.array(dtype=wp.vec3),
    product: wp.array(dtype=wp.vec3),
    slot: int,
    steps_out: wp.array2d(dtype=wp.vec3),
    changes_out: wp.array2d(dtype=wp.vec3),
    rho_out: wp.array(dtype=wp.float32),
):
    """s = a p, y = a B^T A B p, rho = 1/<s, y>; a pair with too little curvature has rho zero and no effect."""
    _block, thread = wp.tid()
    size = direction.shape[0]
    stride = wp.block_dim()
    a = length[0]
    partial = float(0.0)
    i = int(thread)
    while i < size:
        s = a * direction[i]
        y = a * product[i]
        steps_out[slot, i] = s
        changes_out[slot, i] = y
        partial += wp.dot(s, y)
        i += stride
    total = wp.tile_sum(wp.tile(partial))
    if thread == 0:
        curvature = total[0]
        if curvature > SMALLEST_CURVATURE:
            rho_out[slot] = 1.0 / curvature
        else:
            rho_out[slot] = 0.0


def search_direction(search: ReducedSearch, gradient: wp.array) -> wp.array:
    """Reduced descent direction (M,) vec3 [m] for the full gradient (N,) [N]; leaves it in `search.direction`."""
    device = search.direction.device
    multiply_wide(search.restrict, gradient, search.reduced_gradient)
    newest = (search.stored - 1) % search.memory
    kept = min(search.stored, search.memory)
    launch_blocks(
        first_loop_kernel,
        1,
        [search.reduced_gradient, search.steps, search.changes, search.rho, kept, newest],
        [search.scratch, search.half],
        block_dim=ALONE,
        device=device,
    )
    launch_blocks(
        apply_inverse_kernel,
        -(-search.size // int(ROWS)),
        [search.inverse, search.half],
        [search.direction],
        block_dim=BLOCK,
        device=device,
    )
    launch_blocks(
        second_loop_kernel,
        1,
        [search.steps, search.changes, search.rho, search.scratch, kept, newest],
        [search.direction],
        block_dim=ALONE,
        device=device,
    )
    return search.direction


def remember(search: ReducedSearch, length: wp.array, product: wp.array) -> None:
    """Store the pair of the last direction: it was taken `length[0]` times, `product` (N,) is A B p."""
    device = search.direction.device
    multiply_wide(search.restrict, product, search.half)
    launch_blocks(
        remember_kernel,
        1,
        [length, search.direction, search.half, search.stored % search.memory],
        [search.steps, search.changes, search.rho],
        block_dim=ALONE,
        device=device,
    )
    search.stored += 1


def forget(search: ReducedSearch) -> None:
    """Drop all pairs: the quadratic model is about to change."""
    search.stored = 0
