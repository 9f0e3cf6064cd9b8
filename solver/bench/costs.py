"""Bytes and operations of the dearest kernels, counted from what is in their arrays.

Bytes are those that have to move: every entry that is used once, as if what is gathered again were in a cache, and what
is added to once read and once written. Operations are float32 additions and multiplications, two to a multiply-add. Of
rows that end early the padding is not counted. So a share of the roof says how far a kernel is from the least that its
data ask for, whatever it does beside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.linalg.paired_matrix import PairedMatrix

WORD, VECTOR, BLOCK = 4, 12, 36  # bytes of a number, of three, of nine
PAIR = 16 + 16 + VECTOR + WORD + BLOCK  # ids, lam, normal, curvature, beside
LISTED = 16 + 2 * WORD  # ids, kind, distance
CLOSEST_POINTS = 60  # three differences, their six products, two weights, the difference there and its length
NODE = 32  # bytes of a tree's node: two corners, each with a number
BOX_TEST = 6  # comparisons of two boxes


@dataclass(frozen=True)
class Cost:
    """Bytes moved and operations done."""

    bytes: int
    operations: int

    def __add__(self, other: Cost) -> Cost:
        return Cost(self.bytes + other.bytes, self.operations + other.operations)

    def times(self, count: int) -> Cost:
        return Cost(count * self.bytes, count * self.operations)


def used(columns: np.ndarray) -> int:
    """Entries before the padding of rows (N, width), which repeats the row's own number; its diagonal not counted."""
    return int((columns != np.arange(len(columns))[:, None]).sum())


def pair_count(matrix: PairedMatrix) -> int:
    return min(int(matrix.count.numpy()[0]), len(matrix.ids))


def touched(matrix: PairedMatrix, pairs: int) -> int:
    """How many vertices are in any pair."""
    return len(np.unique(matrix.ids.numpy()[:pairs]))


def product(matrix: PairedMatrix, unknowns: int, directions: int) -> Cost:
    """y = A p and <p, y> over `unknowns` of the vertices; of `directions` 2, p = z + b q is made on the way (linalg/
    pcg_together.py), of 1 it is read (pcg_alone.py)."""
    near, far, pairs = used(matrix.columns.numpy()), used(matrix.far_columns.numpy()), pair_count(matrix)
    made = 6 if directions == 2 else 0  # operations of z + b q
    rows = Cost(near * (WORD + BLOCK) + far * 2 * WORD, near * (made + 21) + far * (made + 9))
    vectors = directions + (2 if directions == 2 else 1)  # read; p, if made, and y written
    own = Cost(unknowns * (VECTOR * (vectors + 1) + WORD), unknowns * (made + 12 + 11))  # with what holds it
    # u = sum w p: 6 each; its answer: 5, 4 and 18 with the sum; <u, f>: 6; added to four: 6 each
    coupled = Cost(pairs * PAIR, pairs * (4 * (made + 6) + 27 + 6 + 24))
    places = 16 if directions == 2 else VECTOR  # a vector of four is added at once
    return rows + own + coupled + Cost(2 * places * touched(matrix, pairs), 0)


def advance(unknowns: int) -> Cost:
    """x += a p, r -= a y, z = D^-1 r, <r, z> and p = z + b p: five vectors read, four of them written, and a block."""
    return Cost(unknowns * (9 * VECTOR + BLOCK), unknowns * (6 + 6 + 15 + 6 + 6))


def contact_blocks(pairs: ContactPairs) -> Cost:
    """Of each pair lam_k^2 (curvature n n^T + beside), added to the blocks of its four vertices."""
    count = min(int(pairs.counters.numpy()[0]), len(pairs.ids))
    vertices = len(np.unique(pairs.ids.numpy()[:count]))
    return Cost(count * PAIR + 2 * BLOCK * vertices, count * (27 + 4 * (1 + 2 * 9)))


def pair_search(own: int, other: int, found: int) -> Cost:
    """`own` triangles asked against a tree of `other`, with `found` answers.

    Which nodes are visited is the tree's business. Counted is what no walk can do without: each node once, a way down
    for each triangle, and its answers.
    """
    triangles = own * (2 * VECTOR + 2 * WORD) + other * (2 * VECTOR + 2 * WORD) + 2 * other * NODE
    down = max(1, math.ceil(math.log2(other)))
    return Cost(triangles + found * 2 * WORD, (own * down + found) * BOX_TEST)


def taking_apart(own: np.ndarray, other: np.ndarray, close: np.ndarray, stencils: int) -> Cost:
    """Pairs `close` (P, 2) of triangles of `own` and `other` (F, 3), of which so many `stencils` are listed.

    Each pair is read, each triangle in any once, each of their vertices, where the search is centred and where it is.
    Of a stencil that is listed its closest points are found; those that are not are not counted.
    """
    first, second = np.unique(close[:, 0]), np.unique(close[:, 1])
    vertices = len(np.unique(np.concatenate([own[first].ravel(), other[second].ravel()])))
    read = len(close) * (2 * WORD + 2 * WORD) + (len(first) + len(second)) * (VECTOR + WORD) + vertices * 2 * VECTOR
    return Cost(read + stencils * LISTED, stencils * CLOSEST_POINTS)


def coupled_unknowns(matrix: PairedMatrix) -> int:
    """How many vertices the iterations run over on a processor: the cloth, and what pairs couple to it."""
    pairs = pair_count(matrix)
    mark = np.zeros(len(matrix.diagonal), bool)
    mark[: len(matrix.columns)] = True
    mark[matrix.ids.numpy()[:pairs].ravel()] = True
    return int(mark.sum())


def random_vectors(count: int, device: str) -> wp.array:
    """(count,) vec3, the same on every run: what is multiplied does not matter, but must not be zero."""
    values = np.random.default_rng(5).standard_normal((count, 3)).astype(np.float32)
    return wp.array(values, dtype=wp.vec3, device=device)
