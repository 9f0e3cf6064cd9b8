"""Orthotropic membrane as projective dynamics.

With F = [f_u f_v] (3x2) the deformation gradient of a rest triangle of area A and R the nearest orthonormal frame,

    Psi = A/2 ( k_s |F - R|^2 + (k_u - k_s) (|f_u| - 1)^2 + (k_v - k_s) (|f_v| - 1)^2 ).

Each summand is a projection term w/2 |F e - T|^2 whose target T (R, f_u/|f_u|, f_v/|f_v|) moves with F, so the matrix
is constant: A (k_u g_u g_u^T + k_v g_v g_v^T), g_u and g_v the pattern gradients of the corners. Source: Bouaziz et al.
2014, section 5 (projective dynamics of strain); the split into a shear part and two stretch parts keeps the three
stiffnesses of Baraff and Witkin 1998, section 4. A stretch along u costs k_u exactly, which needs k_s <= k_u, k_v.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.materials.device import corner_gradients, sides, signed_area
from tryon_solver.materials.principal import isotropic_hessian, principal_frame
from tryon_solver.materials.triangle_hessian import add_over_gradient

wp.set_module_options({"enable_backward": False})


@wp.func
def deformation_gradient(x: wp.array(dtype=wp.vec3), face: wp.vec3i, g1: wp.vec2, g2: wp.vec2):
    """F = sum_i x_i g_i^T by differences to corner 0; returns its columns f_u, f_v."""
    e1 = x[face[1]] - x[face[0]]
    e2 = x[face[2]] - x[face[0]]
    return g1[0] * e1 + g2[0] * e2, g1[1] * e1 + g2[1] * e2


@wp.func
def nearest_frame(f_u: wp.vec3, f_v: wp.vec3):
    """Columns of R = F (F^T F)^(-1/2), the polar factor of a 3x2 matrix, in closed form.

    For a 2x2 SPD matrix C: sqrt(C) = (C + s I)/t with s = sqrt(det C), t = sqrt(tr C + 2 s). A triangle collapsed to a
    line (s = 0) has no unique frame; `smallest` keeps the quotient finite there and changes R by less than 1e-6
    otherwise.
    """
    smallest = float(1.0e-12)
    a = wp.dot(f_u, f_u)
    b = wp.dot(f_u, f_v)
    c = wp.dot(f_v, f_v)
    s = wp.sqrt(wp.max(a * c - b * b, 0.0))
    t = wp.sqrt(a + c + 2.0 * s)
    # inverse of sqrt(C): its determinant is s
    scale = 1.0 / (t * s + smallest)
    r_u = scale * ((c + s) * f_u - b * f_v)
    r_v = scale * ((a + s) * f_v - b * f_u)
    return r_u, r_v


@wp.func
def add_to_corners(
    corner_gradient: wp.array2d(dtype=wp.vec3), gradients: wp.array2d(dtype=wp.vec2), t: int, p_u: wp.vec3, p_v: wp.vec3
):
    """Adds dPsi/dx_i = P g_i for P = [p_u p_v] = dPsi/dF of triangle t."""
    for i in range(3):
        g = gradients[t, i]
        corner_gradient[t, i] = corner_gradient[t, i] + g[0] * p_u + g[1] * p_v


@wp.kernel
def project_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    corner_gradient_out: wp.array2d(dtype=wp.vec3),
):
    """dPsi/dF : A P = A (k_s (F - R) + ...), added to each corner of the triangle as A P g_i."""
    t = wp.tid()
    f_u, f_v = deformation_gradient(x, faces[t], gradients[t, 1], gradients[t, 2])
    r_u, r_v = nearest_frame(f_u, f_v)
    k = stiffness[t]
    p_u = k[2] * (f_u - r_u) + (k[0] - k[2]) * (f_u - wp.normalize(f_u))
    p_v = k[2] * (f_v - r_v) + (k[1] - k[2]) * (f_v - wp.normalize(f_v))
    add_to_corners(corner_gradient_out, gradients, t, area[t] * p_u, area[t] * p_v)


@wp.kernel
def energy_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    energy_out: wp.array(dtype=wp.float32),
):
    """Psi per triangle [J]."""
    t = wp.tid()
    f_u, f_v = deformation_gradient(x, faces[t], gradients[t, 1], gradients[t, 2])
    r_u, r_v = nearest_frame(f_u, f_v)
    k = stiffness[t]
    stretch_u = wp.length(f_u) - 1.0
    stretch_v = wp.length(f_v) - 1.0
    shear = wp.length_sq(f_u - r_u) + wp.length_sq(f_v - r_v)
    energy_out[t] = (
        0.5
        * area[t]
        * (k[2] * shear + (k[0] - k[2]) * stretch_u * stretch_u + (k[1] - k[2]) * stretch_v * stretch_v)
    )


@wp.func
def column_hessian(weight: float, f: wp.vec3) -> wp.mat33:
    """Hessian of weight/2 (|f| - 1)^2: weight (d d^T + (1 - 1/|f|) (I - d d^T)), d = f/|f|, negative part left out."""
    d = wp.normalize(f)
    across = wp.max(1.0 - 1.0 / wp.max(wp.length(f), 1.0e-6), 0.0)
    return weight * ((1.0 - across) * wp.outer(d, d) + across * wp.identity(n=3, dtype=wp.float32))


@wp.kernel
def hessian_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    hessians: wp.array2d(dtype=wp.mat33),
):
    """Adds the positive semidefinite Hessian of Psi: psi = (s1 - 1)^2/2 + (s2 - 1)^2/2 for the shear part."""
    t = wp.tid()
    f_u, f_v = deformation_gradient(x, faces[t], gradients[t, 1], gradients[t, 2])
    u1, u2, n, v1, s1, s2 = principal_frame(f_u, f_v)
    k = stiffness[t]
    shear = area[t] * k[2]
    h_uu, h_uv, h_vv = isotropic_hessian(u1, u2, n, v1, s1, s2, shear, s1 - 1.0, s2 - 1.0, 1.0, 1.0)
    h_uu += column_hessian(area[t] * (k[0] - k[2]), f_u)
    h_vv += column_hessian(area[t] * (k[1] - k[2]), f_v)
    add_over_gradient(hessians, t, h_uu, h_uv, h_vv)


@wp.kernel
def matrix_kernel(
    flat: wp.array(dtype=wp.vec2d), stiffness: wp.array(dtype=wp.vec2d), entries_out: wp.array(dtype=wp.float64)
):
    """N/m: each triangle's A (k_u g_u g_u^T + k_v g_v g_v^T), row by row; `stiffness` k_u, k_v."""
    t = wp.tid()
    a, b = sides(flat, t)
    g0, g1, g2 = corner_gradients(a, b)
    k_u = signed_area(a, b) * stiffness[t][0]
    k_v = signed_area(a, b) * stiffness[t][1]
    u = wp.vec3d(g0[0], g1[0], g2[0])
    v = wp.vec3d(g0[1], g1[1], g2[1])
    for i in range(3):
        for j in range(3):
            entries_out[9 * t + 3 * i + j] = k_u * u[i] * u[j] + k_v * v[i] * v[j]
