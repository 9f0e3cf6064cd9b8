"""The sum of many small matrices, each over the vertices of a triangle or a hinge, as one sparse matrix.

Where each entry goes depends on the elements' vertices alone: it is found once, for sums of any entries over the same
elements (linalg/device_matrix.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True)
class ElementSum:
    """`pattern` (N, N), which has an entry wherever the sum may have one, columns ascending; `order` (E k k,) int32 and
    `starts` (nnz + 1,) int32: the elements' entries, numbered element by element and row by row, that its entry i is
    the sum of are `order[starts[i] : starts[i + 1]]`, ascending; `width` is k."""

    pattern: sp.csr_matrix
    order: np.ndarray
    starts: np.ndarray
    width: int

    @staticmethod
    def over(ids: np.ndarray, count: int) -> ElementSum:
        """Of elements over the vertices `ids` (E, k), of `count`."""
        k, ids = ids.shape[1], ids.astype(np.int32)
        row, column = np.repeat(ids, k, axis=1).ravel(), np.tile(ids, (1, k)).ravel()
        order = stable_order(column, count)
        order = order[stable_order(row[order], count)]
        row, column = row[order], column[order]
        first = np.ones(len(order), bool)
        first[1:] = (row[1:] != row[:-1]) | (column[1:] != column[:-1])
        rows = np.concatenate([[0], np.cumsum(np.bincount(row[first], minlength=count))])
        starts = np.append(np.flatnonzero(first), len(order)).astype(np.int32)
        ones = np.ones(len(starts) - 1)
        pattern = sp.csr_matrix((ones, column[first], rows.astype(np.int32)), shape=(count, count))
        return ElementSum(pattern, order, starts, k)

    @property
    def places(self) -> np.ndarray:
        """(E k k,): which of the pattern's entries each of the elements' is added to."""
        places = np.empty(len(self.order), np.int64)
        places[self.order] = np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))
        return places


def stable_order(numbers: np.ndarray, below: int) -> np.ndarray:
    """What sorts whole numbers from 0 to `below`, equal ones in the order that they have: in one pass, as entries are
    brought into rows."""
    every = np.arange(len(numbers), dtype=np.int32)
    return sp.csr_matrix((np.ones(len(numbers), np.int8), (numbers, every)), shape=(below, len(numbers))).indices
