"""Which pieces cloth is of: what no row of its matrix couples to anything else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

MOST_PIECES = 16
"""Of which each is moved by itself: any two may couple, and a processor's one thread solves for all of them."""


@dataclass(frozen=True)
class Pieces:
    """`of_vertex` (N,) int32, which piece each vertex is of; `ordered` (N,) int32, the vertices piece by piece, each
    piece's ascending; `starts` (P + 1,) int32, where those of each begin. `largest`: vertices of the largest.

    Of more than MOST_PIECES none is told from another, and `apart` is not set."""

    of_vertex: wp.array
    ordered: wp.array
    starts: wp.array
    count: int
    largest: int
    apart: bool

    @staticmethod
    def of(labels: np.ndarray, device: str) -> Pieces:
        """Of `labels` (N,), from 0, of which each is some vertex's."""
        apart = int(labels.max(initial=0)) < MOST_PIECES
        labels = labels if apart else np.zeros_like(labels)
        sizes = np.bincount(labels)

        def numbers(values: np.ndarray) -> wp.array:
            return wp.array(values.astype(np.int32), dtype=wp.int32, device=device)

        ordered, starts = np.argsort(labels, kind="stable"), np.concatenate([[0], np.cumsum(sizes)])
        return Pieces(numbers(labels), numbers(ordered), numbers(starts), len(sizes), int(sizes.max()), apart)

    @property
    def vertices(self) -> int:
        """How many vertices all of them have."""
        return len(self.ordered)


def uncoupled(*columns: np.ndarray) -> np.ndarray:
    """(N,) int32 labels, from 0, of the pieces between which no row of `columns` (N, any width) each, which are filled
    up by a row's own number, has an entry."""
    count = len(columns[0])
    row = np.concatenate([np.repeat(np.arange(count), each.shape[1]) for each in columns])
    column = np.concatenate([each.ravel() for each in columns])
    graph = coo_array((np.ones(len(row), np.int8), (row, column)), shape=(count, count))
    return connected_components(graph, directed=False)[1].astype(np.int32)
