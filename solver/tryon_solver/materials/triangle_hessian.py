"""The Hessian of what the triangles store: summed over their deformation gradients, then into 3x3 blocks.

With F = [f_u f_v] = sum_i x_i g_i^T the deformation gradient of a triangle and g_i = (g_iu, g_iv) the pattern
gradients of its corners, a Hessian over dF, d_u^T h_uu d_u + 2 d_u^T h_uv d_v + d_v^T h_vv d_v, is one over the
corners, whose block (i, j) is

    g_iu (g_ju h_uu + g_jv h_uv) + g_iv (g_ju h_uv^T + g_jv h_vv).

What has to do with a triangle's stretch adds its own to that triangle's, each thread to one place. On a GPU each block
of the mesh then gathers what its triangles have for it, in fixed order: nothing is added by two threads at once, which
for 81 numbers a triangle took longer than to find them. On a CPU, where threads are none, triangles hand out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.geometry.connectivity import Connectivity
from tryon_solver.geometry.element_sum import stable_order
from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.linalg.launch import launch
from tryon_solver.materials.device import RestShape

wp.set_module_options({"enable_backward": False})


@wp.func
def add_over_gradient(
    hessians: wp.array2d(dtype=wp.mat33), t: int, h_uu: wp.mat33, h_uv: wp.mat33, h_vv: wp.mat33
):
    """Adds a Hessian over dF to that of triangle t."""
    hessians[t, 0] = hessians[t, 0] + h_uu
    hessians[t, 1] = hessians[t, 1] + h_uv
    hessians[t, 2] = hessians[t, 2] + h_vv


@wp.kernel
def gather_blocks_kernel(
    order: wp.array(dtype=wp.int32),
    starts: wp.array(dtype=wp.int32),
    gradients: wp.array2d(dtype=wp.vec2),
    hessians: wp.array2d(dtype=wp.mat33),
    near: wp.array2d(dtype=wp.float32),
    blocks_out: wp.array2d(dtype=wp.mat33),
):
    """`near` times the identity, and what the triangles have for each block."""
    i, k = wp.tid()
    place = i * near.shape[1] + k
    total = near[i, k] * wp.identity(n=3, dtype=wp.float32)
    for e in range(starts[place], starts[place + 1]):
        t = order[e] // 9
        pair = order[e] - 9 * t
        g = gradients[t, pair // 3]
        q = gradients[t, pair % 3]
        h_uv = hessians[t, 1]
        total += g[0] * (q[0] * hessians[t, 0] + q[1] * h_uv)
        total += g[1] * (q[0] * wp.transpose(h_uv) + q[1] * hessians[t, 2])
    blocks_out[i, k] = total


@wp.kernel
def start_blocks_kernel(near: wp.array2d(dtype=wp.float32), blocks_out: wp.array2d(dtype=wp.mat33)):
    """`near` times the identity."""
    i, k = wp.tid()
    blocks_out[i, k] = near[i, k] * wp.identity(n=3, dtype=wp.float32)


@wp.kernel
def hand_out_kernel(
    faces: wp.array(dtype=wp.vec3i),
    slots: wp.array2d(dtype=wp.int32),
    gradients: wp.array2d(dtype=wp.vec2),
    hessians: wp.array2d(dtype=wp.mat33),
    blocks: wp.array2d(dtype=wp.mat33),
):
    """Adds what the triangle has for its nine blocks, which nobody else adds to meanwhile: for one thread."""
    t = wp.tid()
    h_uv = hessians[t, 1]
    h_vu = wp.transpose(h_uv)
    for i in range(3):
        g = gradients[t, i]
        row = faces[t][i]
        for j in range(3):
            q = gradients[t, j]
            k = slots[t, 3 * i + j]
            of_u = g[0] * (q[0] * hessians[t, 0] + q[1] * h_uv)  # rounded as where they are gathered
            of_v = g[1] * (q[0] * h_vu + q[1] * hessians[t, 2])
            blocks[row, k] = blocks[row, k] + of_u + of_v


@dataclass(frozen=True)
class TriangleHessian:
    """`hessians` (F, 3) mat33 N m, of each triangle h_uu, h_uv and h_vv. `places`, of a GPU: `order` (9 F,) int32 and
    `starts` int32: into block k of N x width blocks, row by row, go `order[starts[k] : starts[k + 1]]`, each 9 t + 3 i
    + j for the corners i and j of triangle t, ascending. None where triangles hand out."""

    rest: RestShape
    hessians: wp.array
    places: tuple[wp.array, wp.array] | None

    @staticmethod
    def build(rest: RestShape, connectivity: Connectivity, width: int) -> TriangleHessian:
        """Of the triangles of `connectivity`, for rows of `width` blocks, the first of which are its `pairs`."""
        device = rest.faces.device
        if wp.get_device(device).is_cpu:
            return TriangleHessian(rest, hessians_of(rest), None)
        _, slots = connectivity.pairs
        rows = np.repeat(connectivity.faces, 3, axis=1)
        blocks, count = (rows.astype(np.int64) * width + slots).ravel(), connectivity.count * width
        starts = np.concatenate([[0], np.cumsum(np.bincount(blocks, minlength=count))])
        order: wp.array = wp.array(stable_order(blocks, count), dtype=wp.int32, device=device)
        return TriangleHessian(
            rest, hessians_of(rest), (order, wp.array(starts, dtype=wp.int32, device=device))
        )

    def sum_up(self, near: wp.array, rows: BlockRows) -> None:
        """Let the rows' blocks [N/m] be those of all triangles, with `near` (N, width) N/m times the identity."""
        rest, blocks = self.rest, rows.blocks
        if self.places is not None:
            inputs = [*self.places, rest.gradients, self.hessians, near]
            launch(gather_blocks_kernel, blocks.shape, inputs, [blocks], device=blocks.device)
            return
        launch(start_blocks_kernel, blocks.shape, [near], [blocks], device=blocks.device)
        inputs = [rest.faces, rows.slots, rest.gradients, self.hessians]
        launch(hand_out_kernel, rest.face_count, inputs, [blocks], device=blocks.device)


def hessians_of(rest: RestShape) -> wp.array:
    """(F, 3) mat33, of zero."""
    return wp.zeros((rest.face_count, 3), dtype=wp.mat33, device=rest.faces.device)
