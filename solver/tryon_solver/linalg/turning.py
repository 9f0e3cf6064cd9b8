"""What the matrices of cloth answer to its turning as one: along straight ways a turn stretches."""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from tryon_solver.linalg.blocks import BLOCK, whole_blocks
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.paired_matrix import PairedMatrix
from tryon_solver.linalg.vectors import PARTS

wp.set_module_options({"enable_backward": False})


@dataclass
class AsOne:
    """Scratch of moving as one (as_one.py): `resistance` (3,) mat33d to uniform moves [N/m], of these to turns [N] and
    of turns [N m]; `parts` (PARTS,) mat33d N m, of the last, what blocks of threads have of the cloth's matrices;
    `left` (3,) vec3d: force [N] and torque [N m], and then the best move [m] and turn [1], and the centre [m]."""

    resistance: wp.array
    parts: wp.array
    left: wp.array

    @staticmethod
    def allocate(device: str) -> AsOne:
        return AsOne(
            wp.zeros(3, dtype=wp.mat33d, device=device),
            wp.zeros(1 if wp.get_device(device).is_cpu else PARTS, dtype=wp.mat33d, device=device),
            wp.zeros(3, dtype=wp.vec3d, device=device),
        )


@wp.kernel
def resist_in_parts_kernel(
    m: PairedMatrix,
    x: wp.array(dtype=wp.vec3),
    rows: int,
    threads: int,
    parts_out: wp.array(dtype=wp.mat33d),
):
    """parts_out[k] = what block k of threads has of sum_i S_i^T (A S)_i, S_i w = w x r_i, without diagonal and pairs.

    From differences of x, as in a product. A block of the rows is its other row's transposed, and not symmetric.
    """
    thread = wp.tid()
    part = wp.mat33d()
    for i in range(thread, rows, threads):
        here = x[i]
        of_row = wp.mat33()
        for k in range(1, m.columns.shape[1]):
            j = m.columns[i, k]
            if j == i:  # rows that are shorter end with their own number
                break
            of_row += m.blocks[i, k] * wp.skew(here - x[j])
        for k in range(m.far_columns.shape[1]):
            j = m.far_columns[i, k]
            if j == i:
                break
            of_row += m.weights[i, k] * wp.skew(here - x[j])
        part += wp.skew(wp.vec3d(here) - wp.vec3d(x[0])) * wp.mat33d(of_row)
    of_block = wp.tile_sum(wp.tile(part, preserve_type=True))[0]
    if thread % wp.block_dim() == 0:
        parts_out[thread // wp.block_dim()] = of_block


def resist_turning(matrix: PairedMatrix, x: wp.array, moving: int, scratch: AsOne) -> int:
    """What the cloth's matrices answer, of the first `moving` at x (A,) m, into `parts`; how many there are."""
    device, rows = x.device, min(moving, matrix.columns.shape[0])
    on_cpu = wp.get_device(device).is_cpu
    threads, block = (1, 1) if on_cpu else (min(whole_blocks(rows), PARTS * BLOCK), BLOCK)
    given = [matrix, x, rows, threads]
    launch(resist_in_parts_kernel, threads, given, [scratch.parts], block_dim=block, device=device)
    return threads // block
