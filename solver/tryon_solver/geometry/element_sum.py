"""The sum of many small matrices, each over the vertices of a triangle or a hinge, as one sparse matrix.

Where each entry goes depends on the elements' vertices alone: it is found once, and sums of other entries over the same
elements are additions in the same order, so that the same entries give the same bits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True)
class ElementSum:
    """`starts` (N + 1,) and `columns` (nnz,) of the sum's compressed rows, columns ascending; `places` (E k k,): which
    of its nnz values each entry is added to, element by element and row by row."""

    starts: np.ndarray
    columns: np.ndarray
    places: np.ndarray

    @staticmethod
    def over(ids: np.ndarray, count: int) -> ElementSum:
        """Of elements over the vertices `ids` (E, k), of `count`."""
        k = ids.shape[1]
        row, column = np.repeat(ids, k, axis=1).ravel(), np.tile(ids, (1, k)).ravel()
        order = stable_order(column, count)
        order = order[stable_order(row[order], count)]
        row, column = row[order], column[order]
        first = np.ones(len(order), bool)
        first[1:] = (row[1:] != row[:-1]) | (column[1:] != column[:-1])
        places = np.empty(len(order), np.int64)
        places[order] = np.cumsum(first) - 1
        starts = np.concatenate([[0], np.cumsum(np.bincount(row[first], minlength=count))])
        return ElementSum(starts.astype(np.int32), column[first].astype(np.int32), places)

    def matrix(self, entries: np.ndarray) -> sp.csr_matrix:
        """(N, N) float64, the sum of the elements' matrices `entries` (E, k, k)."""
        count = len(self.starts) - 1
        values = np.bincount(self.places, weights=entries.ravel(), minlength=len(self.columns))
        return sp.csr_matrix((values, self.columns, self.starts), shape=(count, count))


def stable_order(numbers: np.ndarray, below: int) -> np.ndarray:
    """What sorts whole numbers from 0 to `below`, equal ones in the order that they have: in one pass, as entries are
    brought into rows."""
    every = np.arange(len(numbers))
    return sp.csr_matrix((np.ones(len(numbers), np.int8), (numbers, every)), shape=(below, len(numbers))).indices
