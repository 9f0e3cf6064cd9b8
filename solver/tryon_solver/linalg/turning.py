"""What resists all of the cloth moving and turning as one, and what is left to move and turn it: sums, in parts.

Each block of threads has a part of each sum. Sums over vertices are of a fixed order. On a GPU pairs are listed in any
order, and are rounded so that float64 adds them exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from tryon_solver.linalg.blocks import BLOCK, whole_blocks
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.paired_matrix import PairedMatrix, pair_count
from tryon_solver.linalg.vectors import PARTS

wp.set_module_options({"enable_backward": False})

QUANTA = wp.constant(wp.float64(2.0**20))  # in 1 N/m, N or N m: quanta of 1e-6, and exact sums up to 8.6e9

MOVES = wp.constant(0)  # what uniform moves meet,
BOTH = wp.constant(1)  # uniform moves of turns,
TURNS = wp.constant(2)  # turns,
ACROSS = wp.constant(3)  # and uniform moves of pairs' normals alone
LEFT = wp.constant(3)  # of the vertices, rows: the diagonal times r, the residual, its torque
SUMS = 4


@dataclass
class AsOne:
    """Scratch of moving as one: `of_cloth` and `of_pairs` (PARTS, SUMS) mat33d, by the places above: stiffness to
    uniform moves [N/m], to these of turns [N], and to turns [N m]; `found` (3,) vec3d: the best move [m] and turn [1],
    and the centre that is turned about, from x_0 [m]."""

    of_cloth: wp.array
    of_pairs: wp.array
    found: wp.array

    @staticmethod
    def allocate(device: str) -> AsOne:
        parts = (1 if wp.get_device(device).is_cpu else PARTS, SUMS)
        return AsOne(
            wp.zeros(parts, dtype=wp.mat33d, device=device),
            wp.zeros(parts, dtype=wp.mat33d, device=device),
            wp.zeros(3, dtype=wp.vec3d, device=device),
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


@wp.kernel
def sum_cloth_kernel(
    m: PairedMatrix,
    residual: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    moving: int,
    threads: int,
    parts_out: wp.array2d(dtype=wp.mat33d),
):
    """Of the first `moving`: rows and diagonal, and force and torque of the residual."""
    thread = wp.tid()
    origin = wp.vec3d(x[0])
    total = wp.float64(0.0)
    turns = wp.mat33d()
    left = wp.mat33d()
    for i in range(thread, moving, threads):
        d = wp.float64(m.diagonal[i])
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
        parts_out[part, MOVES] = block_total * wp.identity(n=3, dtype=wp.float64)
        parts_out[part, TURNS] = block_turns
        parts_out[part, LEFT] = block_left


@wp.func
def in_quanta(values: wp.mat33d) -> wp.mat33d:
    """Rounded to whole quanta."""
    rounded = wp.mat33d()
    for n in range(3):
        for k in range(3):
            rounded[n, k] = wp.rint(values[n, k] * QUANTA) / QUANTA
    return rounded


@wp.kernel
def sum_pairs_kernel(
    m: PairedMatrix,
    x: wp.array(dtype=wp.vec3),
    moving: int,
    threads: int,
    parts_out: wp.array2d(dtype=wp.mat33d),
):
    """C = curvature n n^T + beside of each pair: with s the sum of its weights over the first `moving` and b that of
    lam_k r_k, the pair meets s c + w x b."""
    thread = wp.tid()
    origin = wp.vec3d(x[0])
    moves = wp.mat33d()
    both = wp.mat33d()
    turns = wp.mat33d()
    across = wp.mat33d()
    for c in range(thread, pair_count(m), threads):
        s = wp.float64(0.0)
        b = wp.vec3d()
        for k in range(4):
            i = m.ids[c][k]
            if i < moving:
                lam = wp.float64(m.lam[c][k])
                s += lam
                b += lam * (wp.vec3d(x[i]) - origin)
        n = wp.vec3d(m.normal[c])
        normal = wp.float64(m.curvature[c]) * wp.outer(n, n)
        own = normal + wp.mat33d(m.beside[c])
        arm = turned(b)
        met = own * arm
        own_moves = s * s * own
        own_both = s * met
        own_turns = wp.transpose(arm) * met
        own_across = s * s * normal
        if threads > 1:
            own_moves = in_quanta(own_moves)
            own_both = in_quanta(own_both)
            own_turns = in_quanta(own_turns)
            own_across = in_quanta(own_across)
        moves += own_moves
        both += own_both
        turns += own_turns
        across += own_across
    block_moves = wp.tile_sum(wp.tile(moves, preserve_type=True))[0]
    block_both = wp.tile_sum(wp.tile(both, preserve_type=True))[0]
    block_turns = wp.tile_sum(wp.tile(turns, preserve_type=True))[0]
    block_across = wp.tile_sum(wp.tile(across, preserve_type=True))[0]
    if thread % wp.block_dim() == 0:
        part = thread // wp.block_dim()
        parts_out[part, MOVES] = block_moves
        parts_out[part, BOTH] = block_both
        parts_out[part, TURNS] = block_turns
        parts_out[part, ACROSS] = block_across


def in_blocks(count: int, device: wp.Device) -> tuple[int, int]:
    """Threads over so many, and how many of them are a block."""
    return (1, 1) if device.is_cpu else (min(whole_blocks(max(count, 1)), PARTS * BLOCK), BLOCK)


def sum_up_as_one(
    matrix: PairedMatrix, residual: wp.array, x: wp.array, moving: int, scratch: AsOne
) -> tuple[int, int]:
    """Both sums' parts, of the first `moving` at x (A,) m, and how many there are of each."""
    device = wp.get_device(x.device)
    threads, block = in_blocks(moving, device)
    given = [matrix, residual, x, moving, threads]
    launch(sum_cloth_kernel, threads, given, [scratch.of_cloth], block_dim=block, device=device)
    of_cloth = threads // block
    threads, block = in_blocks(len(matrix.ids), device)
    launch(sum_pairs_kernel, threads, [matrix, x, moving, threads], [scratch.of_pairs], block_dim=block, device=device)
    return of_cloth, threads // block
