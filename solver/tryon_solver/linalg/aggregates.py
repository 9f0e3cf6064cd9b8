"""A coarse level for conjugate gradients: neighbouring vertices that move as one.

Block by block a preconditioner sees a vertex and what holds it. What a whole sleeve has to do beside its body it learns
from neighbour to neighbour, an edge in each iteration: after 30 of them a Newton direction of 10,000 vertices is wrong
by three quarters. So vertices are pooled into aggregates of some tens, a cell of the pattern each; the matrix summed
over them, scalar, a third of its blocks' traces, S; and

    z = D^-1 r + P S^-1 P^T r,

P one for each vertex and its aggregate. After 10 iterations half is left, after 30 a fifth (METHOD.md section 7).
Contacts are in S like all else. It need not be of the matrix that is solved for: it is made once in a step, of where it
begins. Additive coarse levels and aggregates: Saad 2003, chapters 13 and 14; for cloth on GPUs Wu, Wang, Wang 2022.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import warp as wp

from tryon_solver.linalg.block_inverse import PIVOT, BlockInverse
from tryon_solver.linalg.blocks import MOST_THREADS
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.paired_matrix import PairedMatrix, pair_count

wp.set_module_options({"enable_backward": False})

EDGES = 8.0  # across an aggregate, at least
MOST = 512  # aggregates, about: what is inverted and multiplied with is a full matrix
RING = wp.constant(4)  # residuals in a ring, as in pcg_together.py


def aggregate_spacing(vertices: int) -> float:
    """How many mean edges an aggregate of a mesh of so many vertices is across."""
    return max(EDGES, math.sqrt(vertices / MOST))


@wp.kernel
def pool_rows_kernel(m: PairedMatrix, of: wp.array(dtype=wp.int32), sum_out: wp.array2d(dtype=wp.float32)):
    """What a row has for vertices of other aggregates, and of its own the rest, since its blocks sum to zero."""
    i = wp.tid()
    own = of[i]
    rest = m.diagonal[i]
    for k in range(1, m.columns.shape[1]):
        j = m.columns[i, k]
        if j == i:
            break  # the rest of the row is padding
        if of[j] != own:
            share = wp.trace(m.blocks[i, k]) / 3.0
            wp.atomic_add(sum_out, own, of[j], share)
            rest -= share
    for k in range(m.far_columns.shape[1]):
        j = m.far_columns[i, k]
        if j == i:
            break
        if of[j] != own:
            wp.atomic_add(sum_out, own, of[j], m.weights[i, k])
            rest -= m.weights[i, k]
    wp.atomic_add(sum_out, own, own, rest)


@wp.kernel
def pool_pairs_kernel(
    m: PairedMatrix, of: wp.array(dtype=wp.int32), threads: int, sum_out: wp.array2d(dtype=wp.float32)
):
    for c in range(wp.tid(), pair_count(m), threads):
        v = m.ids[c]
        w = m.lam[c]
        share = (m.curvature[c] + wp.trace(m.beside[c])) / 3.0
        for k in range(4):
            for j in range(4):
                if v[k] < of.shape[0] and v[j] < of.shape[0] and w[k] * w[j] != 0.0:
                    wp.atomic_add(sum_out, of[v[k]], of[v[j]], w[k] * w[j] * share)


@dataclass
class Aggregates:
    """`of` (N,) int32, the aggregate of each vertex; `members` (N,) int32, the vertices of the first, then of the next,
    and `starts` (M + 1,) int32, where; `matrix` (M', M') float32 N/m, M' the next multiple of PIVOT, and what inverts
    it; `inverse` (M', M') float32 m/N, zero at first, which adds nothing to the preconditioner. `pooled` (RING M,) vec4
    N and `moves` (M,) vec3 m are scratch."""

    of: wp.array
    members: wp.array
    starts: wp.array
    matrix: wp.array
    inverting: BlockInverse
    inverse: wp.array
    pooled: wp.array
    moves: wp.array

    @staticmethod
    def build(basis: sp.csr_matrix, device: str) -> Aggregates:
        """The vertices that one of `basis` (N, anything) has most of, each time."""
        of = np.unique(np.asarray(basis.argmax(axis=1)).ravel(), return_inverse=True)[1].astype(np.int32)
        count = int(of.max()) + 1
        room = -(-count // PIVOT) * PIVOT
        starts = np.concatenate([[0], np.cumsum(np.bincount(of))]).astype(np.int32)
        inverting = BlockInverse.allocate(room, device)
        return Aggregates(
            wp.array(of, dtype=wp.int32, device=device),
            wp.array(np.argsort(of, kind="stable").astype(np.int32), dtype=wp.int32, device=device),
            wp.array(starts, dtype=wp.int32, device=device),
            wp.zeros((room, room), dtype=wp.float32, device=device),
            inverting,
            inverting.inverse,
            wp.zeros(int(RING) * count, dtype=wp.vec4, device=device),
            wp.zeros(count, dtype=wp.vec3, device=device),
        )

    @property
    def count(self) -> int:
        """M, how many there are."""
        return len(self.starts) - 1

    def take(self, matrix: PairedMatrix) -> None:
        """Let the preconditioner be of this matrix, on the device."""
        device = self.of.device
        self.matrix.zero_()
        launch(pool_rows_kernel, len(self.of), [matrix, self.of], [self.matrix], device=device)
        threads = min(len(matrix.ids), MOST_THREADS)
        launch(pool_pairs_kernel, threads, [matrix, self.of, threads], [self.matrix], device=device)
        self.inverting.invert(self.matrix, self.count)
