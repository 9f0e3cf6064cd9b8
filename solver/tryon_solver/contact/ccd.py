"""Continuous collision detection by conservative advancement along separating planes.

All four vertices of a stencil move linearly. At the current time the closest points give a unit normal n; the width of
the slab between the two primitives along n,

    gap(t) = min_i n.a_i(t) - max_j n.b_j(t),

is a minimum of linear functions less a maximum of linear ones, so concave in t: it lies above its chord. If it is above
`floor` at the current time and at the end, the primitives never come closer than `floor` on the way. If not, the
chord's crossing is a time until which they don't; advance there, take the new normal, repeat. Only differences of
positions enter, so common motion costs nothing. Sources: conservative advancement as in Li et al. 2021 (additive CCD,
Codimensional IPC, section 5); the planar bound in place of the displacement bound is ours.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.contact.distances import stencil_vector, stencil_weights

wp.set_module_options({"enable_backward": False})

ADVANCES = 16  # planes tried before the time reached is returned: shorter, never unsafe


@wp.func
def slab_gap(kind: int, n: wp.vec3, r1: wp.vec3, r2: wp.vec3, r3: wp.vec3) -> float:
    """Width along n between the primitives of a stencil given relative to its first vertex."""
    h1 = wp.dot(n, r1)
    h2 = wp.dot(n, r2)
    h3 = wp.dot(n, r3)
    if kind == 0:
        return -wp.max(h1, wp.max(h2, h3))
    return wp.min(0.0, h1) - wp.max(h2, h3)


@wp.func
def time_of_impact(
    kind: int,
    floor: float,
    x0: wp.vec3,
    x1: wp.vec3,
    x2: wp.vec3,
    x3: wp.vec3,
    p0: wp.vec3,
    p1: wp.vec3,
    p2: wp.vec3,
    p3: wp.vec3,
) -> float:
    """Largest proven fraction t in [0, 1] of the displacements p for which the distance stays >= floor [m].

    1 when the whole step is free. 0 when the stencil starts at or under the floor.
    """
    t = float(0.0)
    # everything relative to the first vertex
    r1 = x1 - x0
    r2 = x2 - x0
    r3 = x3 - x0
    q1 = p1 - p0
    q2 = p2 - p0
    q3 = p3 - p0
    for _k in range(ADVANCES):
        y1 = r1 + t * q1
        y2 = r2 + t * q2
        y3 = r3 + t * q3
        lam = stencil_weights(kind, wp.vec3(), y1, y2, y3)
        difference = stencil_vector(lam, wp.vec3(), y1, y2, y3)
        d = wp.length(difference)
        if d <= floor:
            return t
        # closest-point vector points from the second primitive to the first
        n = difference / d
        here = slab_gap(kind, n, y1, y2, y3)
        if here <= floor:
            return t  # rounding of a nearly touching stencil: no plane proves more
        end = slab_gap(kind, n, r1 + q1, r2 + q2, r3 + q3)
        if end >= floor:
            return 1.0
        advance = (here - floor) / (here - end) * (1.0 - t)
        t = t + advance
        if advance < 1.0e-3:
            return t
    return t
