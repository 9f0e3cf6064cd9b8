"""What of the membrane's stiffness resists a change of strain: the matrix of its damping.

The membrane (membrane.py) stores squares of strains: of U - I with U = (F^T F)^(1/2), since |F - R| = |U - I|, and of
|f_u| - 1 and |f_v| - 1. Its Gauss-Newton matrix is that of

    A/2 ( k_s |dU|^2 + (k_u - k_s) d|f_u|^2 + (k_v - k_s) d|f_v|^2 ),

the strains' changes with dF to first order: d|f_u| = f_u . df_u/|f_u|, and with F = u1 s1 v1^T + u2 s2 v2^T, dF_ij =
u_i . dF v_j

    dU_11 = dF_11,   dU_22 = dF_22,   dU_12 = (s1 dF_12 + s2 dF_21)/(s1 + s2).

It is positive semidefinite by its form and zero for turning, to first order. What turns by theta is to second order
drawn in by theta^2/2, and a matrix of the step's start would brake it, as theta^3: a sheet of jersey that turns at 3
rad/s to 1.25 in a second, at 60 steps a second. So dF is not counted from F0 but from R F0, with R the turn that the
triangle would take by its velocities at the start: by w = dt (a u1 + b u2 + c n),

    a = f'2.n/s2,   b = -f'1.n/s1,   c = (s1 f'1.u2 - s2 f'2.u1)/(s1^2 + s2^2),   f'_i = F' v_i,

which is exact for what turns as it did, and the matrix is that of R F0. What is resisted of turning is what of it
changes in a step, and that to second order.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.materials.membrane import add_to_corners, deformation_gradient
from tryon_solver.materials.principal import SMALLEST_STRETCH, principal_frame

wp.set_module_options({"enable_backward": False})

NUMBERS = 27  # of a triangle's three matrices
LEAST_TURNED = 0.05  # stretch below which a direction in the plane of a triangle does not tell how this turns


@wp.func
def turn_of(u1: wp.vec3, u2: wp.vec3, n: wp.vec3, s1: float, s2: float, g1: wp.vec3, g2: wp.vec3) -> wp.vec3:
    """w/dt above [rad/s] of the rates g1, g2 of the stretched principal directions."""
    a = wp.dot(g2, n) / wp.max(s2, LEAST_TURNED)
    b = -wp.dot(g1, n) / wp.max(s1, LEAST_TURNED)
    c = (s1 * wp.dot(g1, u2) - s2 * wp.dot(g2, u1)) / wp.max(s1 * s1 + s2 * s2, LEAST_TURNED * LEAST_TURNED)
    return a * u1 + b * u2 + c * n


@wp.func
def turned_by(way: wp.vec3, f: wp.vec3) -> wp.vec3:
    """R f - f of the turn by `way` [rad], to as many digits as that has; Rodrigues' formula."""
    angle = wp.length(way)
    once = 1.0 - angle * angle / 6.0
    twice = 0.5 - angle * angle / 24.0
    if angle > 0.01:
        once = wp.sin(angle) / angle
        twice = (1.0 - wp.cos(angle)) / (angle * angle)
    aside = wp.cross(way, f)
    return once * aside + twice * wp.cross(way, aside)


@wp.kernel
def strain_matrix_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    area: wp.array(dtype=wp.float32),
    stiffness: wp.array(dtype=wp.vec3),
    time: float,
    dt: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    v: wp.array(dtype=wp.vec3),
    hessians_out: wp.array2d(dtype=wp.mat33),
    turned_out: wp.array2d(dtype=wp.vec3),
):
    """time/dt times the Gauss-Newton matrix at R F0, over each triangle's dF, and the columns of R F0 - F0."""
    t = wp.tid()
    f_u, f_v = deformation_gradient(x, faces[t], gradients[t, 1], gradients[t, 2])
    g_u, g_v = deformation_gradient(v, faces[t], gradients[t, 1], gradients[t, 2])
    u1, u2, n, v1, s1, s2 = principal_frame(f_u, f_v)
    way = dt[0] * turn_of(u1, u2, n, s1, s2, v1[0] * g_u + v1[1] * g_v, v1[0] * g_v - v1[1] * g_u)
    turned_u = turned_by(way, f_u)
    turned_v = turned_by(way, f_v)
    turned_out[t, 0] = turned_u
    turned_out[t, 1] = turned_v
    u1 = u1 + turned_by(way, u1)
    u2 = u2 + turned_by(way, u2)
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
    d_u = wp.normalize(f_u + turned_u)
    d_v = wp.normalize(f_v + turned_v)
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
    turned: wp.array2d(dtype=wp.vec3),
    corner_gradient_out: wp.array2d(dtype=wp.vec3),
):
    """The matrices times F - R F0, added to each corner of the triangle."""
    t = wp.tid()
    face = faces[t]
    d0 = x[face[0]] - x_start[face[0]]
    d1 = x[face[1]] - x_start[face[1]] - d0
    d2 = x[face[2]] - x_start[face[2]] - d0
    g1 = gradients[t, 1]
    g2 = gradients[t, 2]
    d_u = g1[0] * d1 + g2[0] * d2 - turned[t, 0]
    d_v = g1[1] * d1 + g2[1] * d2 - turned[t, 1]
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
