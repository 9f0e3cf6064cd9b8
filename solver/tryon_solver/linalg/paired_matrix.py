"""A matrix over vec3 unknowns that is a sum of sparse rows, a diagonal, what holds single unknowns, and contact pairs:
the correction's."""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.struct
class PairedMatrix:
    """A matrix over A vec3 unknowns, a sum of: `columns`, `blocks` (N, width) as in BlockRows and `far_columns`,
    `weights` (N, width) as in EllMatrix without a diagonal, rows of both together summing to zero; `diagonal` (A,);
    h h^T of the h in `held` (A,); and pairs as in ContactPairs, of which the first of `count` says how many there are:
    block (i, j) of one is lam_i lam_j (curvature n n^T + beside)."""

    columns: wp.array2d(dtype=wp.int32)
    blocks: wp.array2d(dtype=wp.mat33)
    far_columns: wp.array2d(dtype=wp.int32)
    weights: wp.array2d(dtype=wp.float32)
    diagonal: wp.array(dtype=wp.float32)
    held: wp.array(dtype=wp.vec3)
    count: wp.array(dtype=wp.int32)
    ids: wp.array(dtype=wp.vec4i)
    lam: wp.array(dtype=wp.vec4)
    normal: wp.array(dtype=wp.vec3)
    curvature: wp.array(dtype=wp.float32)
    beside: wp.array(dtype=wp.mat33)


@wp.func
def pair_count(m: PairedMatrix) -> int:
    """How many pairs there are, of those that there is room for."""
    return wp.min(m.count[0], m.ids.shape[0])


@wp.func
def held_product(m: PairedMatrix, i: int, p: wp.vec3) -> wp.vec3:
    """h h^T p of unknown i."""
    return wp.dot(m.held[i], p) * m.held[i]


@wp.func
def pair_force(m: PairedMatrix, c: int, u: wp.vec3) -> wp.vec3:
    """What pair c answers to u = sum_k lam_k p_k with; vertex k gets lam_k of it."""
    n = m.normal[c]
    return (m.curvature[c] * wp.dot(n, u)) * n + m.beside[c] * u
