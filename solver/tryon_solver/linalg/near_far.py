"""A constant scalar matrix split by the pattern of a mesh's blocks: what falls on them is added to them, once a Newton
iteration instead of once a product; for bending that is half of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import warp as wp

from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.linalg.ell import EllMatrix, on_pattern

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class NearFar:
    """A matrix (N, N) [N/m] whose rows sum to zero. `near` (N, width) float32 over the places of BlockRows, the
    diagonal first; `far` what has no place there, none of it on the diagonal."""

    near: wp.array
    far: EllMatrix

    @staticmethod
    def build(matrix: sp.csr_matrix, pattern: sp.csr_matrix, rows: BlockRows, device: str) -> NearFar:
        """`matrix` over `rows`; its far part has an entry, if only a zero, wherever `pattern` has one."""
        columns = rows.columns.numpy()
        own = np.repeat(np.arange(rows.row_count), rows.width)
        entries = np.array(sp.csr_matrix(matrix)[own, columns.ravel()], np.float32)
        near = entries.reshape(columns.shape)
        near[:, 1:][columns[:, 1:] == columns[:, :1]] = 0.0  # padding
        placed = sp.csr_matrix((np.ones(columns.size), (own, columns.ravel())), shape=matrix.shape)
        far = EllMatrix.from_scipy(on_pattern(beyond(matrix, placed), beyond(pattern, placed)), device)
        return NearFar(wp.array(near, dtype=wp.float32, device=device), far)

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


def beyond(matrix: sp.csr_matrix, placed: sp.csr_matrix) -> sp.csr_matrix:
    """The entries of `matrix` that `placed` has none for."""
    csr = sp.csr_matrix(matrix)
    left = csr - csr.multiply(placed != 0)
    left = sp.csr_matrix(left)
    left.eliminate_zeros()
    return left


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
