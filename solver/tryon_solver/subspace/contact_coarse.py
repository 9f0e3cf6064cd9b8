"""An exact coarse level that knows the contacts.

Contact couples x, y and z (blocks n n^T), so the coarse matrix P^T (H + C) P, P = B (x) I3, is a full 3M' x 3M' matrix;
with grid spacings of 8 to 12 edges M' is small enough to factor it afresh in every step. Contact pairs enter through
their stencils: with q = sum_i lam_i B_i (a row of M') a pair adds q q^T (x) (w n n^T + w_t (I - n n^T)). Not the
paper's method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import warp as wp

from tryon_solver.linalg.ell import EllMatrix, multiply
from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})


@dataclass
class ContactCoarseLevel:
    """`basis` (N, M') scipy, rows sum to one; `rest` (M', M') float64 N/m, of the step's H without contact;
    `inverse` (M', M') mat33 m/N."""

    basis: sp.csr_matrix
    prolong: EllMatrix
    restrict: EllMatrix
    rest: np.ndarray
    inverse: wp.array
    reduced: wp.array
    correction: wp.array

    @property
    def size(self) -> int:
        """Number of coarse bases M'."""
        return self.basis.shape[1]

    @staticmethod
    def build(basis: sp.csr_matrix, device: str) -> ContactCoarseLevel:
        """Allocate for this basis; `set_rest` and `factorise` fill it."""
        size = basis.shape[1]
        return ContactCoarseLevel(
            basis,
            EllMatrix.from_scipy(basis, device),
            EllMatrix.from_scipy(basis.T, device),
            np.eye(size),
            wp.zeros((size, size), dtype=wp.mat33, device=device),
            wp.zeros(size, dtype=wp.vec3, device=device),
            wp.zeros(size, dtype=wp.vec3, device=device),
        )

    def factorise(
        self, ids: np.ndarray, lam: np.ndarray, normal: np.ndarray, along: np.ndarray, across: np.ndarray
    ) -> None:
        """Invert P^T (H + C) P for contact pairs with stencils `ids`, `lam` (C, 4), unit normals (C, 3).

        `along`, `across` (C,) N/m: stiffness along the normal and tangential to it. Vertices of the body are fixed.
        """
        matrix = np.kron(self.rest, np.eye(3))
        if len(ids):
            cloth = ids < self.basis.shape[0]
            rows = np.repeat(np.arange(len(ids)), 4)[cloth.ravel()]
            stencils = sp.coo_matrix(
                (lam.ravel()[cloth.ravel()], (rows, ids.ravel()[cloth.ravel()])),
                shape=(len(ids), self.basis.shape[0]),
            ).tocsr()
            q = np.asarray((stencils @ self.basis).todense())
            for a in range(3):
                for b in range(3):
                    weight = (along - across) * normal[:, a] * normal[:, b] + (across if a == b else 0.0)
                    matrix[a::3, b::3] += q.T @ (weight[:, None] * q)
        lower_inv = np.linalg.inv(np.linalg.cholesky(matrix))
        inverse = (lower_inv.T @ lower_inv).reshape(self.size, 3, self.size, 3).transpose(0, 2, 1, 3)
        self.inverse.assign(np.ascontiguousarray(inverse, np.float32))


@wp.kernel
def apply_blocks_kernel(
    inverse: wp.array2d(dtype=wp.mat33), r: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.vec3)
):
    """out = inverse r"""
    i = wp.tid()
    total = wp.vec3()
    for j in range(r.shape[0]):
        total += inverse[i, j] * r[j]
    out[i] = total


def correct_coarsely(level: ContactCoarseLevel, residual: wp.array, correction_out: wp.array) -> None:
    """correction = P (P^T A P)^-1 P^T residual, (N,) vec3 m from N."""
    device = residual.device
    multiply(level.restrict, residual, level.reduced)
    launch(apply_blocks_kernel, level.size, [level.inverse, level.reduced], [level.correction], device=device)
    multiply(level.prolong, level.correction, correction_out)
