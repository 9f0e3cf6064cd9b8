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
def largest_stretch(f_u: wp.vec3, f_v: wp.vec3) -> float:
    """s1 alone, which takes no angles."""
    a = wp.dot(f_u, f_u)
    b = wp.dot(f_u, f_v)
    c = wp.dot(f_v, f_v)
    return wp.sqrt(0.5 * (a + c) + wp.sqrt(0.25 * (a - c) * (a - c) + b * b))


@wp.func
def isotropic_hessian(
    u1: wp.vec3,
    u2: wp.vec3,
    n: wp.vec3,
    v1: wp.vec2,
    s1: float,
    s2: float,
    weight: float,
    slope1: float,
    slope2: float,
    curvature1: float,
    curvature2: float,
):
    """weight times the Hessian above over dF, as h_uu, h_uv, h_vv: sum over the modes of w q q^T, w >= 0. Slopes psi_1,
    psi_2 and curvatures psi_11, psi_22 are those at the stretches of the frame."""
    c = v1[0]
    s = v1[1]
    half = 0.5 * weight
    twist = wp.max(half * (slope1 + slope2) / (s1 + s2), 0.0)
    flip = half * curvature1
    if s1 - s2 > 1.0e-5:
        flip = half * (slope1 - slope2) / (s1 - s2)
    flip = wp.max(flip, 0.0)
    along1 = wp.max(weight * curvature1, 0.0)
    along2 = wp.max(weight * curvature2, 0.0)
    out1 = wp.max(weight * slope1 / s1, 0.0)
    out2 = wp.max(weight * slope2 / wp.max(s2, SMALLEST_STRETCH), 0.0)
    # over dF V = [d_1 d_2], V = [v1 v2]: stretches, twist and flip in the plane, and the two ways out of it
    across = twist + flip
    m11 = wp.outer(u1, u1)
    m22 = wp.outer(u2, u2)
    m12 = wp.outer(u1, u2)
    nn = wp.outer(n, n)
    h_11 = along1 * m11 + across * m22 + out1 * nn
    h_22 = along2 * m22 + across * m11 + out2 * nn
    h_12 = (flip - twist) * wp.transpose(m12)
    h_21 = wp.transpose(h_12)
    h_uu = c * c * h_11 - c * s * (h_12 + h_21) + s * s * h_22
    h_vv = s * s * h_11 + c * s * (h_12 + h_21) + c * c * h_22
    h_uv = c * s * (h_11 - h_22) + c * c * h_12 - s * s * h_21
    return h_uu, h_uv, h_vv
