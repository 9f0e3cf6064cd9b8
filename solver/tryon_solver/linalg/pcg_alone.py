"""Conjugate gradients as one kernel of one thread: for the processor.

There an iteration's nine launches would take as long as its arithmetic for a thousand vertices. In one kernel there is
one, products and their sums are made in one pass, sums are float64 in a fixed order, and unknowns that nothing couples
to others, most of a body's, are solved for at once and left out. What it multiplies by are vectors of four numbers,
the last zero, which a processor takes at once, as it does a row of a block beside the next row's beginning.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.cholesky import solve_factored
from tryon_solver.linalg.paired_matrix import PairedMatrix, held_product, pair_count, pair_force
from tryon_solver.linalg.pcg_together import TAKEN

wp.set_module_options({"enable_backward": False})


@wp.func_native("""
    typedef decltype(p.data[0][0] + 0) number;
#if defined(__CUDA_ARCH__)
    return wp::vec_t<4, number>();  // it is never launched there
#else
    // of Clang, which Warp compiles with
    typedef number four __attribute__((vector_size(4 * sizeof(number)), aligned(sizeof(number))));
    const number* vectors = reinterpret_cast<const number*>(p.data);
    const four here = *reinterpret_cast<const four*>(vectors + 4 * i);
    four total = diagonal.data[i] * here;
    if (i < columns.shape[0]) {
        four first = {}, second = {}, third = {};
        const int* column = &wp::index(columns, i, 0);
        const number* block = reinterpret_cast<const number*>(&wp::index(blocks, i, 0));
        for (int k = 1; k < columns.shape[1] && column[k] != i; ++k) {
            block += 9;
            const four u = *reinterpret_cast<const four*>(vectors + 4 * column[k]) - here;
            first += *reinterpret_cast<const four*>(block) * u;
            second += *reinterpret_cast<const four*>(block + 3) * u;
            // the last from one number before it: what lies behind a block may be no memory of ours
            third += *reinterpret_cast<const four*>(block + 5) * __builtin_shufflevector(u, u, 3, 0, 1, 2);
        }
        column = &wp::index(far_columns, i, 0);
        const number* weight = &wp::index(weights, i, 0);
        for (int k = 0; k < far_columns.shape[1] && column[k] != i; ++k)
            total += weight[k] * (*reinterpret_cast<const four*>(vectors + 4 * column[k]) - here);
        total[0] += first[0] + first[1] + first[2];
        total[1] += second[0] + second[1] + second[2];
        total[2] += third[1] + third[2] + third[3];
    }
    return wp::vec_t<4, number>(total[0], total[1], total[2], number(0));
#endif
""")
def product_of_rows(  # type: ignore[empty-body]
    columns: wp.array2d(dtype=wp.int32),
    blocks: wp.array2d(dtype=wp.mat33),
    far_columns: wp.array2d(dtype=wp.int32),
    weights: wp.array2d(dtype=wp.float32),
    diagonal: wp.array(dtype=wp.float32),
    i: int,
    p: wp.array(dtype=wp.vec4),
) -> wp.vec4:
    """Row i of all but the pairs of a PairedMatrix, times p, whose fourth numbers are zero; rows that are shorter end
    with their own number.

    From differences of p, since a row's blocks sum to zero: a move as one would else cost the digits by which they
    exceed the diagonal, all there are where the cloth is stiff and light.
    """


@wp.func
def row_product(m: PairedMatrix, i: int, p: wp.array(dtype=wp.vec4)) -> wp.vec4:
    """Row i of all but the pairs, times p."""
    return product_of_rows(m.columns, m.blocks, m.far_columns, m.weights, m.diagonal, i, p)


@wp.func
def with_zero(v: wp.vec3) -> wp.vec4:
    return wp.vec4(v[0], v[1], v[2], 0.0)


@wp.func
def without_zero(v: wp.vec4) -> wp.vec3:
    return wp.vec3(v[0], v[1], v[2])


@wp.func
def add_moves_as_one(
    of: wp.array(dtype=wp.int32),
    factor: wp.array2d(dtype=wp.float64),
    residual: wp.array(dtype=wp.vec3),
    moves: wp.array(dtype=wp.float64),
    preconditioned: wp.array(dtype=wp.vec3),
) -> wp.float64:
    """z += P S^-1 P^T r (aggregates.py); returns what that adds to <r, z>."""
    for n in range(moves.shape[0]):
        moves[n] = wp.float64(0.0)
    for i in range(of.shape[0]):
        r = residual[i]
        for n in range(3):
            moves[3 * of[i] + n] += wp.float64(r[n])
    solve_factored(factor, moves)
    added = wp.float64(0.0)
    for i in range(of.shape[0]):
        a = 3 * of[i]
        move = wp.vec3(float(moves[a]), float(moves[a + 1]), float(moves[a + 2]))
        preconditioned[i] = preconditioned[i] + move
        added += wp.float64(wp.dot(residual[i], move))
    return added


@wp.kernel
def solve_kernel(
    m: PairedMatrix,
    inverse: wp.array(dtype=wp.mat33),
    gradient: wp.array(dtype=wp.vec3),
    at_most: int,
    tolerance: float,
    of: wp.array(dtype=wp.int32),
    factor: wp.array2d(dtype=wp.float64),
    moves: wp.array(dtype=wp.float64),
    coupled: wp.array(dtype=wp.int32),
    solution: wp.array(dtype=wp.vec3),
    residual: wp.array(dtype=wp.vec3),
    preconditioned: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec4),
    product: wp.array(dtype=wp.vec4),
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
            preconditioned[i] = z
        else:
            solution[i] = z
            residual[i] = wp.vec3()
    squared += add_moves_as_one(of, factor, residual, moves, preconditioned)
    for a in range(unknowns):
        direction[coupled[a]] = with_zero(preconditioned[coupled[a]])
    enough = wp.float64(tolerance) * wp.float64(tolerance) * first
    iterations = int(0)
    while iterations < at_most and squared > enough:
        curvature = wp.float64(0.0)
        for a in range(unknowns):
            i = coupled[a]
            row = row_product(m, i, direction)
            row += with_zero(held_product(m, i, without_zero(direction[i])))
            product[i] = row
            curvature += wp.float64(wp.dot(direction[i], row))
        for c in range(pairs):
            v = m.ids[c]
            w = m.lam[c]
            first_two = w[0] * direction[v[0]] + w[1] * direction[v[1]]
            u = without_zero(first_two + w[2] * direction[v[2]] + w[3] * direction[v[3]])
            f = pair_force(m, c, u)
            curvature += wp.float64(wp.dot(u, f))
            g = with_zero(f)
            for k in range(4):
                product[v[k]] = product[v[k]] + w[k] * g
        step = float(0.0)
        if curvature > wp.float64(0.0):
            step = float(squared / curvature)
        before = squared
        squared = wp.float64(0.0)
        for a in range(unknowns):
            i = coupled[a]
            solution[i] = solution[i] + step * without_zero(direction[i])
            r = residual[i] - step * without_zero(product[i])
            z = inverse[i] * r
            residual[i] = r
            preconditioned[i] = z
            squared += wp.float64(wp.dot(r, z))
        squared += add_moves_as_one(of, factor, residual, moves, preconditioned)
        turn = float(squared / before)
        for a in range(unknowns):
            i = coupled[a]
            direction[i] = with_zero(preconditioned[i]) + turn * direction[i]
        iterations += 1
    first_out[0] = float(first)
    state[TAKEN] = iterations
