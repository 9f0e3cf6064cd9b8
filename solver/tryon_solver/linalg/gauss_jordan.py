"""The inverse of a symmetric positive definite matrix of some hundred rows, made by a GPU without being waited for.

By Gauss-Jordan elimination, PIVOT rows and columns at a time: with K those, D the inverse of their block,

    A_Kj <- D A_Kj,   A_iK <- -A_iK D,   A_ij <- A_ij - A_iK (D A_Kj)   for all others i, j

(Golub and Van Loan 2013, section 3.2, block by block). No row is exchanged, which a positive definite matrix does not
need; it is scaled to a diagonal of ones first, and what rounding has made unsymmetric is halved. In float64: what is
held by contact is ten million times stiffer than what falls. One launch takes a pivot: each block of threads inverts
the pivots' block for itself, which takes less long than another launch. A processor factors (cholesky.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import STIFF_QUANTA

wp.set_module_options({"enable_backward": False})

PIVOT = 32  # rows at a time, and of a tile
THREADS = 256  # of a tile's block, each with four numbers of a column
TILE = wp.constant(THREADS)


@wp.func
def over_root(sums: wp.array2d(dtype=wp.int64), i: int, count: int) -> wp.float64:
    """What scales row and column i; nothing answers an unknown that has nothing on the diagonal, and 0 leaves it."""
    scale = wp.float64(0.0)
    if i < count and sums[i, i] > wp.int64(0):
        scale = wp.float64(1.0) / wp.sqrt(wp.float64(sums[i, i]))
    return scale


@wp.kernel
def scale_kernel(sums: wp.array2d(dtype=wp.int64), count: int, a_out: wp.array2d(dtype=wp.float64)):
    """Ones on the diagonal, also of the rows that fill the last block up; below it what is above."""
    i, j = wp.tid()
    if i == j:
        a_out[i, j] = wp.float64(1.0)
    else:
        both = over_root(sums, i, count) * over_root(sums, j, count)
        a_out[i, j] = both * wp.float64(sums[wp.min(i, j), wp.max(i, j)])


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    __shared__ double d[32][33], rows[32][33], columns[32][33], pivot_row[2][32], pivot_column[2][32];
    const int warp = threadIdx.x / 32;
    const int c = threadIdx.x % 32;
    double own[4], now[4], turned[4];
    for (int k = 0; k < 4; ++k) {
        const int r = warp + 8 * k;
        own[k] = wp::index(a, first + r, first + c);
        now[k] = wp::index(a, 32 * tile_row + r, 32 * tile_column + c);
        rows[r][c] = wp::index(a, first + r, 32 * tile_column + c);
        columns[r][c] = wp::index(a, 32 * tile_row + r, first + c);
        if (c == 0)
            pivot_column[0][r] = own[k];
    }
    if (warp == 0)
        pivot_row[0][c] = own[0];
    __syncthreads();
    for (int p = 0; p < 32; ++p) {
        const double pivot = pivot_row[p & 1][p];
        double inverse;
        asm("rcp.approx.ftz.f64 %0, %1;" : "=d"(inverse) : "d"(pivot));
        inverse = fma(inverse, fma(-pivot, inverse, 1.0), inverse);
        inverse = fma(inverse, fma(-pivot, inverse, 1.0), inverse);
        inverse = pivot > 0.0 ? inverse : 0.0;
        const double row = pivot_row[p & 1][c] * inverse;
        for (int k = 0; k < 4; ++k) {
            const int r = warp + 8 * k;
            const double column = pivot_column[p & 1][r];
            if (r == p)
                own[k] = c == p ? inverse : row;
            else
                own[k] = c == p ? -column * inverse : own[k] - column * row;
            if (c == p + 1)
                pivot_column[(p + 1) & 1][r] = own[k];
            if (r == p + 1)
                pivot_row[(p + 1) & 1][c] = own[k];
        }
        __syncthreads();
    }
    for (int k = 0; k < 4; ++k) {
        d[warp + 8 * k][c] = own[k];
        turned[k] = 0.0;
    }
    __syncthreads();
    for (int q = 0; q < 32; ++q) {
        const double below = rows[q][c];
        for (int k = 0; k < 4; ++k)
            turned[k] += d[warp + 8 * k][q] * below;
    }
    __syncthreads();
    const bool in_rows = 32 * tile_row == first;
    const bool in_columns = 32 * tile_column == first;
    for (int k = 0; k < 4; ++k) {
        rows[warp + 8 * k][c] = in_columns ? own[k] : turned[k];
        if (in_rows)
            now[k] = in_columns ? own[k] : turned[k];
        else if (in_columns)
            now[k] = 0.0;
    }
    __syncthreads();
    if (!in_rows)
        for (int q = 0; q < 32; ++q) {
            const double below = rows[q][c];
            for (int k = 0; k < 4; ++k)
                now[k] -= columns[warp + 8 * k][q] * below;
        }
    for (int k = 0; k < 4; ++k)
        wp::index(out, 32 * tile_row + warp + 8 * k, 32 * tile_column + c) = now[k];
#endif
""")
def eliminate_tile(
    a: wp.array2d(dtype=wp.float64),
    first: int,
    tile_row: int,
    tile_column: int,
    out: wp.array2d(dtype=wp.float64),
) -> None:
    """A tile of what a becomes with the rows and columns from `first` on, by a block of THREADS of a GPU, each of which
    has four numbers of a column. A pivot's inverse, which the next one waits for, is an approximation of 20 bits and
    two of Newton's steps. A pivot that rounding left not positive is of an unknown that nothing answers."""


@wp.kernel
def eliminate_kernel(
    a: wp.array2d(dtype=wp.float64),
    first: int,
    tiles: int,
    out: wp.array2d(dtype=wp.float64),
):
    tile = wp.tid() // TILE
    eliminate_tile(a, first, tile // tiles, tile % tiles, out)


@wp.kernel
def unscale_kernel(
    a: wp.array2d(dtype=wp.float64),
    sums: wp.array2d(dtype=wp.int64),
    count: int,
    inverse_out: wp.array2d(dtype=wp.float32),
):
    i, j = wp.tid()
    both = over_root(sums, i, count) * over_root(sums, j, count) * wp.float64(STIFF_QUANTA)
    inverse_out[i, j] = wp.float32(wp.float64(0.5) * (a[i, j] + a[j, i]) * both)


@dataclass
class GaussJordan:
    """`inverse` (M, M) float32, M a multiple of PIVOT; `now` and `then` (M, M) float64 are scratch."""

    inverse: wp.array
    now: wp.array
    then: wp.array

    @staticmethod
    def allocate(size: int, device: str) -> GaussJordan:
        """For matrices of `size` rows; the inverse is zero at first."""
        now, then = (wp.zeros((size, size), dtype=wp.float64, device=device) for _ in range(2))
        return GaussJordan(wp.zeros((size, size), dtype=wp.float32, device=device), now, then)

    def invert(self, sums: wp.array, count: int) -> None:
        """inverse = the inverse of the first `count` rows and columns of the matrix whose upper triangle `sums` (M, M)
        int64 has in quanta of order_free.py, zero beyond."""
        device, size = sums.device, len(self.inverse)
        now, then, tiles = self.now, self.then, size // PIVOT
        launch(scale_kernel, (size, size), [sums, count], [now], device=device)
        for first in range(0, size, PIVOT):
            arguments = [now, first, tiles]
            launch(eliminate_kernel, tiles * tiles * THREADS, arguments, [then], device=device, block_dim=THREADS)
            now, then = then, now
        launch(unscale_kernel, (size, size), [now, sums, count], [self.inverse], device=device)
