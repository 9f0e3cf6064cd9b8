"""Which triangles could come within reach of each other while their vertices stay in a region: the broad phase's half
that walks trees.

Boxes that overlap give pairs; what separates the two triangles along an axis passes a pair over.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.contact.candidates import Region
from tryon_solver.contact.found import PAIRS, Found
from tryon_solver.contact.surfaces import Surface

wp.set_module_options({"enable_backward": False})


@wp.func
def largest_of(a: float, b: float, c: float) -> float:
    return wp.max(a, wp.max(b, c))


@wp.func
def smallest_of(a: float, b: float, c: float) -> float:
    return wp.min(a, wp.min(b, c))


@wp.func
def furthest(a: wp.vec3, b: wp.vec3, c: wp.vec3) -> float:
    return wp.sqrt(largest_of(wp.length_sq(a), wp.length_sq(b), wp.length_sq(c)))


@wp.func
def apart_along(
    axis: wp.vec3, r: float, a0: wp.vec3, a1: wp.vec3, a2: wp.vec3, b0: wp.vec3, b1: wp.vec3, b2: wp.vec3
) -> bool:
    """Are the triangles further apart than r along the axis? Then no stencil of theirs is closer than r."""
    i0 = wp.dot(axis, a0)
    i1 = wp.dot(axis, a1)
    i2 = wp.dot(axis, a2)
    j0 = wp.dot(axis, b0)
    j1 = wp.dot(axis, b1)
    j2 = wp.dot(axis, b2)
    far = r * wp.length(axis)
    return (
        smallest_of(j0, j1, j2) - largest_of(i0, i1, i2) > far or smallest_of(i0, i1, i2) - largest_of(j0, j1, j2) > far
    )


@wp.func
def wedge_height(n: wp.vec3, corner: wp.vec3, a: wp.vec3, is_corner: bool) -> float:
    """Height of a triangle's vertex over the plane through the shared corner; the corner itself does not count."""
    if is_corner:
        return float(1.0e9)
    return wp.dot(n, a - corner)


@wp.func
def wedges_apart(
    r: float,
    ga: wp.vec3i,
    gb: wp.vec3i,
    a0: wp.vec3,
    a1: wp.vec3,
    a2: wp.vec3,
    b0: wp.vec3,
    b1: wp.vec3,
    b2: wp.vec3,
) -> bool:
    """For triangles that share exactly one vertex: does a plane through it keep all their other vertices r away?

    Every stencil of theirs that does not contain the shared vertex on both sides has one primitive made of such other
    vertices alone, so it is further apart than r. False when they share none, or an edge.
    """
    shared = int(0)
    corner = wp.vec3()
    for k in range(3):
        if ga[k] == gb[0] or ga[k] == gb[1] or ga[k] == gb[2]:
            shared += 1
            corner = a0
            if k == 1:
                corner = a1
            elif k == 2:
                corner = a2
    if shared != 1:
        return False
    n = wp.normalize((a0 + a1 + a2) - (b0 + b1 + b2))
    above = smallest_of(
        wedge_height(n, corner, a0, ga[0] == gb[0] or ga[0] == gb[1] or ga[0] == gb[2]),
        wedge_height(n, corner, a1, ga[1] == gb[0] or ga[1] == gb[1] or ga[1] == gb[2]),
        wedge_height(n, corner, a2, ga[2] == gb[0] or ga[2] == gb[1] or ga[2] == gb[2]),
    )
    if above <= r:
        return False
    below = smallest_of(
        wedge_height(-n, corner, b0, gb[0] == ga[0] or gb[0] == ga[1] or gb[0] == ga[2]),
        wedge_height(-n, corner, b1, gb[1] == ga[0] or gb[1] == ga[1] or gb[1] == ga[2]),
        wedge_height(-n, corner, b2, gb[2] == ga[0] or gb[2] == ga[1] or gb[2] == ga[2]),
    )
    return below > r


@wp.func
def overlapped(
    lower: wp.vec3, upper: wp.vec3, grown: float, other_lower: wp.vec3, other_upper: wp.vec3, other_grown: float
) -> bool:
    """Did two boxes overlap before they were grown on every side? Else no stencil of theirs is on the list."""
    both = grown + other_grown
    room = wp.min(other_upper - lower, upper - other_lower)
    return smallest_of(room[0], room[1], room[2]) >= both


@wp.kernel
def pair_triangles_kernel(
    faces: wp.array(dtype=wp.vec3i),
    face_lower: wp.array(dtype=wp.vec3),
    face_upper: wp.array(dtype=wp.vec3),
    face_budget: wp.array(dtype=wp.float32),
    face_known: wp.array(dtype=wp.float32),
    other_bvh: wp.uint64,
    other_faces: wp.array(dtype=wp.vec3i),
    other_lower: wp.array(dtype=wp.vec3),
    other_upper: wp.array(dtype=wp.vec3),
    other_budget: wp.array(dtype=wp.float32),
    other_known: wp.array(dtype=wp.float32),
    other_gained: wp.array(dtype=wp.int32),
    same: int,
    reach: float,
    group: wp.array(dtype=wp.int32),
    centre: wp.array(dtype=wp.vec3),
    half_way: wp.array(dtype=wp.vec3),
    triangles_out: wp.array(dtype=wp.vec2i),
    between_out: wp.array(dtype=wp.vec2),
    counts: wp.array(dtype=wp.int32),
):
    """Pairs of triangle tid and every triangle of the other surface whose box overlaps its own, unless something keeps
    them apart: at their centres, stencils at most the second of `between` apart come into question, and those up to the
    first are on the list already, from a search with the budgets in `known`.

    Around their centres two triangles can approach by no more than their vertices' longest half ways, taken relative to
    the mean of all six, and by their budgets. `same` is 1 when both surfaces are the cloth: then each unordered pair is
    met once.
    """
    t = wp.tid()
    gained = face_budget[t] > face_known[t]
    if not gained and (same == 1 or other_gained[0] == 0):
        return
    f = faces[t]
    a0 = centre[f[0]]
    a1 = centre[f[1]]
    a2 = centre[f[2]]
    p0 = half_way[f[0]]
    p1 = half_way[f[1]]
    p2 = half_way[f[2]]
    own_sum = p0 + p1 + p2
    own_reach = reach + face_budget[t]
    own_known = reach + face_known[t]
    normal = wp.cross(a1 - a0, a2 - a0)
    ga = wp.vec3i(group[f[0]], group[f[1]], group[f[2]])
    query = wp.bvh_query_aabb(other_bvh, face_lower[t], face_upper[t])
    j = int(0)
    while wp.bvh_query_next(query, j):
        other = other_budget[j] > other_known[j]
        if same == 1 and (j == t or (j < t and other)):
            continue
        if not gained and not other:
            continue
        g = other_faces[j]
        b0 = centre[g[0]]
        b1 = centre[g[1]]
        b2 = centre[g[2]]
        q0 = half_way[g[0]]
        q1 = half_way[g[1]]
        q2 = half_way[g[2]]
        mean = (own_sum + q0 + q1 + q2) / 6.0
        travel = furthest(p0 - mean, p1 - mean, p2 - mean) + furthest(q0 - mean, q1 - mean, q2 - mean)
        r = own_reach + other_budget[j] + travel
        r_known = own_known + other_known[j] + travel
        if not overlapped(
            face_lower[t],
            face_upper[t],
            face_budget[t] - face_known[t],
            other_lower[j],
            other_upper[j],
            other_budget[j] - other_known[j],
        ):
            r_known = float(-1.0)
        gb = wp.vec3i(group[g[0]], group[g[1]], group[g[2]])
        if same == 1 and wedges_apart(r, ga, gb, a0, a1, a2, b0, b1, b2):
            continue
        if apart_along(normal, r, a0, a1, a2, b0, b1, b2):
            continue
        if apart_along((b0 + b1 + b2) - (a0 + a1 + a2), r, a0, a1, a2, b0, b1, b2):
            continue
        if apart_along(wp.cross(b1 - b0, b2 - b0), r, a0, a1, a2, b0, b1, b2):
            continue
        slot = wp.atomic_add(counts, PAIRS, 1)
        if slot < triangles_out.shape[0]:
            triangles_out[slot] = wp.vec2i(t, j)
            between_out[slot] = wp.vec2(r_known, r)


def pair_triangles(
    found: Found,
    cloth: Surface,
    other: Surface,
    region: Region,
    group: wp.array,
) -> None:
    """Fill `found` with pairs of triangles, as far as there is room; none are counted before."""
    assert other.bvh is not None
    wp.launch(
        pair_triangles_kernel,
        cloth.face_count,
        [
            cloth.faces,
            cloth.lower,
            cloth.upper,
            cloth.budget,
            cloth.known,
            other.bvh.id,
            other.faces,
            other.lower,
            other.upper,
            other.budget,
            other.known,
            other.gained,
            int(other is cloth),
            other.reach,
            group,
            region.centre,
            region.half_way,
        ],
        [found.triangles, found.between, found.counts],
        device=found.counts.device,
    )
