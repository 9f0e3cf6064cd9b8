"""Measured stretch curves: what a fabric resists along warp and weft, in place of its own stiffness.

    Psi = A sum_d Phi_d(e_d),   Phi_d' = T_d(e) - k_d e for e > 0,   e_u = |f_u| - 1, e_v = |f_v| - 1

T [N/m] is the curve, linear between its points, and k the fabric's stiffness that the membrane (membrane.py) has for
the same strain: together a strip that is pulled along u has the tension T_u. In compression, and along a direction
without points, Phi is 0.

Fabrics are soft at first, as their yarns straighten, and stiffen then: where T is less steep than k, Phi takes away of
what the membrane has. The sum along a direction is convex all the same, since T rises. Its Hessian is the membrane's,
made semidefinite by itself, and this one's, which takes away no more than the membrane has for sure: along f the
tangent T', or the fabric's shear stiffness k_s where T' is less, in place of k; across it T/|f|, or what k_s e gives
where T is less. Where these bounds act, Newton's matrix is an upper bound of the Hessian, and the gradient what it is.

Piecewise tangent moduli along warp and weft: Volino, Magnenat-Thalmann and Faure 2009, "A simple approach to nonlinear
tensile stiffness for accurate cloth simulation", there as splines of strain.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.materials.membrane import add_to_corners, deformation_gradient
from tryon_solver.materials.triangle_hessian import add_over_gradient

wp.set_module_options({"enable_backward": False})


@wp.func
def beyond(curves: wp.array2d(dtype=wp.vec4), direction: int, k: float, strain: float):
    """T - k e [N/m], T' and the integral of T - k e; zero, k and zero in compression and without points.

    `curves` (2, K): strain, tension, tangent and work [J/m^2] where each piece begins.
    """
    piece = int(-1)
    for j in range(curves.shape[1]):
        if strain > curves[direction, j][0]:
            piece = j
    if piece < 0:
        return 0.0, k, 0.0
    c = curves[direction, piece]
    way = strain - c[0]
    tension = c[1] + c[2] * way - k * strain
    work = c[3] + (c[1] + 0.5 * c[2] * way) * way - 0.5 * k * strain * strain
    return tension, c[2], work


@wp.kernel
def project_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.vec3),
    curves: wp.array2d(dtype=wp.vec4),
    x: wp.array(dtype=wp.vec3),
    corner_gradient_out: wp.array2d(dtype=wp.vec3),
):
    """Adds A (T - k e) f/|f| g_i to each corner, along both directions."""
    t = wp.tid()
    f_u, f_v = deformation_gradient(x, faces[t], gradients[t, 1], gradients[t, 2])
    t_u, _slope_u, _work_u = beyond(curves, 0, stiffness[t][0], wp.length(f_u) - 1.0)
    t_v, _slope_v, _work_v = beyond(curves, 1, stiffness[t][1], wp.length(f_v) - 1.0)
    p_u = area[t] * t_u * wp.normalize(f_u)
    p_v = area[t] * t_v * wp.normalize(f_v)
    add_to_corners(corner_gradient_out, gradients, t, p_u, p_v)


@wp.kernel
def energy_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.vec3),
    curves: wp.array2d(dtype=wp.vec4),
    x: wp.array(dtype=wp.vec3),
    energy_out: wp.array(dtype=wp.float32),
):
    """Psi per triangle [J]."""
    t = wp.tid()
    f_u, f_v = deformation_gradient(x, faces[t], gradients[t, 1], gradients[t, 2])
    _t_u, _slope_u, work_u = beyond(curves, 0, stiffness[t][0], wp.length(f_u) - 1.0)
    _t_v, _slope_v, work_v = beyond(curves, 1, stiffness[t][1], wp.length(f_v) - 1.0)
    energy_out[t] = area[t] * (work_u + work_v)


@wp.func
def along_and_across(tension: float, tangent: float, k: float, k_shear: float, f: wp.vec3) -> wp.mat33:
    """Hessian of Phi(|f| - 1), Phi'' d d^T + Phi'/|f| (I - d d^T) with d = f/|f|, or more where that would take away
    what the membrane may not have."""
    length = wp.length(f)
    d = f / length
    along = wp.max(tangent, k_shear) - k
    across = wp.max(tension, (k_shear - k) * (length - 1.0)) / length
    if length <= 1.0:
        across = 0.0
    return (along - across) * wp.outer(d, d) + across * wp.identity(n=3, dtype=wp.float32)


@wp.kernel
def hessian_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.vec3),
    curves: wp.array2d(dtype=wp.vec4),
    x: wp.array(dtype=wp.vec3),
    hessians: wp.array2d(dtype=wp.mat33),
):
    """Adds the Hessian of Psi, so that with the membrane's it is positive semidefinite."""
    t = wp.tid()
    f_u, f_v = deformation_gradient(x, faces[t], gradients[t, 1], gradients[t, 2])
    own = stiffness[t]
    t_u, slope_u, _work_u = beyond(curves, 0, own[0], wp.length(f_u) - 1.0)
    t_v, slope_v, _work_v = beyond(curves, 1, own[1], wp.length(f_v) - 1.0)
    if slope_u != own[0] or slope_v != own[1] or t_u != 0.0 or t_v != 0.0:
        h_uu = area[t] * along_and_across(t_u, slope_u, own[0], own[2], f_u)
        h_vv = area[t] * along_and_across(t_v, slope_v, own[1], own[2], f_v)
        add_over_gradient(hessians, t, h_uu, wp.mat33(), h_vv)
