"""Pressed creases: hinges of the mesh that rest folded by an angle a instead of flat.

With h = K x the hinge's row (materials/bending.py), which for sides that are not strained is |e| (t0 + t1), t the unit
vectors towards the edge within its two triangles: as long as 2 |e| sin(fold/2), and along the mean normal n. So with
h0 = 2 L sin(a/2), L the edge's length in the pattern, and w = k_b/(A0 + A1),

    Psi = w/2 |h - h0 n|^2 - w/2 |h|^2 = w (h0^2/2 - h0 h.n)

is what a crease adds to the bending of a flat fabric, which is there anyway: at the angle the two together are zero.
The cubic term h.n is that of Wardetzky et al. 2007 ("Discrete quadratic curvature energies", section 5), with n
normalised. The gradient is exact, with n(x)'s own part. It has no share in the matrices: bending's w K^T K bounds the
sum from above for a fold to the side that it rests at. A fold that lies flat on itself has no mean normal; there the
crease is silent.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.geometry.lines import hinges_of_edges
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import add
from tryon_solver.materials.bending import cotangent_at
from tryon_solver.plan import Contribution
from tryon_solver.scene import Creases

wp.set_module_options({"enable_backward": False})

FOLDED = 0.02  # of both triangles' areas: a sum of their normals that is shorter has no direction


@wp.kernel
def measure_kernel(
    flat: wp.array(dtype=wp.vec2d),
    corners: wp.array2d(dtype=wp.int32),
    k_bend: wp.array(dtype=wp.float64),
    row_out: wp.array(dtype=wp.vec4),
    weight_out: wp.array(dtype=wp.float32),
    length_out: wp.array(dtype=wp.float32),
):
    """K [-], w [N/m] and L [m] of each crease; `corners` (K, 6): v0, v1, opposite of one triangle, and of the other."""
    c = wp.tid()
    area = wp.float64(0.0)
    at0 = wp.vec2d()
    at1 = wp.vec2d()
    for side in range(2):
        v0 = flat[corners[c, 3 * side]]
        v1 = flat[corners[c, 3 * side + 1]]
        v2 = flat[corners[c, 3 * side + 2]]
        at0[side] = cotangent_at(v0, v1, v2)
        at1[side] = cotangent_at(v1, v0, v2)
        a = v1 - v0
        b = v2 - v0
        area += wp.float64(0.5) * wp.abs(a[0] * b[1] - a[1] * b[0])
        length_out[c] = wp.float32(wp.length(a))
    row_out[c] = wp.vec4(
        wp.float32(at1[0] + at1[1]),
        wp.float32(at0[0] + at0[1]),
        wp.float32(-at0[0] - at1[0]),
        wp.float32(-at0[1] - at1[1]),
    )
    weight_out[c] = wp.float32(k_bend[c] / area)


@wp.func
def area_normal(x: wp.array(dtype=wp.vec3), f: wp.vec3i) -> wp.vec3:
    """Twice the area, along the front's normal [m^2]."""
    return wp.cross(x[f[1]] - x[f[0]], x[f[2]] - x[f[0]])


@wp.func
def curvature(x: wp.array(dtype=wp.vec3), v: wp.vec4i, row: wp.vec4) -> wp.vec3:
    """h = K x [m], by differences to v0: the row sums to zero."""
    return row[1] * (x[v[1]] - x[v[0]]) + row[2] * (x[v[2]] - x[v[0]]) + row[3] * (x[v[3]] - x[v[0]])


@wp.func
def mean_normal(x: wp.array(dtype=wp.vec3), f: wp.vec3i, g: wp.vec3i):
    """The unit normal between two triangles and how long their sum is [m^2]; zero where they lie on each other."""
    one = area_normal(x, f)
    other = area_normal(x, g)
    size = wp.length(one + other)
    if size < FOLDED * (wp.length(one) + wp.length(other)):
        return wp.vec3(), size
    return (one + other) / size, size


@wp.func
def add_turning(
    x: wp.array(dtype=wp.vec3),
    f: wp.vec3i,
    force: wp.vec3,
    gradient_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    """Adds the derivative of force . (area normal) to the triangle's vertices."""
    b = wp.cross(x[f[2]] - x[f[0]], force)
    c = wp.cross(force, x[f[1]] - x[f[0]])
    add(gradient_out, whole, f[0], -b - c)
    add(gradient_out, whole, f[1], b)
    add(gradient_out, whole, f[2], c)


@wp.kernel
def add_crease_kernel(
    faces: wp.array(dtype=wp.vec3i),
    corners: wp.array2d(dtype=wp.int32),
    vertices: wp.array(dtype=wp.vec4i),
    row: wp.array(dtype=wp.vec4),
    weight: wp.array(dtype=wp.float32),
    length: wp.array(dtype=wp.float32),
    angles: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    """-w h0 (K^T n + (dn/dx)^T h)"""
    c = wp.tid()
    f = faces[corners[c, 0] // 3]
    g = faces[corners[c, 3] // 3]
    v = vertices[c]
    n, size = mean_normal(x, f, g)
    if wp.length_sq(n) == 0.0:
        return
    pull = -2.0 * weight[c] * length[c] * wp.sin(0.5 * angles[c])
    for i in range(4):
        add(gradient_out, whole, v[i], (pull * row[c][i]) * n)
    h = curvature(x, v, row[c])
    turning = (pull / size) * (h - wp.dot(h, n) * n)
    add_turning(x, f, turning, gradient_out, whole)
    add_turning(x, g, turning, gradient_out, whole)


@wp.kernel
def energy_kernel(
    faces: wp.array(dtype=wp.vec3i),
    corners: wp.array2d(dtype=wp.int32),
    vertices: wp.array(dtype=wp.vec4i),
    row: wp.array(dtype=wp.vec4),
    weight: wp.array(dtype=wp.float32),
    length: wp.array(dtype=wp.float32),
    angles: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    energy_out: wp.array(dtype=wp.float32),
):
    """Psi per crease [J]."""
    c = wp.tid()
    n, _size = mean_normal(x, faces[corners[c, 0] // 3], faces[corners[c, 3] // 3])
    h0 = 2.0 * length[c] * wp.sin(0.5 * angles[c])
    energy_out[c] = weight[c] * h0 * (0.5 * h0 - wp.dot(curvature(x, vertices[c], row[c]), n))


def bind(spec: Creases, context: BuildContext) -> Contribution | None:
    """None when no fabric resists bending."""
    garment, device, rest, sums = context.scene.garment, context.device, context.rest, context.sums
    into = sums.vectors
    count = len(spec.edges)
    if context.bending is None:
        return None
    hinge = hinges_of_edges(garment, spec.edges, "creases")
    stiffness = context.scene.of_fabrics("k_bend")[:, 0][garment.hinges()[hinge, 4:]].mean(axis=1)
    sides = np.ascontiguousarray(garment.connectivity.hinge_corners[:, :, hinge].transpose(2, 0, 1).reshape(count, 6))
    corners: wp.array = wp.array(sides, dtype=wp.int32, device=device)
    vertices: wp.array = wp.array(garment.hinges()[hinge, :4].astype(np.int32), dtype=wp.vec4i, device=device)
    k_bend: wp.array = wp.array(stiffness, dtype=wp.float64, device=device)
    row = wp.zeros(count, dtype=wp.vec4, device=device)
    weight = wp.zeros(count, dtype=wp.float32, device=device)
    length = wp.zeros(count, dtype=wp.float32, device=device)
    angles: wp.array = wp.array(spec.angles, dtype=wp.float32, device=device)
    energies = wp.zeros(count, dtype=wp.float32, device=device)
    creases = [rest.faces, corners, vertices, row, weight, length, angles]

    def reshape() -> None:
        launch(measure_kernel, count, [rest.flat, corners, k_bend], [row, weight, length], device=device)

    def add_gradient(x: wp.array, gradient: wp.array) -> None:
        launch(add_crease_kernel, count, [*creases, x], [gradient, into], device=device)
        sums.settle(gradient)

    def energy(x: wp.array) -> float:
        launch(energy_kernel, count, [*creases, x], [energies], device=device)
        return float(energies.numpy().sum(dtype=np.float64))

    return Contribution(
        "creases", add_gradient=add_gradient, energy=energy, reshape=reshape, values={"angles": angles}
    )
