"""A dense symmetric positive definite matrix factored by one thread of a processor, and solved with: A = U^T U.

Of some hundred rows, many times a frame. LAPACK would wait for its own threads, which others' work keeps from running,
and its sums would depend on how many they are. A GPU inverts (gauss_jordan.py).
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import STIFF_QUANTA

wp.set_module_options({"enable_backward": False})


@wp.func_native("""
#if !defined(__CUDA_ARCH__)
    typedef double four __attribute__((vector_size(32), aligned(8)));  // of Clang, which Warp compiles with
    const int n = sums.shape[0];
    for (int i = 0; i < n; ++i)
        for (int j = i; j < n; ++j)
            wp::index(upper, i, j) = double(wp::index(sums, i, j)) / quanta;
    for (int k = 0; k < n; ++k) {
        double* row = &wp::index(upper, k, 0);
        const double over = row[k] > 0.0 ? 1.0 / sqrt(row[k]) : 0.0;
        row[k] = over;
        for (int j = k + 1; j < n; ++j)
            row[j] *= over;
        for (int i = k + 1; i < n; ++i) {
            const double by = row[i];
            if (by == 0.0)
                continue;
            double* below = &wp::index(upper, i, 0);
            int j = i;
            for (; j + 4 <= n; j += 4)
                *reinterpret_cast<four*>(below + j) -= by * *reinterpret_cast<const four*>(row + j);
            for (; j < n; ++j)
                below[j] -= by * row[j];
        }
    }
#endif
""")
def factor_in_place(sums: wp.array2d(dtype=wp.int64), quanta: float, upper: wp.array2d(dtype=wp.float64)) -> None:
    """As `factor`, by one thread."""


@wp.func_native("""
#if !defined(__CUDA_ARCH__)
    typedef double four __attribute__((vector_size(32), aligned(8)));
    const int n = upper.shape[0];
    double* at = x.data;
    for (int k = 0; k < n; ++k) {
        const double* row = &wp::index(upper, k, 0);
        const double by = at[k] *= row[k];
        int j = k + 1;
        for (; j + 4 <= n; j += 4)
            *reinterpret_cast<four*>(at + j) -= by * *reinterpret_cast<const four*>(row + j);
        for (; j < n; ++j)
            at[j] -= by * row[j];
    }
    for (int k = n - 1; k >= 0; --k) {
        const double* row = &wp::index(upper, k, 0);
        four total = {};
        int j = k + 1;
        for (; j + 4 <= n; j += 4)
            total += *reinterpret_cast<const four*>(row + j) * *reinterpret_cast<const four*>(at + j);
        double rest = at[k] - (total[0] + total[1] + total[2] + total[3]);
        for (; j < n; ++j)
            rest -= row[j] * at[j];
        at[k] = rest * row[k];
    }
#endif
""")
def solve_factored(upper: wp.array2d(dtype=wp.float64), x: wp.array(dtype=wp.float64)) -> None:
    """x <- A^-1 x with what `factor` made of A, by one thread; where nothing was factored yet, zero."""


@wp.kernel
def factor_kernel(sums: wp.array2d(dtype=wp.int64), upper_out: wp.array2d(dtype=wp.float64)):
    factor_in_place(sums, STIFF_QUANTA, upper_out)


def factor(sums: wp.array, upper_out: wp.array) -> None:
    """`upper` (n, n) float64, U with the inverses of its diagonal's numbers on the diagonal, of the matrix whose upper
    triangle `sums` (n, n) int64 has in quanta of order_free.py. What rounding leaves of a pivot that is not positive is
    taken for an unknown that nothing answers, whose share of a solution is zero: for a preconditioner that will do."""
    launch(factor_kernel, 1, [sums], [upper_out], device=sums.device)
