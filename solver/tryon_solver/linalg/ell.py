"""A scalar sparse matrix acting on vec3 unknowns, in ELLPACK rows.

Every projective-dynamics constraint acts identically on x, y and z, so the system matrix is S (x) I3 with S scalar: one
weight serves three components. Rows are padded to the longest row with weight zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import warp as wp

from tryon_solver.linalg.lanes import lanes_of, shares_of, sum_of_lanes
from tryon_solver.linalg.launch import launch, launch_blocks

wp.set_module_options({"enable_backward": False})

WIDE_BLOCK = 64  # threads to a row of many entries


@dataclass(frozen=True)
class EllMatrix:
    """Rows of a scalar sparse matrix. `columns` (rows, width) int32; `weights` (rows, width) float32."""

    columns: wp.array
    weights: wp.array
    row_count: int
    width: int

    @staticmethod
    def from_scipy(matrix: sp.spmatrix, device: str) -> EllMatrix:
        """Copy a scipy matrix (float64) to ELL rows (float32) on the device."""
        csr = sp.csr_matrix(matrix)
        csr.sum_duplicates()
        columns, places = entry_places(csr)
        weights = np.append(csr.data, 0.0).astype(np.float32)[places]
        return EllMatrix(
            wp.array(columns, dtype=wp.int32, device=device),
            wp.array(weights, dtype=wp.float32, device=device),
            *columns.shape,
        )

    @staticmethod
    def of_columns(columns: np.ndarray, device: str) -> EllMatrix:
        """Zeros, in these `columns` (rows, width) int32."""
        zeros = wp.zeros(columns.shape, dtype=wp.float32, device=device)
        return EllMatrix(wp.array(columns, dtype=wp.int32, device=device), zeros, *columns.shape)


def entry_places(pattern: sp.csr_matrix) -> tuple[np.ndarray, np.ndarray]:
    """ELLPACK rows of a pattern: `columns` (rows, width) int32, filled up with the row's own number, and `places`
    (rows, width) int32, which of its entries is there, -1 for none."""
    rows = pattern.shape[0]
    counts = np.diff(pattern.indptr)
    width = int(max(1, counts.max(initial=1)))
    columns = np.repeat(np.arange(rows, dtype=np.int32)[:, None] % pattern.shape[1], width, axis=1)
    places = np.full((rows, width), -1, np.int32)
    every = np.arange(pattern.nnz)
    there = every + np.repeat(width * np.arange(rows) - pattern.indptr[:-1], counts)
    columns.reshape(-1)[there] = pattern.indices
    places.reshape(-1)[there] = every
    return columns, places


@wp.kernel
def multiply_kernel(
    columns: wp.array2d(dtype=wp.int32),
    weights: wp.array2d(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    y_out: wp.array(dtype=wp.vec3),
):
    """y = S x"""
    row = wp.tid()
    total = wp.vec3()
    for k in range(columns.shape[1]):
        total += weights[row, k] * x[columns[row, k]]
    y_out[row] = total


@wp.kernel
def multiply_wide_kernel(
    columns: wp.array2d(dtype=wp.int32),
    weights: wp.array2d(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    y_out: wp.array(dtype=wp.vec3),
):
    """y = S x, each row by a block of threads."""
    row, thread = wp.tid()
    width = columns.shape[1]
    stride = wp.block_dim()
    total = wp.vec3()
    k = int(thread)
    while k < width:
        total += weights[row, k] * x[columns[row, k]]
        k += stride
    of_row = wp.tile_sum(wp.tile(total, preserve_type=True))
    if thread == 0:
        y_out[row] = of_row[0]


@wp.kernel
def add_difference_kernel(
    columns: wp.array2d(dtype=wp.int32),
    weights: wp.array2d(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    lanes: int,
    y_out: wp.array(dtype=wp.vec3),
):
    """y += S x for a matrix whose rows sum to zero, from differences, so that metres of translation cost no digits;
    each row shared by `lanes` threads (lanes.py)."""
    row = wp.tid() // lanes
    lane = wp.tid() % lanes
    total = wp.vec3()
    if row < columns.shape[0]:
        here = x[row]
        for k in range(lane, columns.shape[1], lanes):
            total += weights[row, k] * (x[columns[row, k]] - here)
    total = wp.vec3(sum_of_lanes(total[0]), sum_of_lanes(total[1]), sum_of_lanes(total[2]))
    if lane == 0 and row < columns.shape[0]:
        y_out[row] = y_out[row] + total


def multiply(matrix: EllMatrix, x: wp.array, y_out: wp.array) -> None:
    """y = S x, vec3 arrays of at least `row_count` entries; entries of y beyond the rows stay as they are."""
    launch(multiply_kernel, matrix.row_count, [matrix.columns, matrix.weights, x], [y_out], device=x.device)


def multiply_wide(matrix: EllMatrix, x: wp.array, y_out: wp.array) -> None:
    """The same for a matrix of few rows with many entries each."""
    launch_blocks(
        multiply_wide_kernel,
        matrix.row_count,
        [matrix.columns, matrix.weights, x],
        [y_out],
        block_dim=WIDE_BLOCK,
        device=matrix.weights.device,
    )


def add_difference(matrix: EllMatrix, x: wp.array, y_out: wp.array) -> None:
    """y += S x for a matrix whose rows sum to zero (an internal force)."""
    lanes = lanes_of(str(x.device))
    inputs = [matrix.columns, matrix.weights, x, lanes]
    launch(add_difference_kernel, shares_of(matrix.row_count, lanes), inputs, [y_out], device=x.device)
