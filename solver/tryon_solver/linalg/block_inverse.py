"""The inverse of a symmetric positive definite matrix of some hundred rows, made by a GPU without being waited for.

By Gauss-Jordan elimination in place, PIVOT rows and columns at a time: with K those, D the inverse of their block,

    A_Kj <- D A_Kj,   A_iK <- -A_iK D,   A_ij <- A_ij - A_iK (D A_Kj)   for all others i, j.

No row is exchanged, which a positive definite matrix does not need; it is scaled to a diagonal of ones first, and what
rounding has made unsymmetric is halved. The processor has LAPACK for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})

PIVOT = 32  # rows at a time: a block of threads for each number of theirs
ROWS = wp.constant(PIVOT)


@wp.kernel
def scale_kernel(
    matrix: wp.array2d(dtype=wp.float32), count: int, scale_out: wp.array(dtype=wp.float32), a: wp.array2d(dtype=float)
):
    """Ones on the diagonal, also of the rows that fill the last block up."""
    i, j = wp.tid()
    si = float(1.0)
    sj = float(1.0)
    if i < count:
        si = 1.0 / wp.sqrt(matrix[i, i])
    if j < count:
        sj = 1.0 / wp.sqrt(matrix[j, j])
    if i == j:
        scale_out[i] = si
        a[i, j] = 1.0
    else:
        a[i, j] = si * sj * matrix[i, j]


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    __shared__ float s[32][33];
    const int r = threadIdx.x / 32;
    const int c = threadIdx.x % 32;
    s[r][c] = *wp::address(a, first + r, first + c);
    __syncthreads();
    for (int p = 0; p < 32; ++p) {
        const float inverse = 1.0f / s[p][p];
        const float row = s[p][c];
        const float column = s[r][p];
        const float own = s[r][c];
        __syncthreads();
        float now;
        if (r == p)
            now = c == p ? inverse : row * inverse;
        else
            now = c == p ? -column * inverse : own - column * inverse * row;
        s[r][c] = now;
        __syncthreads();
    }
    *wp::address(d, r, c) = s[r][c];
#endif
""")
def invert_pivot(a: wp.array2d(dtype=wp.float32), first: int, d: wp.array2d(dtype=wp.float32)) -> None:
    """d = the inverse of a's block from row and column `first` on, by a block of 1,024 threads of a GPU."""


@wp.kernel
def pivot_kernel(a: wp.array2d(dtype=wp.float32), first: int, d: wp.array2d(dtype=wp.float32)):
    invert_pivot(a, first, d)


@wp.kernel
def panels_kernel(
    a: wp.array2d(dtype=wp.float32),
    first: int,
    d: wp.array2d(dtype=wp.float32),
    rows_out: wp.array2d(dtype=wp.float32),
    columns_out: wp.array2d(dtype=wp.float32),
):
    """D A_Kj, and A_jK as it was."""
    r, j = wp.tid()
    total = float(0.0)
    for q in range(ROWS):
        total += d[r, q] * a[first + q, j]
    rows_out[r, j] = total
    columns_out[r, j] = a[j, first + r]


@wp.kernel
def eliminate_kernel(
    first: int,
    d: wp.array2d(dtype=wp.float32),
    rows: wp.array2d(dtype=wp.float32),
    columns: wp.array2d(dtype=wp.float32),
    a: wp.array2d(dtype=wp.float32),
):
    i, j = wp.tid()
    k = i - first
    m = j - first
    in_rows = k >= 0 and k < ROWS
    in_columns = m >= 0 and m < ROWS
    if in_rows and in_columns:
        a[i, j] = d[k, m]
    elif in_rows:
        a[i, j] = rows[k, j]
    elif in_columns:
        total = float(0.0)
        for q in range(ROWS):
            total += columns[q, i] * d[q, m]
        a[i, j] = -total
    else:
        total = a[i, j]
        for q in range(ROWS):
            total -= columns[q, i] * rows[q, j]
        a[i, j] = total


@wp.kernel
def unscale_kernel(
    a: wp.array2d(dtype=wp.float32),
    scale: wp.array(dtype=wp.float32),
    count: int,
    inverse_out: wp.array2d(dtype=wp.float32),
):
    i, j = wp.tid()
    inverse_out[i, j] = 0.0
    if i < count and j < count:
        inverse_out[i, j] = 0.5 * (a[i, j] + a[j, i]) * scale[i] * scale[j]


@dataclass
class BlockInverse:
    """`inverse` (M, M) float32; the rest is scratch: `a` (M, M), `d` (PIVOT, PIVOT), `rows` and `columns` (PIVOT, M),
    `scale` (M,), all float32. M is a multiple of PIVOT."""

    inverse: wp.array
    a: wp.array
    d: wp.array
    rows: wp.array
    columns: wp.array
    scale: wp.array

    @staticmethod
    def allocate(size: int, device: str) -> BlockInverse:
        """For matrices of `size` rows; the inverse is zero at first."""
        size_here = size if wp.get_device(device).is_cuda else 0

        def numbers(*shape: int) -> wp.array:
            return wp.zeros(shape, dtype=wp.float32, device=device)

        return BlockInverse(
            numbers(size, size),
            numbers(size_here, size_here),
            numbers(PIVOT, PIVOT),
            numbers(PIVOT, size_here),
            numbers(PIVOT, size_here),
            numbers(size_here),
        )

    def invert(self, matrix: wp.array, count: int) -> None:
        """inverse = the inverse of the first `count` rows and columns of `matrix` (M, M), zero beyond."""
        device, size = matrix.device, len(self.inverse)
        if device.is_cpu:
            seen = matrix.numpy()[:count, :count].astype(np.float64)
            self.inverse.numpy()[:count, :count] = np.linalg.inv(0.5 * (seen + seen.T))
            return
        launch(scale_kernel, (size, size), [matrix, count], [self.scale, self.a], device=device)
        for first in range(0, size, PIVOT):
            launch(pivot_kernel, PIVOT * PIVOT, [self.a, first], [self.d], device=device, block_dim=PIVOT * PIVOT)
            panels = [self.rows, self.columns]
            launch(panels_kernel, (PIVOT, size), [self.a, first, self.d], panels, device=device)
            launch(eliminate_kernel, (size, size), [first, self.d, *panels], [self.a], device=device)
        launch(unscale_kernel, (size, size), [self.a, self.scale, count], [self.inverse], device=device)
