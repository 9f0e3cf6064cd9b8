"""Elastic along lines of the cloth: waistbands, belts, shirring threads, drawstrings.

    Psi = sum_e k/(2 L_e) max(l_e - r L_e, 0)^2

over the line's edges, L_e their lengths in the pattern, l_e in space, r the line's ratio, k [N] its stiffness: under
way it pulls with k (l/L - r), at most; shorter than r L it is slack, as a thread is. It is sewn on: each piece of it
keeps to its piece of cloth, and tension differs along it where friction holds the cloth.

Projective dynamics' matrix is that of the springs, sum k/L_e (e_a - e_b)(e_a - e_b)^T; the correction has the exact
Hessian, k/L ((1 - r L/l) I + r L/l d d^T) where it pulls, which is semidefinite. Springs as projections: Liu et al.
2013; lines that pull only, ours.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.geometry.element_sum import ElementSum
from tryon_solver.geometry.lines import corners_of_edges
from tryon_solver.linalg.block_ell import BlockRows, add_block
from tryon_solver.linalg.constant_matrices import Term
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import add, add_matrix
from tryon_solver.materials.terms import matrix_over
from tryon_solver.plan import Contribution
from tryon_solver.scene import Elastic

wp.set_module_options({"enable_backward": False})


@wp.func
def length_in_pattern(flat: wp.array(dtype=wp.vec2d), corners: wp.vec2i) -> wp.float64:
    """m, between two corners of one triangle."""
    return wp.length(flat[corners[1]] - flat[corners[0]])


@wp.kernel
def spring_kernel(
    flat: wp.array(dtype=wp.vec2d),
    corners: wp.array(dtype=wp.vec2i),
    stiffness: wp.array(dtype=wp.float64),
    entries_out: wp.array(dtype=wp.float64),
):
    """N/m: each edge's k/L (1, -1; -1, 1)."""
    e = wp.tid()
    w = stiffness[e] / length_in_pattern(flat, corners[e])
    entries_out[4 * e] = w
    entries_out[4 * e + 1] = -w
    entries_out[4 * e + 2] = -w
    entries_out[4 * e + 3] = w


@wp.kernel
def measure_kernel(
    flat: wp.array(dtype=wp.vec2d), corners: wp.array(dtype=wp.vec2i), length_out: wp.array(dtype=wp.float32)
):
    e = wp.tid()
    length_out[e] = wp.float32(length_in_pattern(flat, corners[e]))


@wp.func
def excess(x: wp.array(dtype=wp.vec3), edge: wp.vec2i, unstrained: float):
    """The way along the edge, its length, and how much longer that is than `unstrained` [m]."""
    side = x[edge[0]] - x[edge[1]]
    length = wp.length(side)
    return side, length, wp.max(length - unstrained, 0.0)


@wp.kernel
def add_pull_kernel(
    edges: wp.array(dtype=wp.vec2i),
    lines: wp.array(dtype=wp.int32),
    ratio: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.float64),
    rest: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    e = wp.tid()
    side, length, over = excess(x, edges[e], ratio[lines[e]] * rest[e])
    if over > 0.0:
        f = (wp.float32(stiffness[e]) / rest[e] * over / length) * side
        add(gradient_out, whole, edges[e][0], f)
        add(gradient_out, whole, edges[e][1], -f)


@wp.kernel
def energy_kernel(
    edges: wp.array(dtype=wp.vec2i),
    lines: wp.array(dtype=wp.int32),
    ratio: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.float64),
    rest: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    energy_out: wp.array(dtype=wp.float32),
):
    """Psi per edge [J]."""
    e = wp.tid()
    _side, _length, over = excess(x, edges[e], ratio[lines[e]] * rest[e])
    energy_out[e] = 0.5 * wp.float32(stiffness[e]) / rest[e] * over * over


@wp.kernel
def hessian_kernel(
    edges: wp.array(dtype=wp.vec2i),
    corners: wp.array(dtype=wp.vec2i),
    lines: wp.array(dtype=wp.int32),
    ratio: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.float64),
    rest: wp.array(dtype=wp.float32),
    slots: wp.array2d(dtype=wp.int32),
    x: wp.array(dtype=wp.vec3),
    blocks_out: wp.array2d(dtype=wp.mat33),
    on_diagonal_out: wp.array(dtype=wp.mat33),
    whole: wp.array(dtype=wp.int64),
):
    e = wp.tid()
    edge = edges[e]
    side, length, over = excess(x, edge, ratio[lines[e]] * rest[e])
    if over > 0.0:
        d = side / length
        share = over / length
        h = (wp.float32(stiffness[e]) / rest[e]) * (
            share * wp.identity(n=3, dtype=wp.float32) + (1.0 - share) * wp.outer(d, d)
        )
        t = corners[e][0] // 3
        a = corners[e][0] % 3
        b = corners[e][1] % 3
        add_matrix(on_diagonal_out, whole, edge[0], h)
        add_matrix(on_diagonal_out, whole, edge[1], h)
        add_block(blocks_out, slots, t, a, b, edge[0], -h)
        add_block(blocks_out, slots, t, b, a, edge[1], -h)


def bind(spec: Elastic, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec of which no line pulls is idle."""
    device, garment, rest, sums = context.device, context.scene.garment, context.rest, context.sums
    into, blocks_into = sums.vectors, sums.blocks
    together = np.vstack([line.edges for line in spec.lines]).astype(np.int32)
    counts = [len(line.edges) for line in spec.lines]
    number = np.repeat(np.arange(len(spec.lines)), counts)
    ends: wp.array = wp.array(corners_of_edges(garment, together, "elastic"), dtype=wp.vec2i, device=device)
    edges: wp.array = wp.array(together, dtype=wp.vec2i, device=device)
    lines: wp.array = wp.array(number, dtype=wp.int32, device=device)
    ratio: wp.array = wp.array([line.ratio for line in spec.lines], dtype=wp.float32, device=device)
    of_edge = np.array([line.stiffness for line in spec.lines])[number]
    stiffness: wp.array = wp.array(of_edge, dtype=wp.float64, device=device)
    length = wp.zeros(len(together), dtype=wp.float32, device=device)
    energies = wp.zeros(len(together), dtype=wp.float32, device=device)
    springs = [lines, ratio, stiffness, length]
    summed = ElementSum.over(together, garment.vertex_count)
    matrix, make = matrix_over(summed, spring_kernel, [rest.flat, ends, stiffness], device)

    def reshape() -> None:
        make()
        launch(measure_kernel, len(length), [rest.flat, ends], [length], device=device)

    def add_gradient(x: wp.array, gradient: wp.array) -> None:
        launch(add_pull_kernel, len(length), [edges, *springs, x], [gradient, into], device=device)
        sums.settle(gradient)

    def add_hessian(x: wp.array, rows: BlockRows) -> None:
        inputs = [edges, ends, *springs, rows.slots, x]
        outputs = [rows.blocks, rows.on_diagonal, blocks_into]
        launch(hessian_kernel, len(length), inputs, outputs, device=device)
        sums.settle_blocks(rows.on_diagonal)

    def energy(x: wp.array) -> float:
        launch(energy_kernel, len(length), [edges, *springs, x], [energies], device=device)
        return float(energies.numpy().sum(dtype=np.float64))

    return Contribution(
        "elastic",
        add_gradient=add_gradient,
        add_hessian=add_hessian,
        stiffness=Term(matrix),
        energy=energy,
        reshape=reshape,
        values={"ratio": ratio},
    )
