"""Broad phase: which stencils could come into reach while their vertices stay in a region.

Triangles whose boxes overlap are looked at pair by pair; what separates them along an axis passes them over, the rest
are taken apart into the stencils whose vertices and edges they own.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import warp as wp

from tryon_solver.contact.candidates import Candidates, Found, Region
from tryon_solver.contact.distances import approach, stencil_vector, stencil_weights
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
        smallest_of(j0, j1, j2) - largest_of(i0, i1, i2) > far
        or smallest_of(i0, i1, i2) - largest_of(j0, j1, j2) > far
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
def emit(
    kind: int,
    r: float,
    r_known: float,
    v: wp.vec4i,
    group: wp.vec4i,
    x0: wp.vec3,
    x1: wp.vec3,
    x2: wp.vec3,
    x3: wp.vec3,
    x: wp.array(dtype=wp.vec3),
    ids_out: wp.array(dtype=wp.vec4i),
    kind_out: wp.array(dtype=wp.int32),
    distance_out: wp.array(dtype=wp.float32),
    count_out: wp.array(dtype=wp.int32),
):
    """Append the stencil unless it shares a vertex or its distance is not in (r_known, r]; what is stored is for x.

    Of two edges the one whose first vertex has the lower number comes first, whoever was looked for: by these numbers
    contacts are known again (effects/presliding.py).
    """
    if group[0] == group[2] or group[0] == group[3]:
        return
    if kind == 0:
        if group[0] == group[1]:
            return
    elif group[1] == group[2] or group[1] == group[3]:
        return
    lam = stencil_weights(kind, x0, x1, x2, x3)
    d = wp.length(stencil_vector(lam, x0, x1, x2, x3))
    if d > r or d <= r_known:
        return
    slot = wp.atomic_add(count_out, 0, 1)
    if slot < ids_out.shape[0]:
        ids_out[slot] = v
        if kind == 1 and v[2] < v[0]:
            ids_out[slot] = wp.vec4i(v[2], v[3], v[0], v[1])
        kind_out[slot] = kind
        distance_out[slot] = d - approach(kind, x[v[0]] - x0, x[v[1]] - x1, x[v[2]] - x2, x[v[3]] - x3)


@wp.func
def overlapped(
    lower: wp.vec3, upper: wp.vec3, grown: float, other_lower: wp.vec3, other_upper: wp.vec3, other_grown: float
) -> bool:
    """Did two boxes overlap before they were grown on every side? Else no stencil of theirs is on the list."""
    both = grown + other_grown
    room = wp.min(other_upper - lower, upper - other_lower)
    return smallest_of(room[0], room[1], room[2]) >= both


@wp.kernel
def pair_surfaces_kernel(
    faces: wp.array(dtype=wp.vec3i),
    owned: wp.array(dtype=wp.int32),
    face_lower: wp.array(dtype=wp.vec3),
    face_upper: wp.array(dtype=wp.vec3),
    face_budget: wp.array(dtype=wp.float32),
    face_known: wp.array(dtype=wp.float32),
    other_bvh: wp.uint64,
    other_faces: wp.array(dtype=wp.vec3i),
    other_owned: wp.array(dtype=wp.int32),
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
    x: wp.array(dtype=wp.vec3),
    ids_out: wp.array(dtype=wp.vec4i),
    kind_out: wp.array(dtype=wp.int32),
    distance_out: wp.array(dtype=wp.float32),
    count_out: wp.array(dtype=wp.int32),
):
    """Stencils between triangle tid and every triangle of the other surface whose box overlaps its own.

    Around their centres two triangles can approach by no more than their vertices' longest half ways, taken relative to
    the mean of all six, and by their budgets. Stencils that a search with the budgets in `known` found are on the list
    already.
    `same` is 1 when both surfaces are the cloth: then each unordered pair of triangles is met once and gives both ways'
    points.
    """
    t = wp.tid()
    gained = face_budget[t] > face_known[t]
    if not gained and (same == 1 or other_gained[0] == 0):
        return
    f = faces[t]
    mine = owned[t]
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
        theirs = other_owned[j]
        for k in range(3):
            xa = a0
            xb = b0
            if k == 1:
                xa = a1
                xb = b1
            elif k == 2:
                xa = a2
                xb = b2
            if (mine & (1 << k)) != 0:
                emit(
                    0,
                    r,
                    r_known,
                    wp.vec4i(f[k], g[0], g[1], g[2]),
                    wp.vec4i(ga[k], gb[0], gb[1], gb[2]),
                    xa,
                    b0,
                    b1,
                    b2,
                    x,
                    ids_out,
                    kind_out,
                    distance_out,
                    count_out,
                )
            if (theirs & (1 << k)) != 0:
                emit(
                    0,
                    r,
                    r_known,
                    wp.vec4i(g[k], f[0], f[1], f[2]),
                    wp.vec4i(gb[k], ga[0], ga[1], ga[2]),
                    xb,
                    a0,
                    a1,
                    a2,
                    x,
                    ids_out,
                    kind_out,
                    distance_out,
                    count_out,
                )
            if (mine & (8 << k)) != 0:
                xe = a1
                if k == 1:
                    xe = a2
                elif k == 2:
                    xe = a0
                e = (k + 1) % 3
                for m in range(3):
                    if (theirs & (8 << m)) != 0:
                        y0 = b0
                        y1 = b1
                        if m == 1:
                            y0 = b1
                            y1 = b2
                        elif m == 2:
                            y0 = b2
                            y1 = b0
                        h = (m + 1) % 3
                        emit(
                            1,
                            r,
                            r_known,
                            wp.vec4i(f[k], f[e], g[m], g[h]),
                            wp.vec4i(ga[k], ga[e], gb[m], gb[h]),
                            xa,
                            xe,
                            y0,
                            y1,
                            x,
                            ids_out,
                            kind_out,
                            distance_out,
                            count_out,
                        )


NOTHING_KNOWN = -1.0e3  # m, a budget that covers no stencil


def find(
    candidates: Candidates,
    cloth: Surface,
    others: tuple[Surface, ...],
    region: Region,
    group: wp.array,
    x: wp.array,
    reach: float,
) -> None:
    """Fill `candidates` with every stencil that can come within `reach` m while its vertices stay in the region.

    `others` are the surfaces the scene lets the cloth touch: itself, the body, or both. Stencils with two vertices of
    one `group` (A,) are skipped: a vertex of its own, or vertices being sewn into one. x (A,) m is where the vertices
    are now, for the distances. Grows the list when it is full.
    """
    candidates.clear()
    for surface in (cloth, *others):
        surface.budget.fill_(NOTHING_KNOWN)
    extend(candidates, cloth, others, region, group, x, reach)


def extend(
    candidates: Candidates,
    cloth: Surface,
    others: tuple[Surface, ...],
    region: Region,
    group: wp.array,
    x: wp.array,
    reach: float,
) -> None:
    """Add to `candidates` the stencils that come into question because budgets have grown since they were found.

    Arguments as in `find`; the region's paths must be the same. A budget that has shrunk counts as it was.
    """
    device = x.device
    for surface in {id(s): s for s in (cloth, *others)}.values():
        surface.refit(region.centre, region.half_way, region.budget, 0.5 * reach)
    while len(candidates.found) < len(others):
        candidates.found.append(Found.allocate(candidates.capacity, str(device)))

    def search(k: int) -> None:
        other, found = others[k], candidates.found[k]
        assert other.bvh is not None
        found.count.zero_()
        wp.launch(
            pair_surfaces_kernel,
            cloth.face_count,
            [
                cloth.faces,
                cloth.owned,
                cloth.lower,
                cloth.upper,
                cloth.budget,
                cloth.known,
                other.bvh.id,
                other.faces,
                other.owned,
                other.lower,
                other.upper,
                other.budget,
                other.known,
                other.gained,
                int(other is cloth),
                reach,
                group,
                region.centre,
                region.half_way,
                x,
            ],
            [found.ids, found.kind, found.distance, found.count],
            device=device,
        )

    at_once(search, len(others), device)
    for k in range(len(others)):
        found = int(candidates.found[k].count.numpy()[0])
        if found > len(candidates.found[k].ids):
            candidates.found[k] = Found.allocate(1 << (found - 1).bit_length(), str(device))
            search(k)
        candidates.append(candidates.found[k], found)


OTHER_CORE = ThreadPoolExecutor(max_workers=1)  # starts its thread with its first task


def at_once(search: Callable[[int], None], count: int, device: wp.Device) -> None:
    """Run the searches 0 to count - 1.

    On a CPU Warp runs a kernel on the thread that launches it: there all but the first go to another one.
    """
    here = range(min(count, 1)) if device.is_cpu else range(count)
    elsewhere = [OTHER_CORE.submit(search, k) for k in range(len(here), count)]
    for k in here:
        search(k)
    for searched in elsewhere:
        searched.result()
