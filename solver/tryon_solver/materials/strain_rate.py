"""What of the membrane's stiffness resists a change of strain: the matrix of its damping.

The membrane (membrane.py) stores squares of strains: of U - I with U = (F^T F)^(1/2), since |F - R| = |U - I|, and of
|f_u| - 1 and |f_v| - 1. Its Gauss-Newton matrix is that of

    A/2 ( k_s |dU|^2 + (k_u - k_s) d|f_u|^2 + (k_v - k_s) d|f_v|^2 ),

the strains' changes with dF to first order: d|f_u| = f_u . df_u/|f_u|, and with F = u1 s1 v1^T + u2 s2 v2^T, dF_ij =
u_i . dF v_j

    dU_11 = dF_11,   dU_22 = dF_22,   dU_12 = (s1 dF_12 + s2 dF_21)/(s1 + s2).

It is positive semidefinite by its form and zero for turning. What the membrane's Hessian has beyond it is what tension
and compression cost or give when a triangle turns: at unstrained cloth the two are the same.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.materials.membrane import add_to_corners, deformation_gradient
from tryon_solver.materials.principal import SMALLEST_STRETCH, principal_frame

wp.set_module_options({"enable_backward": False})

NUMBERS = 27  # of a triangle's three matrices


@wp.kernel
def strain_matrix_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.vec3),
    time: float,
    dt: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    hessians_out: wp.array2d(dtype=wp.mat33),
):
    """time/dt times the Gauss-Newton matrix at x, over each triangle's dF."""
    t = wp.tid()
    f_u, f_v = deformation_gradient(x, faces[t], gradients[t, 1], gradients[t, 2])
    u1, u2, _n, v1, s1, s2 = principal_frame(f_u, f_v)
    k = time / dt[0] * area[t] * stiffness[t]
    shear = k[2]
    share1 = s1 / wp.max(s1 + s2, SMALLEST_STRETCH)
    share2 = s2 / wp.max(s1 + s2, SMALLEST_STRETCH)
    h_11 = shear * (wp.outer(u1, u1) + 2.0 * share2 * share2 * wp.outer(u2, u2))
    h_22 = shear * (wp.outer(u2, u2) + 2.0 * share1 * share1 * wp.outer(u1, u1))
    h_12 = 2.0 * shear * share1 * share2 * wp.outer(u2, u1)
    h_21 = wp.transpose(h_12)
    c = v1[0]
    s = v1[1]
    d_u = wp.normalize(f_u)
    d_v = wp.normalize(f_v)
    h_uu = c * c * h_11 - c * s * (h_12 + h_21) + s * s * h_22 + (k[0] - shear) * wp.outer(d_u, d_u)
    h_vv = s * s * h_11 + c * s * (h_12 + h_21) + c * c * h_22 + (k[1] - shear) * wp.outer(d_v, d_v)
    h_uv = c * s * (h_11 - h_22) + c * c * h_12 - s * s * h_21
    hessians_out[t, 0] = h_uu
    hessians_out[t, 1] = h_uv
    hessians_out[t, 2] = h_vv


@wp.kernel
def project_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    hessians: wp.array2d(dtype=wp.mat33),
    x_start: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    corner_gradient_out: wp.array2d(dtype=wp.vec3),
):
    """The matrices times the change of F since x_start, added to each corner of the triangle."""
    t = wp.tid()
    face = faces[t]
    d0 = x[face[0]] - x_start[face[0]]
    d1 = x[face[1]] - x_start[face[1]] - d0
    d2 = x[face[2]] - x_start[face[2]] - d0
    g1 = gradients[t, 1]
    g2 = gradients[t, 2]
    d_u = g1[0] * d1 + g2[0] * d2
    d_v = g1[1] * d1 + g2[1] * d2
    h_uv = hessians[t, 1]
    p_u = hessians[t, 0] * d_u + h_uv * d_v
    p_v = wp.transpose(h_uv) * d_u + hessians[t, 2] * d_v
    add_to_corners(corner_gradient_out, gradients, t, p_u, p_v)


@wp.kernel
def add_numbers_kernel(more: wp.array(dtype=wp.float32), numbers: wp.array(dtype=wp.float32)):
    k = wp.tid()
    numbers[k] = numbers[k] + more[k]


def add_hessians(more: wp.array, hessians: wp.array) -> None:
    """hessians += more, both (F, 3) mat33, number by number: neighbouring threads then read what lies side by side."""
    device, size = hessians.device, (NUMBERS * hessians.shape[0],)
    numbers: list[wp.array] = [
        wp.array(ptr=each.ptr, shape=size, dtype=wp.float32, device=device) for each in (more, hessians)
    ]
    launch(add_numbers_kernel, size[0], numbers[:1], numbers[1:], device=device)
