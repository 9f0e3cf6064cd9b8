"""Buttons, hooks, zips: pairs of vertices held together by springs that can be opened.

    Psi = sum_s c_s k/2 |x_a - x_b|^2,   c_s the pair's value in "closed", from 0, open, to 1

Stitch springs as in sewing.py, under tension where cloth keeps off cloth by its thickness. Their matrix c_s k (e_a -
e_b)(e_a - e_b)^T is exact. It is made anew at the start of each step and put into the step's matrices (linalg/
live_entries.py): a pair that is open must not be held by a matrix that thinks it is closed.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.geometry.element_sum import ElementSum
from tryon_solver.linalg.constant_matrices import Term
from tryon_solver.linalg.launch import launch
from tryon_solver.materials.terms import matrix_over
from tryon_solver.plan import Contribution
from tryon_solver.scene import Fasteners
from tryon_solver.state import State

wp.set_module_options({"enable_backward": False})


@wp.kernel
def spring_kernel(
    stiffness: wp.array(dtype=wp.float64),
    closed: wp.array(dtype=wp.float32),
    entries_out: wp.array(dtype=wp.float64),
):
    """N/m: each pair's c k (1, -1; -1, 1)."""
    s = wp.tid()
    w = stiffness[s] * wp.float64(closed[s])
    entries_out[4 * s] = w
    entries_out[4 * s + 1] = -w
    entries_out[4 * s + 2] = -w
    entries_out[4 * s + 3] = w


@wp.kernel
def add_pull_kernel(
    pairs: wp.array(dtype=wp.vec2i),
    closed: wp.array(dtype=wp.float32),
    stiffness: float,
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
):
    s = wp.tid()
    a = pairs[s][0]
    b = pairs[s][1]
    f = closed[s] * stiffness * (x[a] - x[b])
    wp.atomic_add(gradient_out, a, f)
    wp.atomic_add(gradient_out, b, -f)


def bind(spec: Fasteners, context: BuildContext) -> Contribution | None:
    """None when nothing is fastened, or by nothing."""
    count = len(spec.pairs)
    if count == 0 or spec.stiffness == 0:
        return None
    device = context.device
    pairs: wp.array = wp.array(spec.pairs.astype(np.int32), dtype=wp.vec2i, device=device)
    closed = wp.ones(count, dtype=wp.float32, device=device)
    summed = ElementSum.over(spec.pairs, context.scene.garment.vertex_count)
    stiffness = wp.full(count, spec.stiffness, dtype=wp.float64, device=device)
    matrix, make = matrix_over(summed, spring_kernel, [stiffness, closed], device)

    def start_step(_: State) -> None:
        make()

    def add_gradient(x: wp.array, gradient: wp.array) -> None:
        launch(add_pull_kernel, count, [pairs, closed, spec.stiffness, x], [gradient], device=device)

    def energy(x: wp.array) -> float:
        a, b = (x.numpy()[spec.pairs[:, k]].astype(np.float64) for k in range(2))
        return 0.5 * spec.stiffness * float((closed.numpy() * ((a - b) ** 2).sum(axis=1)).sum())

    return Contribution(
        "fasteners",
        start_step=start_step,
        add_gradient=add_gradient,
        stiffness=Term(matrix, exact=True, live=True),
        energy=energy,
        reshape=make,
        values={"closed": closed},
    )
