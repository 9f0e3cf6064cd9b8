"""Isometric bending of an initially flat fabric: exactly quadratic, no local step.

    Psi = 1/2 sum_e x^T (Q_e (x) I3) x,   Q_e = k_b/(A0 + A1) K^T K,
    K = (c03 + c04, c01 + c02, -c01 - c03, -c02 - c04)

over the hinge's edge ends v0 v1 and opposite vertices v2 v3, with cij the cotangents of the angles at v0 and v1 in the
two triangles. Source: Bergou et al. 2006, "A quadratic bending model for inextensible surfaces", section 3.

Their coefficient is 3 k_b. It spreads the mean curvature over all edges, which suits a sphere. Cloth bends to
developable shapes: a panel on a cylinder of radius r costs 1/2 k_b A/r^2 for the flexural rigidity k_b exactly when the
coefficient is 1, in every direction of a well-shaped mesh (tests/solver/derivatives), so that k_bend is the number a
bending test of fabric gives: cloth that resists being stretched bends so.

Bent in two directions, a mesh of equilateral triangles holds 1/2 k_b (a^2 + b^2 - 2/3 a b) an area, a and b the
principal curvatures: a plate of Poisson's ratio -1/3. So a strip that is bent so little that its edges may turn up
with it, without stretching, resists with only 1 - 1/9 of k_b; a grid of right-angled triangles with 0.80.
"""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def cotangent_at(at: wp.vec2d, one: wp.vec2d, other: wp.vec2d):
    """Of the angle there between the ways to the two."""
    a = one - at
    b = other - at
    return wp.dot(a, b) / wp.abs(a[0] * b[1] - a[1] * b[0])


@wp.kernel
def matrix_kernel(
    flat: wp.array(dtype=wp.vec2d),
    corners: wp.array3d(dtype=wp.int32),
    stiffness: wp.array(dtype=wp.float64),
    entries_out: wp.array(dtype=wp.float64),
):
    """N/m: each hinge's Q above, row by row; `corners` (2, 3, H) as `Connectivity.hinge_corners`, `stiffness` k_b."""
    h = wp.tid()
    area = wp.float64(0.0)
    at0 = wp.vec2d()
    at1 = wp.vec2d()
    for side in range(2):
        v0 = flat[corners[side, 0, h]]
        v1 = flat[corners[side, 1, h]]
        v2 = flat[corners[side, 2, h]]
        at0[side] = cotangent_at(v0, v1, v2)
        at1[side] = cotangent_at(v1, v0, v2)
        a = v1 - v0
        b = v2 - v0
        area += wp.float64(0.5) * wp.abs(a[0] * b[1] - a[1] * b[0])
    k = wp.vec4d(at1[0] + at1[1], at0[0] + at0[1], -at0[0] - at1[0], -at0[1] - at1[1])
    weight = stiffness[h] / area
    for i in range(4):
        for j in range(4):
            entries_out[16 * h + 4 * i + j] = weight * k[i] * k[j]
