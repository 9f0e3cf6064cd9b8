"""The correction's matrix times a vector, by the functions that its conjugate gradients are made of."""

import warp as wp

from tryon_solver.linalg.paired_matrix import PairedMatrix, held_product, pair_count, pair_force
from tryon_solver.stepping.newton import newton_matrix

wp.set_module_options({"enable_backward": False})


@wp.func
def row_product(m: PairedMatrix, i: int, p: wp.array(dtype=wp.vec3)) -> wp.vec3:
    """Row i of all but the pairs, times p.

    From differences of p, since a row's blocks sum to zero: a move as one would else cost the digits by which they
    exceed the diagonal, all there are where the cloth is stiff and light.
    """
    here = p[i]
    total = wp.vec3()
    if i < m.columns.shape[0]:
        for k in range(1, m.columns.shape[1]):
            j = m.columns[i, k]
            if j == i:
                break  # the rest of the row is padding
            total += m.blocks[i, k] * (p[j] - here)
        for k in range(m.far_columns.shape[1]):
            j = m.far_columns[i, k]
            if j == i:
                break
            total += m.weights[i, k] * (p[j] - here)
    return total + m.diagonal[i] * here + held_product(m, i, here)


@wp.kernel
def product_kernel(m: PairedMatrix, p: wp.array(dtype=wp.vec3), product_out: wp.array(dtype=wp.vec3)):
    for i in range(p.shape[0]):
        product_out[i] = row_product(m, i, p)
    for c in range(pair_count(m)):
        v = m.ids[c]
        u = wp.vec3()
        for k in range(4):
            u += m.lam[c][k] * p[v[k]]
        f = pair_force(m, c, u)
        for k in range(4):
            product_out[v[k]] = product_out[v[k]] + m.lam[c][k] * f


def newton_product(sim, p, product_out):
    """product = the matrix of the simulation, as it stands, times p."""
    wp.launch(product_kernel, 1, [newton_matrix(sim), p], [product_out], device=sim.device)
