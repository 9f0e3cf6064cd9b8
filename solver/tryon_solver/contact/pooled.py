"""The contact pairs' part of conjugate gradients' coarse level (linalg/aggregates.py)."""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.aggregates import add_block
from tryon_solver.linalg.blocks import MOST_THREADS
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.paired_matrix import PairedMatrix, pair_count

wp.set_module_options({"enable_backward": False})


@wp.kernel
def pool_pairs_kernel(
    m: PairedMatrix, of: wp.array(dtype=wp.int32), threads: int, sums_out: wp.array2d(dtype=wp.int64)
):
    """Pairs, each aggregate with the sum of its vertices' weights: zero, and nothing to add, where it has all four."""
    for c in range(wp.tid(), pair_count(m), threads):
        cells = wp.vec4i(-1, -1, -1, -1)  # of each vertex that is the first of its aggregate in the pair
        share = wp.vec4()
        for k in range(4):
            v = m.ids[c][k]
            if v < of.shape[0]:
                at = k
                for j in range(k):
                    if cells[j] == of[v] and at == k:
                        at = j
                if at == k:
                    cells[k] = of[v]
                share[at] = share[at] + m.lam[c][k]
        n = m.normal[c]
        block = m.curvature[c] * wp.outer(n, n) + m.beside[c]
        for k in range(4):
            for j in range(4):
                if cells[k] >= 0 and cells[j] >= 0 and share[k] * share[j] != 0.0:
                    add_block(sums_out, cells[k], cells[j], share[k] * share[j] * block)


def add_pairs(matrix: PairedMatrix, of: wp.array, sums_out: wp.array) -> None:
    """Add what a matrix has of pairs to its sums over the aggregates `of` (N,) that its vertices are in."""
    threads = min(len(matrix.ids), MOST_THREADS)
    launch(pool_pairs_kernel, threads, [matrix, of, threads], [sums_out], device=of.device)
