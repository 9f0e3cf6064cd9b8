"""Stitches as springs: draws the two sides of open seams together while a garment is dressed.

    Psi = k/2 sum_s |x_a - x_b - share d_s|^2,   d_s = x_a - x_b at the start.

All seams close in step, however far apart their sides were, so no part is pulled ahead of the rest. Stitch springs as
in Li et al. 2021 (Codimensional IPC), there with fixed zero length; lowering `share` from 1 to 0 is ours.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.constant_matrices import Term
from tryon_solver.linalg.device_matrix import DeviceMatrix
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import add
from tryon_solver.plan import Contribution
from tryon_solver.scene import Sewing

wp.set_module_options({"enable_backward": False})


@wp.kernel
def add_stitches_kernel(
    stitches: wp.array(dtype=wp.vec2i),
    apart: wp.array(dtype=wp.vec3),
    share: wp.array(dtype=wp.float32),
    stiffness: float,
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    s = wp.tid()
    a = stitches[s][0]
    b = stitches[s][1]
    f = stiffness * (x[a] - x[b] - share[0] * apart[s])
    add(gradient_out, whole, a, f)
    add(gradient_out, whole, b, -f)


def bind(spec: Sewing, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec without stitches is idle."""
    count = len(spec.stitches)
    device, sums, x = context.device, context.sums, context.scene.x_start
    into = sums.vectors
    a, b = spec.stitches[:, 0], spec.stitches[:, 1]
    stitches: wp.array = wp.array(spec.stitches.astype(np.int32), dtype=wp.vec2i, device=device)
    apart: wp.array = wp.array((x[a] - x[b]).astype(np.float32), dtype=wp.vec3, device=device)
    share = wp.ones(1, dtype=wp.float32, device=device)

    def add_gradient(positions: wp.array, gradient: wp.array) -> None:
        launch(
            add_stitches_kernel,
            count,
            [stitches, apart, share, spec.stiffness, positions],
            [gradient, into],
            device=device,
        )
        sums.settle(gradient)

    n = context.scene.garment.vertex_count
    difference = sp.coo_matrix(
        (np.tile([1.0, -1.0], count), (np.repeat(np.arange(count), 2), spec.stitches.ravel())), shape=(count, n)
    ).tocsr()
    return Contribution(
        "sewing",
        add_gradient=add_gradient,
        stiffness=Term(DeviceMatrix.of(spec.stiffness * (difference.T @ difference), device), exact=True),
        values={"share": share},
    )
