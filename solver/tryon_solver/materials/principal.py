"""Principal stretches of a 3x2 deformation gradient, and the Hessian of isotropic membrane energies in their frame.

For an energy psi(s1, s2) of the singular values of F = U S V^T the Hessian over dF (3x2) is diagonal in six modes
(after Smith, De Goes and Kim 2019, "Analytic eigensystems for isotropic distortion energies", carried to 3x2):

    u1 v1^T: psi_11        u2 v2^T: psi_22                      (both energies here have psi_12 = 0)
    (u2 v1^T - u1 v2^T)/sqrt 2: (psi_1 + psi_2)/(s1 + s2)       twist
    (u2 v1^T + u1 v2^T)/sqrt 2: (psi_1 - psi_2)/(s1 - s2)       flip
    n v1^T: psi_1/s1       n v2^T: psi_2/s2                      out of plane

Negative eigenvalues are set to zero: the matrix is positive semidefinite, the exact Hessian's nearest such.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.block_ell import add_block

wp.set_module_options({"enable_backward": False})

mat32 = wp.types.matrix(shape=(3, 2), dtype=wp.float32)
SMALLEST_STRETCH = 1.0e-4  # below this a direction in the plane is taken from the normal, not from F


@wp.func
def principal_frame(f_u: wp.vec3, f_v: wp.vec3):
    """u1, u2, n, v1 (v2 is v1 turned by 90 degrees), s1 >= s2."""
    a = wp.dot(f_u, f_u)
    b = wp.dot(f_u, f_v)
    c = wp.dot(f_v, f_v)
    theta = 0.5 * wp.atan2(2.0 * b, a - c)
    v1 = wp.vec2(wp.cos(theta), wp.sin(theta))
    stretched1 = v1[0] * f_u + v1[1] * f_v
    stretched2 = -v1[1] * f_u + v1[0] * f_v
    s1 = wp.length(stretched1)
    s2 = wp.length(stretched2)
    u1 = wp.normalize(stretched1)
    u2 = wp.normalize(stretched2)
    if s2 < SMALLEST_STRETCH:
        helper = wp.vec3(1.0, 0.0, 0.0)
        if wp.abs(u1[0]) > 0.7:
            helper = wp.vec3(0.0, 1.0, 0.0)
        u2 = wp.normalize(wp.cross(u1, helper))
    n = wp.cross(u1, u2)
    return u1, u2, n, v1, s1, s2


@wp.func
def add_mode(
    blocks: wp.array2d(dtype=wp.mat33),
    slots: wp.array2d(dtype=wp.int32),
    t: int,
    face: wp.vec3i,
    weight: float,
    q0: wp.vec3,
    q1: wp.vec3,
    q2: wp.vec3,
):
    """Adds weight q_i q_j^T to the nine blocks of triangle t."""
    if weight > 0.0:
        w0 = weight * q0
        w1 = weight * q1
        w2 = weight * q2
        add_block(blocks, slots, t, 0, 0, face[0], wp.outer(w0, q0))
        add_block(blocks, slots, t, 0, 1, face[0], wp.outer(w0, q1))
        add_block(blocks, slots, t, 0, 2, face[0], wp.outer(w0, q2))
        add_block(blocks, slots, t, 1, 0, face[1], wp.outer(w1, q0))
        add_block(blocks, slots, t, 1, 1, face[1], wp.outer(w1, q1))
        add_block(blocks, slots, t, 1, 2, face[1], wp.outer(w1, q2))
        add_block(blocks, slots, t, 2, 0, face[2], wp.outer(w2, q0))
        add_block(blocks, slots, t, 2, 1, face[2], wp.outer(w2, q1))
        add_block(blocks, slots, t, 2, 2, face[2], wp.outer(w2, q2))


@wp.func
def add_isotropic(
    blocks: wp.array2d(dtype=wp.mat33),
    slots: wp.array2d(dtype=wp.int32),
    t: int,
    face: wp.vec3i,
    g0: wp.vec2,
    g1: wp.vec2,
    g2: wp.vec2,
    f_u: wp.vec3,
    f_v: wp.vec3,
    weight: float,
    slope1: float,
    slope2: float,
    curvature1: float,
    curvature2: float,
):
    """Adds weight times the Hessian above; slopes psi_1, psi_2 and curvatures psi_11, psi_22 at the stretches of F."""
    u1, u2, n, v1, s1, s2 = principal_frame(f_u, f_v)
    v2 = wp.vec2(-v1[1], v1[0])
    a0 = wp.dot(v1, g0)
    a1 = wp.dot(v1, g1)
    a2 = wp.dot(v1, g2)
    b0 = wp.dot(v2, g0)
    b1 = wp.dot(v2, g1)
    b2 = wp.dot(v2, g2)
    add_mode(blocks, slots, t, face, weight * curvature1, a0 * u1, a1 * u1, a2 * u1)
    add_mode(blocks, slots, t, face, weight * curvature2, b0 * u2, b1 * u2, b2 * u2)
    half = 0.5 * weight
    twist = half * (slope1 + slope2) / (s1 + s2)
    add_mode(blocks, slots, t, face, twist, a0 * u2 - b0 * u1, a1 * u2 - b1 * u1, a2 * u2 - b2 * u1)
    flip = half * curvature1
    if s1 - s2 > 1.0e-5:
        flip = half * (slope1 - slope2) / (s1 - s2)
    add_mode(blocks, slots, t, face, flip, a0 * u2 + b0 * u1, a1 * u2 + b1 * u1, a2 * u2 + b2 * u1)
    add_mode(blocks, slots, t, face, weight * slope1 / s1, a0 * n, a1 * n, a2 * n)
    add_mode(blocks, slots, t, face, weight * slope2 / wp.max(s2, SMALLEST_STRETCH), b0 * n, b1 * n, b2 * n)
