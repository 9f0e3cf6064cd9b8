"""What resists each piece of cloth moving and turning as one, and what is left to move and turn it: sums, in parts.

Each block of threads has a part of each sum, of one piece. Sums over vertices are of a fixed order. On a GPU pairs are
listed in any order, and are rounded so that float64 adds them exactly.

A pair resists the moves of the piece or the two pieces that its vertices are of, and where it is of two couples them:
of pieces p < q, and of p alone, which is then both,

    (c_p, w_p)^T [[s_p s_q C, s_p C S(b_q)], [S(b_p)^T C s_q, S(b_p)^T C S(b_q)]] (c_q, w_q),

with s the sum of the pair's weights over the piece's vertices and b that of lam_k r_k.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.linalg.blocks import BLOCK, whole_blocks
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.paired_matrix import PairedMatrix, pair_count
from tryon_solver.linalg.pieces import Pieces
from tryon_solver.linalg.vectors import PARTS

wp.set_module_options({"enable_backward": False})

QUANTA = wp.constant(wp.float64(2.0**20))  # in 1 N/m, N or N m: quanta of 1e-6, and exact sums up to 8.6e9

MOVES = wp.constant(0)  # what uniform moves meet,
BOTH = wp.constant(1)  # uniform moves of turns,
TURNS = wp.constant(2)  # turns,
ACROSS = wp.constant(3)  # and of one piece uniform moves of pairs' normals alone;
BACK = wp.constant(3)  # of two, turns of the other one's uniform moves
LEFT = wp.constant(3)  # of the vertices, rows: the diagonal times r, the residual, its torque
SUMS = 4


@dataclass
class AsOne:
    """Scratch of moving the `pieces` (P) as one each: `of_cloth` (P, parts, SUMS) and `of_pairs` (`couples`, parts,
    SUMS) mat33d, by the places above: stiffness to uniform moves [N/m], to these of turns [N], and to turns [N m].

    `couples` are the pieces by themselves, then any two of them (vec2i, the lower first). `found` (P, 3) vec3d: the
    best move [m] and turn [1], and the centre that is turned about, from the piece's first vertex [m]. `solving`
    (P, 8) vec3d: of the pieces together, as in as_one.py.
    """

    pieces: Pieces
    couples: wp.array
    of_cloth: wp.array
    of_pairs: wp.array
    found: wp.array
    solving: wp.array

    @staticmethod
    def allocate(pieces: Pieces, device: str) -> AsOne:
        p, q = np.triu_indices(pieces.count, 1)
        alone = np.arange(pieces.count)
        couples = np.column_stack([np.append(alone, p), np.append(alone, q)]).astype(np.int32)

        def sums(many: int) -> wp.array:
            return wp.zeros((many, parts_of(many, wp.get_device(device)), SUMS), dtype=wp.mat33d, device=device)

        return AsOne(
            pieces,
            wp.array(couples, dtype=wp.vec2i, device=device),
            sums(pieces.count),
            sums(len(couples)),
            wp.zeros((pieces.count, 3), dtype=wp.vec3d, device=device),
            wp.zeros((pieces.count, 8), dtype=wp.vec3d, device=device),
        )


@wp.func
def turned(r: wp.vec3d) -> wp.mat33d:
    """S(r), S(r) w = w x r"""
    return wp.skew(-r)


@wp.func
def row_of_turns(m: PairedMatrix, i: int, x: wp.array(dtype=wp.vec3)) -> wp.mat33:
    """(A S)_i, S_i w = w x r_i, of row i's blocks and weights: from differences of x, as in a product. A block of the
    rows is its other row's transposed, and not symmetric."""
    here = x[i]
    met = wp.mat33()
    if i < m.columns.shape[0]:
        for k in range(1, m.columns.shape[1]):
            j = m.columns[i, k]
            if j == i:  # rows that are shorter end with their own number
                break
            met += m.blocks[i, k] * wp.skew(here - x[j])
        for k in range(m.far_columns.shape[1]):
            j = m.far_columns[i, k]
            if j == i:
                break
            met += m.weights[i, k] * wp.skew(here - x[j])
    return met


@wp.func
def origin_of(
    x: wp.array(dtype=wp.vec3), ordered: wp.array(dtype=wp.int32), starts: wp.array(dtype=wp.int32), p: int
) -> wp.vec3d:
    """Where a piece's first vertex is, from which its r are."""
    return wp.vec3d(x[ordered[starts[p]]])


@wp.kernel
def sum_cloth_kernel(
    m: PairedMatrix,
    diagonal: wp.array(dtype=wp.float32),
    residual: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    ordered: wp.array(dtype=wp.int32),
    starts: wp.array(dtype=wp.int32),
    threads: int,
    parts_out: wp.array3d(dtype=wp.mat33d),
):
    """Of each piece, by `threads`: rows and diagonal, and force and torque of the residual."""
    p = wp.tid() // threads
    thread = wp.tid() % threads
    origin = origin_of(x, ordered, starts, p)
    total = wp.float64(0.0)
    turns = wp.mat33d()
    left = wp.mat33d()
    for a in range(starts[p] + thread, starts[p + 1], threads):
        i = ordered[a]
        d = wp.float64(diagonal[i])
        r = wp.vec3d(x[i]) - origin
        f = wp.vec3d(residual[i])
        torque = wp.cross(r, f)
        total += d
        arm = turned(r)
        turns += wp.transpose(arm) * (d * arm + wp.mat33d(row_of_turns(m, i, x)))
        for k in range(3):
            left[0, k] = left[0, k] + d * r[k]
            left[1, k] = left[1, k] + f[k]
            left[2, k] = left[2, k] + torque[k]
    block_total = wp.tile_sum(wp.tile(total))[0]
    block_turns = wp.tile_sum(wp.tile(turns, preserve_type=True))[0]
    block_left = wp.tile_sum(wp.tile(left, preserve_type=True))[0]
    if thread % wp.block_dim() == 0:
        part = thread // wp.block_dim()
        parts_out[p, part, MOVES] = block_total * wp.identity(n=3, dtype=wp.float64)
        parts_out[p, part, TURNS] = block_turns
        parts_out[p, part, LEFT] = block_left


@wp.func
def in_quanta(values: wp.mat33d) -> wp.mat33d:
    """Rounded to whole quanta."""
    rounded = wp.mat33d()
    for n in range(3):
        for k in range(3):
            rounded[n, k] = wp.rint(values[n, k] * QUANTA) / QUANTA
    return rounded


@wp.func
def pieces_of_pair(m: PairedMatrix, c: int, of_vertex: wp.array(dtype=wp.int32)) -> wp.vec2i:
    """The two pieces that pair c is of, the lower first, or one twice; -1 where it is of none. It is of no more, since
    each of its two sides, a vertex, an edge or a triangle, is of one."""
    least = int(-1)
    most = int(-1)
    for k in range(4):
        i = m.ids[c][k]
        if i < of_vertex.shape[0]:
            p = of_vertex[i]
            if least < 0:
                least = p
            least = wp.min(least, p)
            most = wp.max(most, p)
    return wp.vec2i(least, most)


@wp.func
def share_of_pair(
    m: PairedMatrix,
    c: int,
    x: wp.array(dtype=wp.vec3),
    of_vertex: wp.array(dtype=wp.int32),
    p: int,
    origin: wp.vec3d,
) -> wp.vec4d:
    """b and s of pair c and piece p."""
    s = wp.float64(0.0)
    b = wp.vec3d()
    for k in range(4):
        i = m.ids[c][k]
        if i < of_vertex.shape[0] and of_vertex[i] == p:
            lam = wp.float64(m.lam[c][k])
            s += lam
            b += lam * (wp.vec3d(x[i]) - origin)
    return wp.vec4d(b[0], b[1], b[2], s)


@wp.func
def across_of(m: PairedMatrix, c: int) -> wp.mat33d:
    """What pair c has across: curvature n n^T"""
    n = wp.vec3d(m.normal[c])
    return wp.float64(m.curvature[c]) * wp.outer(n, n)


@wp.func
def arm_of(share: wp.vec4d) -> wp.mat33d:
    return turned(wp.vec3d(share[0], share[1], share[2]))


@wp.kernel
def sum_pairs_alone_kernel(
    m: PairedMatrix,
    x: wp.array(dtype=wp.vec3),
    of_vertex: wp.array(dtype=wp.int32),
    ordered: wp.array(dtype=wp.int32),
    starts: wp.array(dtype=wp.int32),
    sums_out: wp.array3d(dtype=wp.mat33d),
):
    """All of them by one thread."""
    pieces = starts.shape[0] - 1
    for place in range(sums_out.shape[0]):
        for k in range(SUMS):
            sums_out[place, 0, k] = wp.mat33d()
    for c in range(pair_count(m)):
        both = pieces_of_pair(m, c, of_vertex)
        p = both[0]
        if p >= 0:
            q = both[1]
            across = across_of(m, c)
            own = across + wp.mat33d(m.beside[c])
            of_p = share_of_pair(m, c, x, of_vertex, p, origin_of(x, ordered, starts, p))
            arm = arm_of(of_p)
            s = of_p[3]
            met = own * arm
            sums_out[p, 0, MOVES] = sums_out[p, 0, MOVES] + s * s * own
            sums_out[p, 0, BOTH] = sums_out[p, 0, BOTH] + s * met
            sums_out[p, 0, TURNS] = sums_out[p, 0, TURNS] + wp.transpose(arm) * met
            sums_out[p, 0, ACROSS] = sums_out[p, 0, ACROSS] + s * s * across
            if q > p:
                of_q = share_of_pair(m, c, x, of_vertex, q, origin_of(x, ordered, starts, q))
                other = arm_of(of_q)
                t = of_q[3]
                met = own * other
                sums_out[q, 0, MOVES] = sums_out[q, 0, MOVES] + t * t * own
                sums_out[q, 0, BOTH] = sums_out[q, 0, BOTH] + t * met
                sums_out[q, 0, TURNS] = sums_out[q, 0, TURNS] + wp.transpose(other) * met
                sums_out[q, 0, ACROSS] = sums_out[q, 0, ACROSS] + t * t * across
                n = couple(pieces, p, q)
                sums_out[n, 0, MOVES] = sums_out[n, 0, MOVES] + s * t * own
                sums_out[n, 0, BOTH] = sums_out[n, 0, BOTH] + s * met
                sums_out[n, 0, TURNS] = sums_out[n, 0, TURNS] + wp.transpose(arm) * met
                sums_out[n, 0, BACK] = sums_out[n, 0, BACK] + t * (wp.transpose(arm) * own)


@wp.func
def couple(pieces: int, p: int, q: int) -> int:
    """The place of pieces p < q in `couples`."""
    return pieces + p * pieces - (p * (p + 1)) // 2 + q - p - 1


@wp.kernel
def sum_pairs_kernel(
    m: PairedMatrix,
    x: wp.array(dtype=wp.vec3),
    of_vertex: wp.array(dtype=wp.int32),
    ordered: wp.array(dtype=wp.int32),
    starts: wp.array(dtype=wp.int32),
    couples: wp.array(dtype=wp.vec2i),
    threads: int,
    parts_out: wp.array3d(dtype=wp.mat33d),
):
    """Of each of `couples`, by `threads`."""
    number = wp.tid() // threads
    thread = wp.tid() % threads
    p = couples[number][0]
    q = couples[number][1]
    from_p = origin_of(x, ordered, starts, p)
    from_q = origin_of(x, ordered, starts, q)
    moves = wp.mat33d()
    both = wp.mat33d()
    turns = wp.mat33d()
    fourth = wp.mat33d()
    for c in range(thread, pair_count(m), threads):
        of = pieces_of_pair(m, c, of_vertex)
        if (of[0] == p or of[1] == p) and (of[0] == q or of[1] == q):
            across = across_of(m, c)
            own = across + wp.mat33d(m.beside[c])
            of_p = share_of_pair(m, c, x, of_vertex, p, from_p)
            of_q = share_of_pair(m, c, x, of_vertex, q, from_q)
            arm = arm_of(of_p)
            met = own * arm_of(of_q)
            moves += in_quanta(of_p[3] * of_q[3] * own)
            both += in_quanta(of_p[3] * met)
            turns += in_quanta(wp.transpose(arm) * met)
            if p == q:
                fourth += in_quanta(of_p[3] * of_q[3] * across)
            else:
                fourth += in_quanta(of_q[3] * (wp.transpose(arm) * own))
    block_moves = wp.tile_sum(wp.tile(moves, preserve_type=True))[0]
    block_both = wp.tile_sum(wp.tile(both, preserve_type=True))[0]
    block_turns = wp.tile_sum(wp.tile(turns, preserve_type=True))[0]
    block_fourth = wp.tile_sum(wp.tile(fourth, preserve_type=True))[0]
    if thread % wp.block_dim() == 0:
        part = thread // wp.block_dim()
        parts_out[number, part, MOVES] = block_moves
        parts_out[number, part, BOTH] = block_both
        parts_out[number, part, TURNS] = block_turns
        parts_out[number, part, ACROSS] = block_fourth


def parts_of(many: int, device: wp.Device) -> int:
    """Into how many parts each of so many sums is taken at most."""
    return 1 if device.is_cpu else max(PARTS // many, 1)


def in_blocks(count: int, parts: int, device: wp.Device) -> tuple[int, int]:
    """Threads over so many, in as many blocks as there are `parts` at most, and how many of them are a block."""
    return (1, 1) if device.is_cpu else (min(whole_blocks(max(count, 1)), parts * BLOCK), BLOCK)


def sum_up_as_one(
    matrix: PairedMatrix, diagonal: wp.array, residual: wp.array, x: wp.array, scratch: AsOne
) -> tuple[int, int]:
    """Both sums' parts, at x (A,) m, and how many there are of each."""
    device, pieces = wp.get_device(x.device), scratch.pieces
    threads, block = in_blocks(pieces.largest, scratch.of_cloth.shape[1], device)
    given = [matrix, diagonal, residual, x, pieces.ordered, pieces.starts, threads]
    many = threads * pieces.count
    launch(sum_cloth_kernel, many, given, [scratch.of_cloth], block_dim=block, device=device)
    of_cloth = threads // block
    threads, block = in_blocks(len(matrix.ids), scratch.of_pairs.shape[1], device)
    given = [matrix, x, pieces.of_vertex, pieces.ordered, pieces.starts]
    if threads == 1:
        launch(sum_pairs_alone_kernel, 1, given, [scratch.of_pairs], block_dim=block, device=device)
    else:
        given += [scratch.couples, threads]
        many = threads * len(scratch.couples)
        launch(sum_pairs_kernel, many, given, [scratch.of_pairs], block_dim=block, device=device)
    return of_cloth, threads // block
