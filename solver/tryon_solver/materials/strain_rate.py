"""How fast the membrane's strains change, and what resists that: a potential of the step that turning costs nothing.

The membrane (membrane.py) stores squares of strains: of U - I with U = (F^T F)^(1/2), since |F - R| = |U - I|, and of
|f_u| - 1 and |f_v| - 1. Their changes since the step's start, there U0 and f0, cost

    D = beta/(2 dt) A ( k_s |U - U0|^2 + (k_u - k_s) (|f_u| - |f0_u|)^2 + (k_v - k_s) (|f_v| - |f0_v|)^2 ),

which has no part in how a triangle turns, however far. With C = F^T F the change X = U - U0 solves

    (U + U0) X + X (U + U0) = 2 (C - C0),   and its slope is   d(|X|^2/2)/dF = 2 F Y,   U Y + Y U = X,

so that float32 has small changes to as many digits as those of the positions: C - C0 is made of F - F0. Of 2 x 2
matrices, W Z + Z W = B is solved by Z = (det W B + J B J)/(2 tr W det W), J the adjugate of W (Smith 1966).

The Hessian's share that is used: Gauss and Newton's, of the strains' changes to first order,

    d|f_u| = f_u . df_u/|f_u|,   dU_11 = dF_11,   dU_22 = dF_22,   dU_12 = (s1 dF_12 + s2 dF_21)/(s1 + s2)

with F = u1 s1 v1^T + u2 s2 v2^T and dF_ij = u_i . dF v_j, and what the stress of a triangle that becomes longer holds
it against turning out of its plane by. Both are positive semidefinite. At the step's start it is the whole Hessian, and
of unstrained cloth beta/dt times the membrane's.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.materials.membrane import add_to_corners, deformation_gradient
from tryon_solver.materials.principal import SMALLEST_STRETCH, principal_frame
from tryon_solver.materials.triangle_hessian import add_over_gradient

wp.set_module_options({"enable_backward": False})


@wp.func
def change_of_gradient(
    x_start: wp.array(dtype=wp.vec3), x: wp.array(dtype=wp.vec3), face: wp.vec3i, g1: wp.vec2, g2: wp.vec2
):
    """Columns of F - F0, by the vertices' ways."""
    d0 = x[face[0]] - x_start[face[0]]
    d1 = x[face[1]] - x_start[face[1]] - d0
    d2 = x[face[2]] - x_start[face[2]] - d0
    return g1[0] * d1 + g2[0] * d2, g1[1] * d1 + g2[1] * d2


@wp.func
def root_of(f_u: wp.vec3, f_v: wp.vec3) -> wp.mat22:
    """U = (F^T F)^(1/2) = (C + s I)/t with s = sqrt(det C), t = sqrt(tr C + 2 s)."""
    a = wp.dot(f_u, f_u)
    b = wp.dot(f_u, f_v)
    c = wp.dot(f_v, f_v)
    s = wp.sqrt(wp.max(a * c - b * b, 0.0))
    t = wp.max(wp.sqrt(a + c + 2.0 * s), SMALLEST_STRETCH)
    return wp.mat22((a + s) / t, b / t, b / t, (c + s) / t)


@wp.func
def solve_symmetric(w: wp.mat22, b: wp.mat22) -> wp.mat22:
    """Z of W Z + Z W = B. A W that is no longer one of two dimensions has no such; `smallest` keeps Z finite."""
    smallest = float(1.0e-12)
    j = wp.mat22(w[1, 1], -w[0, 1], -w[0, 1], w[0, 0])
    det = wp.max(w[0, 0] * w[1, 1] - w[0, 1] * w[0, 1], 0.0)
    return (det * b + j * b * j) / (2.0 * (w[0, 0] + w[1, 1]) * det + smallest)


@wp.func
def change_of_metric(b_u: wp.vec3, b_v: wp.vec3, d_u: wp.vec3, d_v: wp.vec3) -> wp.mat22:
    """C - C0 of F0 = [b_u b_v] and F - F0 = [d_u d_v]."""
    uu = wp.dot(2.0 * b_u + d_u, d_u)
    vv = wp.dot(2.0 * b_v + d_v, d_v)
    uv = wp.dot(b_u, d_v) + wp.dot(d_u, b_v) + wp.dot(d_u, d_v)
    return wp.mat22(uu, uv, uv, vv)


@wp.kernel
def project_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.vec3),
    time: float,
    dt: wp.array(dtype=wp.float32),
    x_start: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    corner_gradient_out: wp.array2d(dtype=wp.vec3),
):
    """A dD/dF, added to each corner of the triangle."""
    t = wp.tid()
    b_u, b_v = deformation_gradient(x_start, faces[t], gradients[t, 1], gradients[t, 2])
    d_u, d_v = change_of_gradient(x_start, x, faces[t], gradients[t, 1], gradients[t, 2])
    f_u = b_u + d_u
    f_v = b_v + d_v
    metric = change_of_metric(b_u, b_v, d_u, d_v)
    root = root_of(f_u, f_v)
    change = solve_symmetric(root + root_of(b_u, b_v), 2.0 * metric)
    y = solve_symmetric(root, change)
    k = time / dt[0] * area[t] * stiffness[t]
    longer_u = metric[0, 0] / wp.max(wp.length(f_u) + wp.length(b_u), SMALLEST_STRETCH)
    longer_v = metric[1, 1] / wp.max(wp.length(f_v) + wp.length(b_v), SMALLEST_STRETCH)
    p_u = 2.0 * k[2] * (y[0, 0] * f_u + y[0, 1] * f_v) + (k[0] - k[2]) * longer_u * wp.normalize(f_u)
    p_v = 2.0 * k[2] * (y[0, 1] * f_u + y[1, 1] * f_v) + (k[1] - k[2]) * longer_v * wp.normalize(f_v)
    add_to_corners(corner_gradient_out, gradients, t, p_u, p_v)


@wp.func
def length_hessian(weight: float, f: wp.vec3, longer: float) -> wp.mat33:
    """Hessian of weight/2 (|f| - l)^2 where |f| - l = `longer`, negative part left out."""
    d = wp.normalize(f)
    across = wp.max(longer, 0.0) / wp.max(wp.length(f), SMALLEST_STRETCH)
    return weight * ((1.0 - across) * wp.outer(d, d) + across * wp.identity(n=3, dtype=wp.float32))


@wp.kernel
def hessian_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.vec3),
    time: float,
    dt: wp.array(dtype=wp.float32),
    x_start: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    hessians: wp.array2d(dtype=wp.mat33),
):
    """Adds the positive semidefinite share of A D's Hessian over dF."""
    t = wp.tid()
    b_u, b_v = deformation_gradient(x_start, faces[t], gradients[t, 1], gradients[t, 2])
    d_u, d_v = change_of_gradient(x_start, x, faces[t], gradients[t, 1], gradients[t, 2])
    f_u = b_u + d_u
    f_v = b_v + d_v
    metric = change_of_metric(b_u, b_v, d_u, d_v)
    change = solve_symmetric(root_of(f_u, f_v) + root_of(b_u, b_v), 2.0 * metric)
    u1, u2, n, v1, s1, s2 = principal_frame(f_u, f_v)
    k = time / dt[0] * area[t] * stiffness[t]
    shear = k[2]
    share1 = s1 / wp.max(s1 + s2, SMALLEST_STRETCH)
    share2 = s2 / wp.max(s1 + s2, SMALLEST_STRETCH)
    v2 = wp.vec2(-v1[1], v1[0])
    tension1 = wp.max(wp.dot(v1, change * v1), 0.0) / wp.max(s1, SMALLEST_STRETCH)
    tension2 = wp.max(wp.dot(v2, change * v2), 0.0) / wp.max(s2, SMALLEST_STRETCH)
    out = wp.outer(n, n)
    h_11 = shear * (wp.outer(u1, u1) + 2.0 * share2 * share2 * wp.outer(u2, u2) + tension1 * out)
    h_22 = shear * (wp.outer(u2, u2) + 2.0 * share1 * share1 * wp.outer(u1, u1) + tension2 * out)
    h_12 = 2.0 * shear * share1 * share2 * wp.outer(u2, u1)
    h_21 = wp.transpose(h_12)
    c = v1[0]
    s = v1[1]
    h_uu = c * c * h_11 - c * s * (h_12 + h_21) + s * s * h_22
    h_vv = s * s * h_11 + c * s * (h_12 + h_21) + c * c * h_22
    h_uv = c * s * (h_11 - h_22) + c * c * h_12 - s * s * h_21
    longer_u = metric[0, 0] / wp.max(wp.length(f_u) + wp.length(b_u), SMALLEST_STRETCH)
    longer_v = metric[1, 1] / wp.max(wp.length(f_v) + wp.length(b_v), SMALLEST_STRETCH)
    h_uu += length_hessian(k[0] - shear, f_u, longer_u)
    h_vv += length_hessian(k[1] - shear, f_v, longer_v)
    add_over_gradient(hessians, t, h_uu, h_uv, h_vv)
