"""A coarse level for conjugate gradients: neighbouring vertices that move as one.

Block by block a preconditioner sees a vertex and what holds it. What a whole sleeve has to do beside its body it learns
from neighbour to neighbour, an edge in each iteration. So vertices are pooled into aggregates, a cell of the pattern
each; the matrix's 3 x 3 blocks are summed over them, contacts and held vertices with the rest, to S; and

    z = D^-1 r + P S^-1 P^T r,

P one for each vertex and its aggregate. S is made anew of every matrix that is solved for: what contact has become
stiff since would be left out. Additive coarse levels and aggregates: Saad 2003, chapters 13 and 14; for cloth on GPUs
Wu, Wang and Wang 2022. METHOD.md section 7 has the figures.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import warp as wp

from tryon_solver.linalg.blocks import BLOCK
from tryon_solver.linalg.cholesky import factor
from tryon_solver.linalg.gauss_jordan import PIVOT, GaussJordan
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import STIFF_QUANTA, whole_of
from tryon_solver.linalg.paired_matrix import PairedMatrix

wp.set_module_options({"enable_backward": False})

EDGES = 8.0  # across an aggregate, at least
MOST = 100  # aggregates, about: their matrix is a full one, of three unknowns each
NOBODY = wp.constant(-1)  # in a seat that is left free

AddPairs = Callable[[PairedMatrix, wp.array, wp.array], None]  # matrix, of (N,), sums_out


def aggregate_edges(vertices: int) -> float:
    """How many mean edges an aggregate of a mesh of so many vertices is across: of cells of a regular grid that a
    pattern lies in, one holds about half the vertices of a square so wide, many being cut off by the pattern's edge."""
    return max(EDGES, math.sqrt(2.0 * vertices / MOST))


@wp.func
def add_block(sums: wp.array2d(dtype=wp.int64), a: int, b: int, block: wp.mat33):
    """Of the symmetric sum the part on and above the diagonal's blocks, in whole numbers (order_free.py)."""
    if a <= b:
        for n in range(3):
            for k in range(3):
                wp.atomic_add(sums, 3 * a + n, 3 * b + k, whole_of(block[n, k], STIFF_QUANTA))


@wp.kernel
def pool_rows_kernel(m: PairedMatrix, of: wp.array(dtype=wp.int32), sums_out: wp.array2d(dtype=wp.int64)):
    """What a row has for vertices of other aggregates, and of its own the rest, since its blocks sum to zero."""
    i = wp.tid()
    own = of[i]
    rest = wp.outer(m.held[i], m.held[i]) + m.diagonal[i] * wp.identity(n=3, dtype=wp.float32)
    for k in range(1, m.columns.shape[1]):
        j = m.columns[i, k]
        if j == i:
            break  # the rest of the row is padding
        if of[j] != own:
            add_block(sums_out, own, of[j], m.blocks[i, k])
            rest -= m.blocks[i, k]
    for k in range(m.far_columns.shape[1]):
        j = m.far_columns[i, k]
        if j == i:
            break
        if of[j] != own:
            far = m.weights[i, k] * wp.identity(n=3, dtype=wp.float32)
            add_block(sums_out, own, of[j], far)
            rest -= far
    add_block(sums_out, own, own, rest)


def seated(of: np.ndarray, block: int) -> tuple[np.ndarray, np.ndarray]:
    """`seats` and `starts` of Aggregates, (all seats,) and (M + 1,) int32, with blocks of so many threads."""
    members = np.bincount(of)
    blocks = -(-members // block)
    starts = np.concatenate([[0], np.cumsum(blocks)])
    order = np.argsort(of, kind="stable")
    rank = np.arange(len(of)) - np.repeat(np.cumsum(members) - members, members)
    seats = np.full(starts[-1] * block, int(NOBODY))
    seats[block * starts[of[order]] + rank] = order
    return seats.astype(np.int32), starts.astype(np.int32)


def most_of_each_row(matrix: sp.csr_matrix) -> np.ndarray:
    """(N,) the column of each row's largest entry, of equal ones the first, and 0 of an empty row; no entry is below 0.

    scipy's own `argmax` goes through the rows one by one, in Python.
    """
    matrix.sum_duplicates()  # and so the columns of a row ascend
    lengths = np.diff(matrix.indptr)
    row = np.repeat(np.arange(len(lengths)), lengths)
    largest = np.zeros(len(lengths))
    filled = lengths > 0
    largest[filled] = np.maximum.reduceat(matrix.data, matrix.indptr[:-1][filled])
    at = np.flatnonzero(matrix.data == largest[row])[::-1]  # of those that are written to one place the last one stays
    column = np.zeros(len(lengths), np.int64)
    column[row[at]] = matrix.indices[at]
    return column


@dataclass
class Aggregates:
    """`of` (N,) int32, the aggregate of each vertex; `seats` int32, the vertices of the first, then of the next, with
    free seats before the next, so that no block of threads has vertices of two, and `starts` (M + 1,) int32, in which
    block each begins; `sums` (3 M', 3 M') int64, the matrix summed over them in quanta of order_free.py, on and above
    the diagonal's blocks, 3 M' = 3 M on a processor and the next multiple of PIVOT on a GPU. A processor has its
    `factor` (3 M, 3 M) float64 as of cholesky.py, a GPU its `inverse` (3 M', 3 M') float32 m/N and what makes it; both
    are zero at first, which adds nothing to the preconditioner. `pooled` vec3 N, one a block, `common`
    (M + 1,) vec4 m, on a GPU the moves and a zero for who is of none, and `moves` (3 M,) float64 m are scratch."""

    of: wp.array
    seats: wp.array
    starts: wp.array
    sums: wp.array
    factor: wp.array
    inverting: GaussJordan
    pooled: wp.array
    common: wp.array
    moves: wp.array

    @staticmethod
    def build(basis: sp.csr_matrix, device: str) -> Aggregates:
        """The vertices that one of `basis` (N, anything) has most of, each time."""
        of = np.unique(most_of_each_row(basis), return_inverse=True)[1].astype(np.int32)
        size = 3 * (int(of.max()) + 1)
        on_gpu = wp.get_device(device).is_cuda
        room = -(-size // PIVOT) * PIVOT if on_gpu else size
        seats, starts = seated(of, BLOCK if on_gpu else 1)
        own = 0 if on_gpu else size
        return Aggregates(
            wp.array(of, dtype=wp.int32, device=device),
            wp.array(seats, dtype=wp.int32, device=device),
            wp.array(starts, dtype=wp.int32, device=device),
            wp.zeros((room, room), dtype=wp.int64, device=device),
            wp.zeros((own, own), dtype=wp.float64, device=device),
            GaussJordan.allocate(room if on_gpu else 0, device),
            wp.zeros(int(starts[-1]), dtype=wp.vec3, device=device),
            wp.zeros(size // 3 + 1, dtype=wp.vec4, device=device),
            wp.zeros(size, dtype=wp.float64, device=device),
        )

    @property
    def count(self) -> int:
        """M, how many there are."""
        return len(self.starts) - 1

    @property
    def inverse(self) -> wp.array:
        """On a GPU: of the matrix that was taken last."""
        return self.inverting.inverse

    def take(self, matrix: PairedMatrix, add_pairs: AddPairs | None) -> None:
        """Let the preconditioner be of this matrix, on the device; where it may have pairs, `add_pairs` sums them."""
        device = self.of.device
        self.sums.zero_()
        launch(pool_rows_kernel, len(self.of), [matrix, self.of], [self.sums], device=device)
        if add_pairs is not None:
            add_pairs(matrix, self.of, self.sums)
        if wp.get_device(device).is_cuda:
            self.inverting.invert(self.sums, 3 * self.count)
        else:
            factor(self.sums, self.factor)
