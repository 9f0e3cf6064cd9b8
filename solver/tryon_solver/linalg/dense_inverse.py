"""The inverse of a dense SPD matrix, made beside a running simulation.

A thread in LAPACK's `potrf` and `potri` as scipy calls them keeps Python's lock: for 1,400 unknowns nobody else gets a
turn for 0.1 s, which is ten frames. numpy's products and its own factorisations let go of it. So H = L L^T is numpy's,
and H^-1 = L^-T L^-1 with L^-1 by halves, almost all of it products.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

SMALLEST = 64  # rows at which halving ends


def spd_inverse(matrix: Matrix) -> Matrix:
    """(n, n) float64 inverse, exactly symmetric, of a symmetric positive definite matrix.

    Raises numpy.linalg.LinAlgError when it is not positive definite.
    """
    inverse = np.zeros_like(matrix)
    lower: Matrix = np.linalg.cholesky(matrix).astype(np.float64, copy=False)
    _invert_lower(lower, inverse)
    product: Matrix = inverse.T @ inverse
    return product


def _invert_lower(lower: Matrix, out: Matrix) -> None:
    """[[A, 0], [B, C]]^-1 = [[A^-1, 0], [-C^-1 B A^-1, C^-1]], into `out`, which is zero above the diagonal."""
    if len(lower) <= SMALLEST:
        out[...] = np.tril(np.linalg.inv(lower))
        return
    half = len(lower) // 2
    first, last = slice(None, half), slice(half, None)
    _invert_lower(lower[first, first], out[first, first])
    _invert_lower(lower[last, last], out[last, last])
    out[last, first] = -(out[last, last] @ (lower[last, first] @ out[first, first]))
