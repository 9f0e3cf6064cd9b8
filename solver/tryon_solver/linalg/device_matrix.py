"""Sparse matrices whose entries are made on the device, over a pattern that stands.

A shape's matrices are sums over triangles or hinges. Which entries there are follows from the mesh, and so does which
of the elements' entries each of them is the sum of: both are found once. Another shape of the same mesh is other
entries, added in the same order, so that the same shape gives the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class DeviceMatrix:
    """`pattern` (N, N), which has an entry wherever the matrix may have one; `values` (nnz,) float64, its entries."""

    pattern: sp.csr_matrix
    values: wp.array

    @staticmethod
    def of(matrix: sp.csr_matrix, device: str) -> DeviceMatrix:
        """A copy; its pattern is where `matrix` has entries, zeros too."""
        return DeviceMatrix(matrix, wp.array(matrix.data, dtype=wp.float64, device=device))

    def matrix(self) -> sp.csr_matrix:
        """(N, N) float64, as it is now. Waits for the device."""
        pattern = self.pattern
        return sp.csr_matrix((self.values.numpy().copy(), pattern.indices, pattern.indptr), shape=pattern.shape)


@dataclass(frozen=True)
class ElementMatrix:
    """The sum of elements' small matrices: `entries` (E k k,) float64 theirs, element by element and row by row; the
    total's entry i is the sum of `entries[order[starts[i]]]` to `entries[order[starts[i + 1] - 1]]`."""

    total: DeviceMatrix
    entries: wp.array
    order: wp.array
    starts: wp.array

    @staticmethod
    def build(pattern: sp.csr_matrix, order: np.ndarray, starts: np.ndarray, device: str) -> ElementMatrix:
        """Of entries that are zero; `order` (E k k,) and `starts` (nnz + 1,) as above."""
        return ElementMatrix(
            DeviceMatrix(pattern, wp.zeros(pattern.nnz, dtype=wp.float64, device=device)),
            wp.zeros(len(order), dtype=wp.float64, device=device),
            wp.array(order, dtype=wp.int32, device=device),
            wp.array(starts, dtype=wp.int32, device=device),
        )

    def add_up(self) -> None:
        """Let the total be that of the entries."""
        values = self.total.values
        launch(add_up_kernel, len(values), [self.entries, self.order, self.starts], [values], device=values.device)


@dataclass(frozen=True)
class Summand:
    """`scale` times `matrix`, in a sum over a wider pattern: `places` (nnz,) int32, where each entry goes there."""

    matrix: DeviceMatrix
    scale: float
    places: wp.array

    @staticmethod
    def over(pattern: sp.csr_matrix, matrix: DeviceMatrix, scale: float) -> Summand:
        """`pattern` has sorted columns. ValueError: the matrix may have entries that it has no place for."""
        device, own_pattern = matrix.values.device, matrix.pattern
        if same_entries(pattern, own_pattern):
            return Summand(matrix, scale, wp.array(np.arange(pattern.nnz), dtype=wp.int32, device=device))
        wide, own = entry_keys(pattern), entry_keys(own_pattern)
        places = np.searchsorted(wide, own)
        if (np.append(wide, -1)[places] != own).any():
            raise ValueError("the matrix may have entries where the sum's pattern has none")
        return Summand(matrix, scale, wp.array(places, dtype=wp.int32, device=device))


def same_entries(one: sp.csr_matrix, other: sp.csr_matrix) -> bool:
    """Have both entries at the same places, in the same order?"""
    return np.array_equal(one.indptr, other.indptr) and np.array_equal(one.indices, other.indices)


def entry_keys(pattern: sp.csr_matrix) -> np.ndarray:
    """(nnz,) int64 a number of each entry's own, by its row and column; rising where the rows' columns are sorted."""
    rows = np.repeat(np.arange(pattern.shape[0], dtype=np.int64), np.diff(pattern.indptr))
    return rows * pattern.shape[1] + pattern.indices


def add_together(summands: Sequence[Summand], values_out: wp.array) -> None:
    """The sum's entries (nnz,) float64, in the order of the summands."""
    values_out.zero_()
    for summand in summands:
        inputs = [summand.matrix.values, wp.float64(summand.scale), summand.places]
        launch(add_scaled_kernel, len(summand.places), inputs, [values_out], device=values_out.device)


def union(matrices: Sequence[sp.csr_matrix], count: int) -> sp.csr_matrix:
    """(count, count) ones wherever one of them has an entry, a zero too."""
    ones = [sp.csr_matrix((np.ones(m.nnz), m.indices, m.indptr), shape=m.shape) for m in matrices]
    together = sp.csr_matrix(sum(ones, sp.csr_matrix((count, count))))
    together.sum_duplicates()
    return together


@wp.kernel
def add_up_kernel(
    entries: wp.array(dtype=wp.float64),
    order: wp.array(dtype=wp.int32),
    starts: wp.array(dtype=wp.int32),
    values_out: wp.array(dtype=wp.float64),
):
    i = wp.tid()
    total = wp.float64(0.0)
    for k in range(starts[i], starts[i + 1]):
        total += entries[order[k]]
    values_out[i] = total


@wp.kernel
def add_scaled_kernel(
    values: wp.array(dtype=wp.float64),
    scale: wp.float64,
    places: wp.array(dtype=wp.int32),
    values_out: wp.array(dtype=wp.float64),
):
    """No two entries of a matrix have the same place."""
    k = wp.tid()
    values_out[places[k]] = values_out[places[k]] + scale * values[k]
