"""Strain limit as projective dynamics: beyond the fabric's largest principal stretch it stiffens.

    Psi = A k/2 |F - T|^2,  T = U min(S, limit) V^T  for F = U S V^T.

T equals F while both stretches are within the limit, so the term is silent there. Source: Bouaziz et al. 2014,
section 5.1 (strain limiting), upper bound only: compressed cloth buckles instead.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.materials.membrane import add_to_corners, deformation_gradient
from tryon_solver.materials.principal import isotropic_hessian, largest_stretch, principal_frame
from tryon_solver.materials.triangle_hessian import add_over_gradient

wp.set_module_options({"enable_backward": False})


@wp.func
def excess(f_u: wp.vec3, f_v: wp.vec3, limit: float):
    """Columns of F - T and the larger principal stretch, from the eigenvectors of F^T F."""
    a = wp.dot(f_u, f_u)
    b = wp.dot(f_u, f_v)
    c = wp.dot(f_v, f_v)
    half = 0.5 * (a + c)
    radius = wp.sqrt(0.25 * (a - c) * (a - c) + b * b)
    over_u = wp.vec3()
    over_v = wp.vec3()
    largest = wp.sqrt(half + radius)
    for k in range(2):
        squared = half + radius
        if k == 1:
            squared = half - radius
        if squared > limit * limit:
            # direction of this principal stretch in the pattern; either formula is safe when it is the longer
            d = wp.vec2(squared - c, b)
            other = wp.vec2(b, squared - a)
            if wp.length_sq(other) > wp.length_sq(d):
                d = other
            if wp.length_sq(d) > 0.0:
                d = wp.normalize(d)
            else:
                d = wp.vec2(1.0 - float(k), float(k))
            stretched = d[0] * f_u + d[1] * f_v
            part = (1.0 - limit / wp.sqrt(squared)) * stretched
            over_u += d[0] * part
            over_v += d[1] * part
    return over_u, over_v, largest


@wp.kernel
def project_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.float32),
    limit: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    corner_gradient_out: wp.array2d(dtype=wp.vec3),
):
    """Adds A k (F - T) g_i to each corner."""
    t = wp.tid()
    f_u, f_v = deformation_gradient(x, faces[t], gradients[t, 1], gradients[t, 2])
    p_u, p_v, largest = excess(f_u, f_v, limit[t])
    if largest > limit[t]:
        weight = area[t] * stiffness[t]
        add_to_corners(corner_gradient_out, gradients, t, weight * p_u, weight * p_v)


@wp.kernel
def energy_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.float32),
    limit: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    energy_out: wp.array(dtype=wp.float32),
):
    """Psi per triangle [J]."""
    t = wp.tid()
    f_u, f_v = deformation_gradient(x, faces[t], gradients[t, 1], gradients[t, 2])
    p_u, p_v, _largest = excess(f_u, f_v, limit[t])
    energy_out[t] = 0.5 * area[t] * stiffness[t] * (wp.length_sq(p_u) + wp.length_sq(p_v))


@wp.kernel
def hessian_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.float32),
    limit: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    hessians: wp.array2d(dtype=wp.mat33),
):
    """Adds the positive semidefinite Hessian of Psi: psi = sum_k max(s_k - limit, 0)^2/2; silent below the limit."""
    t = wp.tid()
    f_u, f_v = deformation_gradient(x, faces[t], gradients[t, 1], gradients[t, 2])
    if largest_stretch(f_u, f_v) > limit[t]:  # as that of few triangles is
        u1, u2, n, v1, s1, s2 = principal_frame(f_u, f_v)
        over1 = wp.max(s1 - limit[t], 0.0)
        over2 = wp.max(s2 - limit[t], 0.0)
        active2 = float(0.0)
        if over2 > 0.0:
            active2 = 1.0
        weight = area[t] * stiffness[t]
        h_uu, h_uv, h_vv = isotropic_hessian(u1, u2, n, v1, s1, s2, weight, over1, over2, 1.0, active2)
        add_over_gradient(hessians, t, h_uu, h_uv, h_vv)
