"""A constant scalar matrix split by the pattern of a mesh's blocks: what falls on them is added to them, once a Newton
iteration instead of once a product; for bending that is half of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import warp as wp

from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.linalg.ell import EllMatrix

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class NearFar:
    """A matrix (N, N) [N/m] whose rows sum to zero. `near` (N, width) float32 over the places of BlockRows, the
    diagonal first; `far` what has no place there, none of it on the diagonal."""

    near: wp.array
    far: EllMatrix

    def like(self) -> NearFar:
        """A matrix of zeros with the same places."""
        return NearFar(wp.zeros_like(self.near), self.far.like())

    def set_sum(self, a: NearFar, scale: float, b: NearFar) -> None:
        """self = a + scale b, all three with the same places."""
        parts = ((a.near, b.near, self.near), (a.far.weights, b.far.weights, self.far.weights))
        for one, other, out in parts:
            wp.launch(set_sum_kernel, out.shape, [one, scale, other], [out], device=out.device)

    def add_near(self, rows: BlockRows) -> None:
        """Add the near part to the blocks."""
        wp.launch(add_near_kernel, self.near.shape, [self.near], [rows.blocks], device=self.near.device)


@dataclass(frozen=True)
class Places:
    """Where the entries of matrices with one pattern go: `near` (N, width), which entry of `pattern` has each place of
    BlockRows, or its number of entries for none; `far` (K,) those that have none, and their `row` and `slot` there."""

    pattern: sp.csr_matrix
    near: np.ndarray
    far: np.ndarray
    row: np.ndarray
    slot: np.ndarray

    @staticmethod
    def of(pattern: sp.csr_matrix, rows: BlockRows) -> Places:
        """Wherever `pattern` has an entry, a zero too, over `rows`."""
        columns = rows.columns.numpy()
        count = pattern.nnz
        numbers = sp.csr_matrix((np.arange(1, count + 1), pattern.indices, pattern.indptr), shape=pattern.shape)
        own = np.repeat(np.arange(rows.row_count), rows.width)
        near = (np.asarray(numbers[own, columns.ravel()]).reshape(columns.shape) - 1) % (count + 1)
        near[:, 1:][columns[:, 1:] == columns[:, :1]] = count  # padding
        is_far = np.ones(count + 1, bool)
        is_far[near] = False
        far = np.flatnonzero(is_far[:count])
        row = np.repeat(np.arange(rows.row_count), np.diff(pattern.indptr))[far]
        slot = np.arange(len(far)) - np.searchsorted(row, np.arange(rows.row_count))[row]
        return Places(pattern, near, far, row, slot)

    def split(self, matrix: sp.csr_matrix, device: str) -> NearFar:
        """A matrix all of whose entries are in the pattern."""
        values = np.append(on_pattern(matrix, self.pattern), 0.0).astype(np.float32)
        count = len(self.near)
        columns = np.repeat(np.arange(count, dtype=np.int32)[:, None], int(self.slot.max(initial=0)) + 1, axis=1)
        weights = np.zeros(columns.shape, np.float32)
        columns[self.row, self.slot] = self.pattern.indices[self.far]
        weights[self.row, self.slot] = values[self.far]
        far = EllMatrix(
            wp.array(columns, dtype=wp.int32, device=device),
            wp.array(weights, dtype=wp.float32, device=device),
            *columns.shape,
        )
        return NearFar(wp.array(values[self.near], dtype=wp.float32, device=device), far)


def union(matrices: Sequence[sp.csr_matrix]) -> sp.csr_matrix:
    """Ones wherever one of them has an entry, a zero too."""
    ones = [sp.csr_matrix((np.ones(m.nnz), m.indices, m.indptr), shape=m.shape) for m in matrices]
    together = sp.csr_matrix(sum(ones[1:], ones[0]))
    together.sum_duplicates()
    return together


def on_pattern(matrix: sp.csr_matrix, pattern: sp.csr_matrix) -> np.ndarray:
    """(nnz,) values of `matrix` where `pattern` has an entry; ValueError if it has others, not zero."""
    if np.array_equal(matrix.indptr, pattern.indptr) and np.array_equal(matrix.indices, pattern.indices):
        return matrix.data
    rows = np.repeat(np.arange(pattern.shape[0]), np.diff(pattern.indptr))
    values = np.asarray(matrix[rows, pattern.indices]).ravel()
    if np.count_nonzero(values) != np.count_nonzero(matrix.data):
        raise ValueError("the matrix has entries where the pattern has none")
    return values


@wp.kernel
def add_near_kernel(near: wp.array2d(dtype=wp.float32), blocks: wp.array2d(dtype=wp.mat33)):
    i, k = wp.tid()
    blocks[i, k] = blocks[i, k] + near[i, k] * wp.identity(n=3, dtype=wp.float32)


@wp.kernel
def set_sum_kernel(
    a: wp.array2d(dtype=wp.float32),
    scale: float,
    b: wp.array2d(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
):
    i, k = wp.tid()
    out[i, k] = a[i, k] + scale * b[i, k]
