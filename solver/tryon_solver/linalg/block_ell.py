"""A sparse matrix of 3x3 blocks over the pairs of vertices that share a triangle, or are joined otherwise, in ELLPACK
rows.

Its pattern is fixed at build; its values are summed afresh, triangle by triangle, whenever the point of linearisation
moves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class BlockRows:
    """`columns` (N, width) int32; `blocks` (N, width) mat33, the first of a row on the diagonal; `slots` (F, 9) int32:
    where block (i, j) of a triangle's corners goes within its row, at 3 i + j."""

    columns: wp.array
    blocks: wp.array
    slots: wp.array
    row_count: int
    width: int

    @staticmethod
    def build(columns: np.ndarray, slots: np.ndarray, device: str, joined: np.ndarray | None = None) -> BlockRows:
        """Blocks of zero over these pairs of vertices (`Connectivity.pairs`), and over those of `joined` (K, 2), which
        come behind them in their rows."""
        if joined is not None:
            columns = _with_pairs(columns, joined)
        count, width = columns.shape
        return BlockRows(
            wp.array(columns, dtype=wp.int32, device=device),
            wp.zeros((count, width), dtype=wp.mat33, device=device),
            wp.array(slots, dtype=wp.int32, device=device),
            count,
            width,
        )

    @property
    def on_diagonal(self) -> wp.array:
        """(N,) mat33, the blocks on the diagonal, in place."""
        return self.blocks[:, 0]


def _with_pairs(columns: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """The rows' columns, padded by their own vertex, with those pairs (K, 2) that they have not."""
    both = np.unique(np.vstack([pairs, pairs[:, ::-1]]), axis=0)
    row, column = both[~(columns[both[:, 0]] == both[:, 1:]).any(axis=1)].T
    taken = 1 + (columns[:, 1:] != columns[:, :1]).sum(axis=1)
    place = taken[row] + np.arange(len(row)) - np.searchsorted(row, row)
    wider = np.repeat(columns[:, :1], max(columns.shape[1], int(place.max(initial=0)) + 1), axis=1)
    wider[:, : columns.shape[1]] = columns
    wider[row, place] = column
    return wider


@wp.func
def add_joined_block(
    columns: wp.array2d(dtype=wp.int32), blocks: wp.array2d(dtype=wp.mat33), row: int, column: int, b: wp.mat33
):
    """Add b to the block of two vertices that have one, whether a triangle has both or not."""
    for k in range(1, columns.shape[1]):
        if columns[row, k] == column:
            wp.atomic_add(blocks, row, k, b)


@wp.func
def add_block(
    blocks: wp.array2d(dtype=wp.mat33), slots: wp.array2d(dtype=wp.int32), t: int, i: int, j: int, row: int, b: wp.mat33
):
    """Add b to block (i, j) of triangle t, i's vertex being `row`."""
    wp.atomic_add(blocks, row, slots[t, 3 * i + j], b)


@wp.kernel
def diagonal_blocks_kernel(
    blocks: wp.array2d(dtype=wp.mat33),
    diagonal: wp.array(dtype=wp.float32),
    out: wp.array(dtype=wp.mat33),
):
    """The 3x3 blocks on the diagonal of blocks + diagonal."""
    i = wp.tid()
    own = diagonal[i] * wp.identity(n=3, dtype=wp.float32)
    if i < blocks.shape[0]:
        own += blocks[i, 0]
    out[i] = own
