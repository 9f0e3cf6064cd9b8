"""A constant scalar matrix split by the pattern of a mesh's blocks: what falls on them is added to them, once a Newton
iteration instead of once a product; for bending that is half of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import warp as wp

from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.linalg.ell import EllMatrix, entry_places
from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class NearFar:
    """A matrix (N, N) [N/m] whose rows sum to zero. `near` (N, width) float32 over the places of BlockRows, the
    diagonal first; `far` what has no place there, none of it on the diagonal."""

    near: wp.array
    far: EllMatrix


@dataclass(frozen=True)
class Places:
    """Where the entries of matrices with one pattern go: `near` (N, width) int32, which entry has each place of
    BlockRows, -1 for none; `far` (N, far width) int32, which of those that have none, in the columns of
    `far_columns`."""

    near: wp.array
    far: wp.array
    far_columns: wp.array

    @staticmethod
    def of(pattern: sp.csr_matrix, rows: BlockRows) -> Places:
        """Wherever `pattern` has an entry, a zero too, over `rows`."""
        columns, count, device = rows.columns.numpy(), pattern.nnz, rows.columns.device
        numbers = sp.csr_matrix((np.arange(1, count + 1), pattern.indices, pattern.indptr), shape=pattern.shape)
        own = np.repeat(np.arange(rows.row_count), rows.width)
        near = np.asarray(numbers[own, columns.ravel()]).reshape(columns.shape) - 1
        near[:, 1:][columns[:, 1:] == columns[:, :1]] = -1  # padding
        is_far = np.ones(count, bool)
        is_far[near[near >= 0]] = False
        which = np.flatnonzero(is_far)
        row = np.repeat(np.arange(rows.row_count), np.diff(pattern.indptr))[which]
        starts = np.searchsorted(row, np.arange(rows.row_count + 1))
        far_columns, far = entry_places(sp.csr_matrix((which, pattern.indices[which], starts), shape=pattern.shape))
        return Places(
            wp.array(near, dtype=wp.int32, device=device),
            wp.array(np.append(which, -1)[far], dtype=wp.int32, device=device),
            wp.array(far_columns, dtype=wp.int32, device=device),
        )

    def zeros(self) -> NearFar:
        """A matrix of zeros with these places."""
        device = self.near.device
        near = wp.zeros(self.near.shape, dtype=wp.float32, device=device)
        far = wp.zeros(self.far.shape, dtype=wp.float32, device=device)
        return NearFar(near, EllMatrix(self.far_columns, far, *self.far.shape))

    def take(self, values: wp.array, out: NearFar) -> None:
        """Let `out` be the matrix whose entries, by the pattern, are `values` (nnz,) float64."""
        take(values, self.near, out.near)
        take(values, self.far, out.far.weights)


def take(values: wp.array, places: wp.array, out: wp.array) -> None:
    """out[i, k] float32 = values[places[i, k]], zero where that is -1."""
    launch(take_kernel, out.shape, [values, places], [out], device=out.device)


@wp.kernel
def take_kernel(
    values: wp.array(dtype=wp.float64), places: wp.array2d(dtype=wp.int32), out: wp.array2d(dtype=wp.float32)
):
    i, k = wp.tid()
    e = places[i, k]
    if e < 0:
        out[i, k] = 0.0
    else:
        out[i, k] = wp.float32(values[e])
