"""Which triangles could come within reach of each other while their vertices stay in a region: the broad phase's half
that walks trees.

Boxes that overlap give pairs. What separates the two triangles along an axis passes a pair over: that is asked by a
thread of the pair's own, since a triangle in a fold has a hundred times as many pairs as one on a flat back.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.contact.found import CLOSE, PAIRS, Found
from tryon_solver.contact.packets import pair_packets
from tryon_solver.contact.region import Region
from tryon_solver.contact.surfaces import Reach, Side, Surface, reach_of_triangles
from tryon_solver.linalg.blocks import MOST_THREADS
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.slots import next_slot
from tryon_solver.linalg.warps import WARP

wp.set_module_options({"enable_backward": False})

# Of how far from the origin a triangle is: what two searches make of a distance differs by less. A stencil that one has
# just left out the next must not take for listed; at worst it is on the list twice until that is made anew.
ROUNDING = wp.constant(1.0e-6)
NOTHING_KNOWN = wp.constant(-1.0e3)  # m, a budget that covers no stencil
APART = wp.constant(wp.vec2(2.0 * NOTHING_KNOWN, -1.0))  # of two triangles: no stencil comes into question


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
    vertices alone, so it is further apart than r. Of vertices that are being sewn into one and are still apart, the
    plane goes through the first triangle's, and the other's must not be beyond it. False when they share none, or an
    edge.
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
    other = b0
    if gb[1] == ga[0] or gb[1] == ga[1] or gb[1] == ga[2]:
        other = b1
    elif gb[2] == ga[0] or gb[2] == ga[1] or gb[2] == ga[2]:
        other = b2
    if wp.dot(n, other - corner) > 0.0:
        return False
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
    own: Side,
    other: Side,
    other_bvh: wp.uint64,
    other_gained: wp.array(dtype=wp.int32),
    same: int,
    anew: int,
    triangles_out: wp.array(dtype=wp.vec2i),
    counts: wp.array(dtype=wp.int32),
):
    """Pairs of triangle tid and every triangle of the other surface whose box overlaps its own, if one of the two has a
    larger budget than the list of candidates covers already, as all have if it is made `anew`.

    `same` is 1 when both surfaces are the cloth: then each unordered pair is met once.
    """
    t = wp.tid()
    gained = anew == 1 or own.budget[t] > own.known[t]
    if not gained and (same == 1 or other_gained[0] == 0):
        return
    query = wp.bvh_query_aabb(other_bvh, own.lower[t], own.upper[t])
    j = int(0)
    while wp.bvh_query_next(query, j):
        if same == 1 and j == t:
            continue
        other_gains = bool(True)
        if anew == 0:
            other_gains = other.budget[j] > other.known[j]
        if same == 1 and j < t and other_gains:
            continue
        if not gained and not other_gains:
            continue
        slot = next_slot(counts, PAIRS)
        if slot < triangles_out.shape[0]:
            triangles_out[slot] = wp.vec2i(t, j)


@wp.func
def in_question(
    own: Side,
    other: Side,
    t: int,
    j: int,
    same: int,
    reach: Reach,
    group: wp.array(dtype=wp.int32),
    centre: wp.array(dtype=wp.vec3),
    half_way: wp.array(dtype=wp.vec3),
) -> wp.vec2:
    """Of two triangles whose boxes overlap: at their centres, stencils come into question that are no more than the
    second number further apart than they reach, and those up to the first are on the list already, from a search with
    the budgets in `known`, whatever that made of them in its rounding; below 0 if something keeps the two apart.

    Around their centres two triangles can approach by no more than their vertices' longest half ways, taken relative to
    the mean of all six, and by their budgets.
    """
    f = own.faces[t]
    g = other.faces[j]
    a0 = centre[f[0]]
    a1 = centre[f[1]]
    a2 = centre[f[2]]
    b0 = centre[g[0]]
    b1 = centre[g[1]]
    b2 = centre[g[2]]
    p0 = half_way[f[0]]
    p1 = half_way[f[1]]
    p2 = half_way[f[2]]
    q0 = half_way[g[0]]
    q1 = half_way[g[1]]
    q2 = half_way[g[2]]
    mean = (p0 + p1 + p2 + q0 + q1 + q2) / 6.0
    travel = furthest(p0 - mean, p1 - mean, p2 - mean) + furthest(q0 - mean, q1 - mean, q2 - mean)
    further = own.budget[t] + other.budget[j] + travel
    r = reach_of_triangles(f, g, reach) + further
    if same == 1:
        ga = wp.vec3i(group[f[0]], group[f[1]], group[f[2]])
        gb = wp.vec3i(group[g[0]], group[g[1]], group[g[2]])
        if wedges_apart(r, ga, gb, a0, a1, a2, b0, b1, b2):
            return APART
    if apart_along(wp.cross(a1 - a0, a2 - a0), r, a0, a1, a2, b0, b1, b2):
        return APART
    if apart_along((b0 + b1 + b2) - (a0 + a1 + a2), r, a0, a1, a2, b0, b1, b2):
        return APART
    if apart_along(wp.cross(b1 - b0, b2 - b0), r, a0, a1, a2, b0, b1, b2):
        return APART
    further_known = 2.0 * NOTHING_KNOWN
    rounding = ROUNDING * (wp.length(a0) + wp.length(b0))
    if overlapped(
        own.lower[t],
        own.upper[t],
        own.budget[t] - own.known[t] + rounding,
        other.lower[j],
        other.upper[j],
        other.budget[j] - other.known[j] + rounding,
    ):
        further_known = own.known[t] + other.known[j] + travel - rounding
    return wp.vec2(further_known, further)


@wp.kernel
def keep_close_kernel(
    triangles: wp.array(dtype=wp.vec2i),
    own: Side,
    other: Side,
    same: int,
    reach: Reach,
    group: wp.array(dtype=wp.int32),
    centre: wp.array(dtype=wp.vec3),
    half_way: wp.array(dtype=wp.vec3),
    threads: int,
    close_out: wp.array(dtype=wp.vec2i),
    between_out: wp.array(dtype=wp.vec2),
    counts: wp.array(dtype=wp.int32),
):
    """The pairs in which stencils come into question, and which."""
    for entry in range(wp.tid(), wp.min(counts[PAIRS], triangles.shape[0]), threads):
        pair = triangles[entry]
        between = in_question(own, other, pair[0], pair[1], same, reach, group, centre, half_way)
        if between[1] >= 0.0:
            slot = next_slot(counts, CLOSE)
            if slot < close_out.shape[0]:
                close_out[slot] = pair
                between_out[slot] = between


def pair_triangles(
    found: Found, cloth: Surface, other: Surface, region: Region, group: wp.array, anew: bool
) -> None:
    """Fill `found` with pairs of triangles, and the close ones among them, as far as there is room; none are counted
    before. `anew`: nothing is on the list of candidates."""
    device, same = found.counts.device, int(other is cloth)
    own, others = cloth.side, other.side
    walk(cloth, other, own, others, anew, found.triangles, found.counts)
    threads = threads_over(len(found.triangles), device)
    launch(
        keep_close_kernel,
        threads,
        [found.triangles, own, others, same, other.reach, group, region.centre, region.half_way, threads],
        [found.close, found.between, found.counts],
        device=device,
    )


def walk(
    cloth: Surface, other: Surface, own: Side, others: Side, anew: bool, triangles: wp.array, counts: wp.array
) -> None:
    """Fill `triangles` with the pairs whose boxes overlap, by the tree of the `other` surface; `own` and `others` are
    what is known of the two."""
    assert other.bvh is not None
    given = [own, others, other.bvh.id, other.gained, int(other is cloth), int(anew)]
    device, packets = counts.device, cloth.packets
    if packets is None:
        launch(pair_triangles_kernel, cloth.face_count, given, [triangles, counts], device=device)
    else:
        pair_packets(packets, given, triangles, counts)


def threads_over(room: int, device: wp.Device) -> int:
    """Of a launch over a list of which only the device knows how much of its room is taken: on a GPU as many as run in
    step, some of them. A CPU goes through it at once; its order stays that of the list."""
    return 1 if device.is_cpu else min(-(-room // WARP) * WARP, MOST_THREADS)
