"""A sparse matrix of 3x3 blocks over the pairs of vertices that share a triangle, in ELLPACK rows.

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
    def build(faces: np.ndarray, vertex_count: int, device: str) -> BlockRows:
        """Pattern of a mesh with `faces` (F, 3) over `vertex_count` vertices."""
        row = np.repeat(faces, 3, axis=1).ravel().astype(np.int64)
        column = np.tile(faces, (1, 3)).ravel().astype(np.int64)
        # the diagonal sorts first within its row
        rank = np.where(column == row, -1, column)
        key, inverse = np.unique(row * (vertex_count + 1) + rank + 1, return_inverse=True)
        entry_row = key // (vertex_count + 1)
        entry_column = key % (vertex_count + 1) - 1
        entry_column = np.where(entry_column < 0, entry_row, entry_column)
        first = np.searchsorted(entry_row, np.arange(vertex_count))
        slot = np.arange(len(key)) - first[entry_row]
        width = int(slot.max()) + 1
        columns = np.repeat(np.arange(vertex_count, dtype=np.int32)[:, None], width, axis=1)
        columns[entry_row, slot] = entry_column
        return BlockRows(
            wp.array(columns, dtype=wp.int32, device=device),
            wp.zeros((vertex_count, width), dtype=wp.mat33, device=device),
            wp.array(slot[inverse.ravel()].reshape(-1, 9).astype(np.int32), dtype=wp.int32, device=device),
            vertex_count,
            width,
        )


@wp.func
def add_block(
    blocks: wp.array2d(dtype=wp.mat33), slots: wp.array2d(dtype=wp.int32), t: int, i: int, j: int, row: int, b: wp.mat33
):
    """Add b to block (i, j) of triangle t, i's vertex being `row`."""
    wp.atomic_add(blocks, row, slots[t, 3 * i + j], b)


@wp.kernel
def add_difference_kernel(
    columns: wp.array2d(dtype=wp.int32),
    blocks: wp.array2d(dtype=wp.mat33),
    x: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    out: wp.array(dtype=wp.vec3),
):
    """out += blocks (x - x_start)"""
    i = wp.tid()
    total = wp.vec3()
    for k in range(columns.shape[1]):
        j = columns[i, k]
        total += blocks[i, k] * (x[j] - x_start[j])
    out[i] = out[i] + total


@wp.kernel
def add_blocks_kernel(more: wp.array2d(dtype=wp.mat33), blocks: wp.array2d(dtype=wp.mat33)):
    i, k = wp.tid()
    blocks[i, k] = blocks[i, k] + more[i, k]


def add_blocks(rows: BlockRows, more: BlockRows) -> None:
    """rows += more, both over one mesh."""
    wp.launch(
        add_blocks_kernel, (rows.row_count, rows.width), [more.blocks], [rows.blocks], device=rows.blocks.device
    )


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
