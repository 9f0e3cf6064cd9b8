"""Closest points of a point and a triangle, and of two edges, as stencil weights.

A stencil is four vertices with weights lam that sum to zero: d = |sum_i lam_i x_i|. Point-triangle: (1, -b0, -b1, -b2);
edge-edge: (1-s, s, -(1-t), -t). Coordinates are taken relative to the stencil's first vertex, so float32 positions a
few metres from the origin lose nothing. Source of the case analysis: Ericson 2005, "Real-Time Collision Detection",
5.1.5 and 5.1.9, but for flat triangles and nearly parallel edges, whose determinants float32 does not bear.
"""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False})

POINT_TRIANGLE = 0
EDGE_EDGE = 1

# Altitude over longest side of a triangle below which the case analysis, whose products cancel like the square of that
# share, is left for one that does not cancel.
FLAT_TRIANGLE = 0.1
# The same for the sine of the angle between two edges.
SMALL_ANGLE = 0.1
# Sine below which two edges are parallel within rounding.
PARALLEL = 1.0e-6


@wp.func
def side_weight(p0: wp.vec3, p1: wp.vec3) -> float:
    """Share t of the point nearest the origin on the segment from p0 to p1."""
    side = p1 - p0
    length_sq = wp.length_sq(side)
    t = float(0.0)
    if length_sq > 0.0:
        t = wp.clamp(-wp.dot(p0, side) / length_sq, 0.0, 1.0)
    return t


@wp.func
def point_flat_triangle_weights(a: wp.vec3, b: wp.vec3, c: wp.vec3) -> wp.vec4:
    """Weights of the point (at the origin) and the flat triangle a b c whose longest side is ab.

    The foot in the plane by orthogonal axes, along ab and across it (Gram-Schmidt), so that its error is a rounding of
    the triangle's size however flat it is; where it lies inside and is nearer than the three sides, it is the closest
    point, else the nearest side's. Each candidate lies on the triangle, so none is nearer than the closest point.
    """
    ab = b - a
    s = side_weight(a, b)
    best = wp.length_sq(a + s * ab)
    weights = wp.vec4(1.0, -(1.0 - s), -s, 0.0)
    s = side_weight(b, c)
    d_sq = wp.length_sq(b + s * (c - b))
    if d_sq < best:
        best = d_sq
        weights = wp.vec4(1.0, 0.0, -(1.0 - s), -s)
    s = side_weight(c, a)
    d_sq = wp.length_sq(c + s * (a - c))
    if d_sq < best:
        best = d_sq
        weights = wp.vec4(1.0, -s, 0.0, -(1.0 - s))
    base_sq = wp.length_sq(ab)
    if base_sq > 0.0:
        ac = c - a
        apex = wp.dot(ac, ab) / base_sq
        across = ac - apex * ab
        along = -wp.dot(a, ab) / base_sq
        altitude_sq = wp.length_sq(across)
        if altitude_sq > 0.0:
            w = -wp.dot(a + along * ab, across) / altitude_sq
            v = along - w * apex
            if v > 0.0 and w > 0.0 and v + w < 1.0 and wp.length_sq(a + v * ab + w * ac) < best:
                weights = wp.vec4(1.0, -(1.0 - v - w), -v, -w)
    return weights


@wp.func
def flat_triangle_weights(a: wp.vec3, b: wp.vec3, c: wp.vec3, base_ab: bool, base_bc: bool) -> wp.vec4:
    """Weights of the point (at the origin) and the flat triangle a b c, whose longest side is ab, bc or else ca."""
    p = a
    q = b
    r = c
    if not base_ab:
        p = c
        q = a
        r = b
        if base_bc:
            p = b
            q = c
            r = a
    turned = point_flat_triangle_weights(p, q, r)
    weights = turned
    if not base_ab:
        weights = wp.vec4(1.0, turned[2], turned[3], turned[1])
        if base_bc:
            weights = wp.vec4(1.0, turned[3], turned[1], turned[2])
    return weights


@wp.func
def point_triangle_weights(a: wp.vec3, b: wp.vec3, c: wp.vec3) -> wp.vec4:
    """Weights of the point (at the origin) and the triangle a b c relative to it."""
    ab = b - a
    ac = c - a
    ab_sq = wp.length_sq(ab)
    ac_sq = wp.length_sq(ac)
    ab_ac = wp.dot(ab, ac)
    bc_sq = ab_sq + ac_sq - 2.0 * ab_ac
    longest_sq = wp.max(ab_sq, wp.max(ac_sq, bc_sq))
    # twice the area, squared, against that of a triangle of this altitude over its longest side
    if ab_sq * ac_sq - ab_ac * ab_ac <= FLAT_TRIANGLE * FLAT_TRIANGLE * longest_sq * longest_sq:
        return flat_triangle_weights(a, b, c, longest_sq == ab_sq, longest_sq == bc_sq)
    d1 = -wp.dot(ab, a)
    d2 = -wp.dot(ac, a)
    if d1 <= 0.0 and d2 <= 0.0:
        return wp.vec4(1.0, -1.0, 0.0, 0.0)
    d3 = -wp.dot(ab, b)
    d4 = -wp.dot(ac, b)
    if d3 >= 0.0 and d4 <= d3:
        return wp.vec4(1.0, 0.0, -1.0, 0.0)
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        return wp.vec4(1.0, -(1.0 - v), -v, 0.0)
    d5 = -wp.dot(ab, c)
    d6 = -wp.dot(ac, c)
    if d6 >= 0.0 and d5 <= d6:
        return wp.vec4(1.0, 0.0, 0.0, -1.0)
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        return wp.vec4(1.0, -(1.0 - w), 0.0, -w)
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and (d4 - d3) >= 0.0 and (d5 - d6) >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return wp.vec4(1.0, 0.0, -(1.0 - w), -w)
    total = va + vb + vc
    v = vb / total
    w = vc / total
    return wp.vec4(1.0, -(1.0 - v - w), -v, -w)


@wp.func
def edge_edge_weights(a1: wp.vec3, b0: wp.vec3, b1: wp.vec3) -> wp.vec4:
    """Weights of edge (origin, a1) and edge (b0, b1), relative to the first edge's start.

    At small angles the second edge's parameter comes from what of it lies across the first (Gram-Schmidt): the terms of
    the determinant cancel like the square of the angle's sine, these don't.
    """
    d1 = a1
    d2 = b1 - b0
    r = -b0
    a = wp.dot(d1, d1)
    e = wp.dot(d2, d2)
    f = wp.dot(d2, r)
    s = float(0.0)
    t = float(0.0)
    if a > 0.0 and e > 0.0:
        c = wp.dot(d1, r)
        b = wp.dot(d1, d2)
        determinant = a * e - b * b
        if determinant > SMALL_ANGLE * SMALL_ANGLE * a * e:
            t = wp.clamp((a * f - b * c) / determinant, 0.0, 1.0)
        else:
            across = d2 - (b / a) * d1
            across_sq = wp.length_sq(across)
            # parallel within rounding: any t on the second edge is as close, the clamps below settle s
            if across_sq > PARALLEL * PARALLEL * e:
                t = wp.clamp(wp.dot(r - (c / a) * d1, across) / across_sq, 0.0, 1.0)
        s = (b * t - c) / a
        if s < 0.0:
            s = 0.0
            t = wp.clamp(f / e, 0.0, 1.0)
        elif s > 1.0:
            s = 1.0
            t = wp.clamp((b + f) / e, 0.0, 1.0)
    elif e > 0.0:
        t = wp.clamp(f / e, 0.0, 1.0)
    elif a > 0.0:
        s = wp.clamp(wp.dot(d1, b0) / a, 0.0, 1.0)
    return wp.vec4(1.0 - s, s, -(1.0 - t), -t)


@wp.func
def stencil_weights(kind: int, x0: wp.vec3, x1: wp.vec3, x2: wp.vec3, x3: wp.vec3) -> wp.vec4:
    """Weights lam of the closest points of the stencil; `kind` is POINT_TRIANGLE or EDGE_EDGE."""
    if kind == 0:
        return point_triangle_weights(x1 - x0, x2 - x0, x3 - x0)
    return edge_edge_weights(x1 - x0, x2 - x0, x3 - x0)


@wp.func
def stencil_vector(lam: wp.vec4, x0: wp.vec3, x1: wp.vec3, x2: wp.vec3, x3: wp.vec3) -> wp.vec3:
    """sum_i lam_i x_i from differences to x0 (the weights sum to zero); its length is the distance d [m]."""
    return lam[1] * (x1 - x0) + lam[2] * (x2 - x0) + lam[3] * (x3 - x0)


@wp.func
def approach(kind: int, u0: wp.vec3, u1: wp.vec3, u2: wp.vec3, u3: wp.vec3) -> float:
    """By how much vertex displacements u can bring the stencil's two primitives together, at most [m].

    A distance changes by no more than the longest displacements of its two sides, whatever motion all have in common.
    """
    if kind == 0:
        m = 0.5 * u0 + (u1 + u2 + u3) / 6.0
        r = wp.max(wp.length_sq(u1 - m), wp.max(wp.length_sq(u2 - m), wp.length_sq(u3 - m)))
        return wp.length(u0 - m) + wp.sqrt(r)
    m = 0.25 * (u0 + u1 + u2 + u3)
    a = wp.max(wp.length_sq(u0 - m), wp.length_sq(u1 - m))
    b = wp.max(wp.length_sq(u2 - m), wp.length_sq(u3 - m))
    return wp.sqrt(a) + wp.sqrt(b)
