"""Buttons, hooks, zips: pairs of vertices held together by springs that can be opened.

    Psi = sum_s c_s k/2 max(|x_a - x_b| - L_s, 0)^2,   c_s the pair's value in "closed", from 0, open, to 1

    L_s = max(|x_a - x_b| at the step's start - dt v, 0)

What is apart is drawn together by the way that a hand goes in the step, at the speed v, and what is closed, L = 0, is a
stitch spring as in sewing.py. By springs of that stiffness alone whatever is apart came together in a single step: a
shirt's fronts by 32 cm in 1/30 s, which flings the cloth that they are of. So a pair that is kept apart, because the
garment is too narrow, is pulled with no more than k v dt.

Projective dynamics' matrix is that of the springs, c k (e_a - e_b)(e_a - e_b)^T; the correction has the exact Hessian,
c k ((1 - L/l) I + L/l d d^T) where it pulls, l = |x_a - x_b| and d the direction, between vertices that no triangle
joins. The matrix is made anew at the start of each step and put into the step's matrices (linalg/live_entries.py): a
pair that is open must not be held by a matrix that thinks it is closed. Ours.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.geometry.element_sum import ElementSum
from tryon_solver.linalg.block_ell import BlockRows, add_joined_block
from tryon_solver.linalg.constant_matrices import Term
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import add, add_matrix
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
def draw_together_kernel(
    pairs: wp.array(dtype=wp.vec2i),
    x_start: wp.array(dtype=wp.vec3),
    dt: wp.array(dtype=wp.float32),
    speed: float,
    rest_out: wp.array(dtype=wp.float32),
):
    """m: how far apart each pair may stay in this step."""
    s = wp.tid()
    apart = wp.length(x_start[pairs[s][0]] - x_start[pairs[s][1]])
    rest_out[s] = wp.max(apart - dt[0] * speed, 0.0)


@wp.func
def pulling_share(length: float, rest: float):
    """(l - L)/l, 0 where the spring is slack."""
    share = 1.0
    if rest > 0.0:
        share = 1.0 - rest / wp.max(length, rest)
    return share


@wp.kernel
def add_pull_kernel(
    pairs: wp.array(dtype=wp.vec2i),
    closed: wp.array(dtype=wp.float32),
    rest: wp.array(dtype=wp.float32),
    stiffness: float,
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    s = wp.tid()
    a = pairs[s][0]
    b = pairs[s][1]
    side = x[a] - x[b]
    f = closed[s] * stiffness * pulling_share(wp.length(side), rest[s]) * side
    add(gradient_out, whole, a, f)
    add(gradient_out, whole, b, -f)


@wp.kernel
def hessian_kernel(
    pairs: wp.array(dtype=wp.vec2i),
    closed: wp.array(dtype=wp.float32),
    rest: wp.array(dtype=wp.float32),
    stiffness: float,
    x: wp.array(dtype=wp.vec3),
    columns: wp.array2d(dtype=wp.int32),
    blocks_out: wp.array2d(dtype=wp.mat33),
    on_diagonal_out: wp.array(dtype=wp.mat33),
    whole: wp.array(dtype=wp.int64),
):
    s = wp.tid()
    a = pairs[s][0]
    b = pairs[s][1]
    side = x[a] - x[b]
    length = wp.length(side)
    share = pulling_share(length, rest[s])
    if share > 0.0:
        h = share * wp.identity(n=3, dtype=wp.float32)
        if rest[s] > 0.0:
            d = side / length
            h += (1.0 - share) * wp.outer(d, d)
        h = closed[s] * stiffness * h
        add_matrix(on_diagonal_out, whole, a, h)
        add_matrix(on_diagonal_out, whole, b, h)
        add_joined_block(columns, blocks_out, a, b, -h)
        add_joined_block(columns, blocks_out, b, a, -h)


@wp.kernel
def note_joined_kernel(
    pairs: wp.array(dtype=wp.vec2i),
    closed: wp.array(dtype=wp.float32),
    piece_of: wp.array(dtype=wp.int32),
    touched: wp.array(dtype=wp.int32),
):
    """Who is fastened to another piece now is touched by it."""
    s = wp.tid()
    a = piece_of[pairs[s][0]]
    b = piece_of[pairs[s][1]]
    if closed[s] > 0.0 and a != b:
        touched[a] = 1
        touched[b] = 1


def bind(spec: Fasteners, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec that fastens nothing, or by nothing, is idle."""
    count = len(spec.pairs)
    device, sums = context.device, context.sums
    into, blocks_into = sums.vectors, sums.blocks
    pairs: wp.array = wp.array(spec.pairs.astype(np.int32), dtype=wp.vec2i, device=device)
    closed = wp.ones(count, dtype=wp.float32, device=device)
    rest = wp.zeros(count, dtype=wp.float32, device=device)
    springs = [pairs, closed, rest, spec.stiffness]
    summed = ElementSum.over(spec.pairs, context.scene.garment.vertex_count)
    stiffness = wp.full(count, spec.stiffness, dtype=wp.float64, device=device)
    matrix, make = matrix_over(summed, spring_kernel, [stiffness, closed], device)

    def start_step(state: State) -> None:
        make()
        launch(draw_together_kernel, count, [pairs, state.x_start, state.dt, spec.speed], [rest], device=device)

    def add_gradient(x: wp.array, gradient: wp.array) -> None:
        launch(add_pull_kernel, count, [*springs, x], [gradient, into], device=device)
        sums.settle(gradient)

    def add_hessian(x: wp.array, rows: BlockRows) -> None:
        outputs = [rows.blocks, rows.on_diagonal, blocks_into]
        launch(hessian_kernel, count, [*springs, x, rows.columns], outputs, device=device)
        sums.settle_blocks(rows.on_diagonal)

    def note_joined(piece_of: wp.array, touched: wp.array) -> None:
        launch(note_joined_kernel, count, [pairs, closed, piece_of], [touched], device=device)

    def energy(x: wp.array) -> float:
        a, b = (x.numpy()[spec.pairs[:, k]].astype(np.float64) for k in range(2))
        beyond = np.maximum(np.linalg.norm(a - b, axis=1) - rest.numpy(), 0.0)
        return 0.5 * spec.stiffness * float((closed.numpy() * beyond**2).sum())

    return Contribution(
        "fasteners",
        start_step=start_step,
        add_gradient=add_gradient,
        add_hessian=add_hessian,
        joined=spec.pairs.astype(np.int32),
        note_joined=note_joined,
        stiffness=Term(matrix, live=True),
        energy=energy,
        reshape=make,
        values={"closed": closed},
    )
