"""Conjugate gradients as one kernel of one thread: for the processor.

There an iteration's nine launches would take as long as its arithmetic for a thousand vertices. In one kernel there is
one, products and their sums are made in one pass, sums are float64 in a fixed order, and unknowns that nothing couples
to others, most of a body's, are solved for at once and left out.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.paired_matrix import PairedMatrix, pair_count, pair_force, row_product
from tryon_solver.linalg.pcg_together import TAKEN

wp.set_module_options({"enable_backward": False})


@wp.kernel
def solve_kernel(
    m: PairedMatrix,
    inverse: wp.array(dtype=wp.mat33),
    gradient: wp.array(dtype=wp.vec3),
    at_most: int,
    tolerance: float,
    coupled: wp.array(dtype=wp.int32),
    solution: wp.array(dtype=wp.vec3),
    residual: wp.array(dtype=wp.vec3),
    preconditioned: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    product: wp.array(dtype=wp.vec3),
    first_out: wp.array(dtype=wp.float32),
    state: wp.array(dtype=wp.int32),
):
    """`coupled` (A,) holds, one by one, the unknowns that are iterated on."""
    pairs = pair_count(m)
    for i in range(coupled.shape[0]):
        coupled[i] = 0
    for c in range(pairs):
        for k in range(4):
            coupled[m.ids[c][k]] = 1
    first = wp.float64(0.0)
    squared = wp.float64(0.0)
    unknowns = int(0)
    for i in range(inverse.shape[0]):
        r = -gradient[i]
        z = inverse[i] * r
        part = wp.float64(wp.dot(r, z))
        first += part
        if i < m.columns.shape[0] or coupled[i] == 1:
            squared += part
            coupled[unknowns] = i
            unknowns += 1
            solution[i] = wp.vec3()
            residual[i] = r
            direction[i] = z
        else:
            solution[i] = z
            residual[i] = wp.vec3()
    enough = wp.float64(tolerance) * wp.float64(tolerance) * first
    iterations = int(0)
    while iterations < at_most and squared > enough:
        curvature = wp.float64(0.0)
        for a in range(unknowns):
            i = coupled[a]
            row = row_product(m, i, direction)
            product[i] = row
            curvature += wp.float64(wp.dot(direction[i], row))
        for c in range(pairs):
            v = m.ids[c]
            w = m.lam[c]
            u = w[0] * direction[v[0]] + w[1] * direction[v[1]] + w[2] * direction[v[2]] + w[3] * direction[v[3]]
            f = pair_force(m, c, u)
            curvature += wp.float64(wp.dot(u, f))
            for k in range(4):
                product[v[k]] = product[v[k]] + w[k] * f
        step = float(0.0)
        if curvature > wp.float64(0.0):
            step = float(squared / curvature)
        before = squared
        squared = wp.float64(0.0)
        for a in range(unknowns):
            i = coupled[a]
            solution[i] = solution[i] + step * direction[i]
            r = residual[i] - step * product[i]
            z = inverse[i] * r
            residual[i] = r
            preconditioned[i] = z
            squared += wp.float64(wp.dot(r, z))
        turn = float(squared / before)
        for a in range(unknowns):
            i = coupled[a]
            direction[i] = preconditioned[i] + turn * direction[i]
        iterations += 1
    first_out[0] = float(first)
    state[TAKEN] = iterations
