"""Stitches that hold a piece of cloth on the cloth beneath it: a pocket, a patch.

    Psi = k/2 sum_s |x_v - sum_j w_j x_j|^2

A stitch springs as in sewing.py, from a vertex to a place within a triangle. Cloth keeps off cloth by its thickness, so
stitches stay under tension and press the layers together. Ours.
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
from tryon_solver.scene import Attached

wp.set_module_options({"enable_backward": False})


@wp.kernel
def add_attached_kernel(
    vertices: wp.array(dtype=wp.int32),
    onto: wp.array(dtype=wp.vec3i),
    weights: wp.array(dtype=wp.vec3),
    stiffness: float,
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    s = wp.tid()
    v = vertices[s]
    ids = onto[s]
    w = weights[s]
    f = stiffness * (w[0] * (x[v] - x[ids[0]]) + w[1] * (x[v] - x[ids[1]]) + w[2] * (x[v] - x[ids[2]]))
    add(gradient_out, whole, v, f)
    for k in range(3):
        add(gradient_out, whole, ids[k], -w[k] * f)


def bind(spec: Attached, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec that attaches nothing is idle."""
    count = len(spec.vertices)
    device, sums = context.device, context.sums
    into = sums.vectors
    vertices: wp.array = wp.array(spec.vertices.astype(np.int32), dtype=wp.int32, device=device)
    onto: wp.array = wp.array(spec.onto.astype(np.int32), dtype=wp.vec3i, device=device)
    weights: wp.array = wp.array(spec.weights.astype(np.float32), dtype=wp.vec3, device=device)

    def add_gradient(positions: wp.array, gradient: wp.array) -> None:
        launch(
            add_attached_kernel,
            count,
            [vertices, onto, weights, spec.stiffness, positions],
            [gradient, into],
            device=device,
        )
        sums.settle(gradient)

    n = context.scene.garment.vertex_count
    values = np.column_stack([np.ones(count), -spec.weights])
    ids = np.column_stack([spec.vertices, spec.onto])
    rows = np.repeat(np.arange(count), 4)
    difference = sp.coo_matrix((values.ravel(), (rows, ids.ravel())), shape=(count, n)).tocsr()
    return Contribution(
        "attached",
        add_gradient=add_gradient,
        stiffness=Term(DeviceMatrix.of(spec.stiffness * (difference.T @ difference), device), exact=True),
    )
