"""Broad phase: which stencils could come into reach while their vertices move within given boxes.

A *candidate* is a stencil from the broad phase, not yet a contact. Stencils that share a vertex are no candidates, nor
are stencils of body vertices alone (a posed body crosses itself freely).
"""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from tryon_solver.contact.distances import stencil_vector, stencil_weights
from tryon_solver.contact.surfaces import Surface, swept_boxes_kernel

wp.set_module_options({"enable_backward": False})


@wp.struct
class ContactSizes:
    """Lengths [m] of the contact model, one number for contact with the body and one for cloth on cloth."""

    xi_body: float
    xi_self: float
    d_hat: float


@dataclass
class Candidates:
    """Stencils: `ids` vec4i, `kind` int32 (POINT_TRIANGLE, EDGE_EDGE), `count` int32[1] on the device and `size` here.

    `distance` m is that of the positions the list was made at; `moved` m bounds how far any vertex has moved since, so
    that most stencils can be passed over without looking at their vertices. `capacity` grows when the broad phase finds
    more; nothing is ever dropped.
    """

    ids: wp.array
    kind: wp.array
    distance: wp.array
    count: wp.array
    capacity: int
    size: int = 0
    moved: float = 0.0

    @staticmethod
    def allocate(capacity: int, device: str) -> Candidates:
        """Empty list with room for `capacity` stencils."""
        return Candidates(
            wp.zeros(capacity, dtype=wp.vec4i, device=device),
            wp.zeros(capacity, dtype=wp.int32, device=device),
            wp.zeros(capacity, dtype=wp.float32, device=device),
            wp.zeros(1, dtype=wp.int32, device=device),
            capacity,
        )


@wp.func
def furthest(a: wp.vec3, b: wp.vec3, c: wp.vec3) -> float:
    return wp.sqrt(wp.max(wp.length_sq(a), wp.max(wp.length_sq(b), wp.length_sq(c))))


@wp.func
def relative_travel(kind: int, relative: int, p0: wp.vec3, p1: wp.vec3, p2: wp.vec3, p3: wp.vec3) -> float:
    """Bound on how much two primitives can approach [m].

    With `relative` set only their relative motion counts, which holds as long as no displacement is shortened.
    """
    mean = wp.vec3()
    if relative == 1:
        mean = 0.25 * (p0 + p1 + p2 + p3)
    if kind == 0:
        return wp.length(p0 - mean) + furthest(p1 - mean, p2 - mean, p3 - mean)
    return wp.sqrt(wp.max(wp.length_sq(p0 - mean), wp.length_sq(p1 - mean))) + wp.sqrt(
        wp.max(wp.length_sq(p2 - mean), wp.length_sq(p3 - mean))
    )


@wp.func
def overlap(
    lower: wp.array(dtype=wp.vec3), upper: wp.array(dtype=wp.vec3), kind: int, i0: int, i1: int, i2: int, i3: int
) -> bool:
    """Do the boxes of the two primitives overlap?"""
    la = lower[i0]
    ua = upper[i0]
    lb = wp.min(lower[i2], lower[i3])
    ub = wp.max(upper[i2], upper[i3])
    if kind == 0:
        lb = wp.min(lb, lower[i1])
        ub = wp.max(ub, upper[i1])
    else:
        la = wp.min(la, lower[i1])
        ua = wp.max(ua, upper[i1])
    return (
        la[0] <= ub[0] and lb[0] <= ua[0] and la[1] <= ub[1] and lb[1] <= ua[1] and la[2] <= ub[2] and lb[2] <= ua[2]
    )


@wp.func
def emit(
    kind: int,
    relative: int,
    reach: float,
    i0: int,
    i1: int,
    i2: int,
    i3: int,
    group: wp.array(dtype=wp.int32),
    x: wp.array(dtype=wp.vec3),
    p: wp.array(dtype=wp.vec3),
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    ids_out: wp.array(dtype=wp.vec4i),
    kind_out: wp.array(dtype=wp.int32),
    distance_out: wp.array(dtype=wp.float32),
    count_out: wp.array(dtype=wp.int32),
):
    g0 = group[i0]
    g1 = group[i1]
    g2 = group[i2]
    g3 = group[i3]
    if g0 == g2 or g0 == g3:
        return
    if kind == 0:
        if g0 == g1:
            return
    elif g1 == g2 or g1 == g3:
        return
    if not overlap(lower, upper, kind, i0, i1, i2, i3):
        return
    lam = stencil_weights(kind, x[i0], x[i1], x[i2], x[i3])
    d = wp.length(stencil_vector(lam, x[i0], x[i1], x[i2], x[i3]))
    if d > reach + relative_travel(kind, relative, p[i0], p[i1], p[i2], p[i3]):
        return
    slot = wp.atomic_add(count_out, 0, 1)
    if slot < ids_out.shape[0]:
        ids_out[slot] = wp.vec4i(i0, i1, i2, i3)
        kind_out[slot] = kind
        distance_out[slot] = d


@wp.func
def apart(
    r: float, a0: wp.vec3, a1: wp.vec3, a2: wp.vec3, b0: wp.vec3, b1: wp.vec3, b2: wp.vec3
) -> bool:
    """Does triangle a's plane separate the triangles by more than r? Then no stencil of theirs is closer than r."""
    n = wp.cross(a1 - a0, a2 - a0)
    h0 = wp.dot(n, b0 - a0)
    h1 = wp.dot(n, b1 - a0)
    h2 = wp.dot(n, b2 - a0)
    far = r * wp.length(n)
    return wp.min(h0, wp.min(h1, h2)) > far or wp.max(h0, wp.max(h1, h2)) < -far


@wp.func
def separated(
    relative: int, reach: float, f: wp.vec3i, g: wp.vec3i, x: wp.array(dtype=wp.vec3), p: wp.array(dtype=wp.vec3)
) -> bool:
    """Are all stencils of two triangles out of reach, by the triangles' own planes?"""
    mean = wp.vec3()
    if relative == 1:
        mean = (p[f[0]] + p[f[1]] + p[f[2]] + p[g[0]] + p[g[1]] + p[g[2]]) / 6.0
    travel = furthest(p[f[0]] - mean, p[f[1]] - mean, p[f[2]] - mean) + furthest(
        p[g[0]] - mean, p[g[1]] - mean, p[g[2]] - mean
    )
    r = reach + travel
    return apart(r, x[f[0]], x[f[1]], x[f[2]], x[g[0]], x[g[1]], x[g[2]]) or apart(
        r, x[g[0]], x[g[1]], x[g[2]], x[f[0]], x[f[1]], x[f[2]]
    )


@wp.kernel
def pair_surfaces_kernel(
    faces: wp.array(dtype=wp.vec3i),
    owned: wp.array(dtype=wp.int32),
    face_lower: wp.array(dtype=wp.vec3),
    face_upper: wp.array(dtype=wp.vec3),
    other_bvh: wp.uint64,
    other_faces: wp.array(dtype=wp.vec3i),
    other_owned: wp.array(dtype=wp.int32),
    same: int,
    relative: int,
    reach: float,
    group: wp.array(dtype=wp.int32),
    x: wp.array(dtype=wp.vec3),
    p: wp.array(dtype=wp.vec3),
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    ids_out: wp.array(dtype=wp.vec4i),
    kind_out: wp.array(dtype=wp.int32),
    distance_out: wp.array(dtype=wp.float32),
    count_out: wp.array(dtype=wp.int32),
):
    """Stencils between triangle tid and every triangle of the other surface whose box overlaps its own.

    `same` is 1 when both are the cloth: then each unordered pair of triangles is met twice and takes points from the
    first only, edges once.
    """
    t = wp.tid()
    f = faces[t]
    mine = owned[t]
    query = wp.bvh_query_aabb(other_bvh, face_lower[t], face_upper[t])
    j = int(0)
    while wp.bvh_query_next(query, j):
        if same == 1 and j == t:
            continue
        g = other_faces[j]
        if separated(relative, reach, f, g, x, p):
            continue
        theirs = other_owned[j]
        for k in range(3):
            if (mine & (1 << k)) != 0:
                emit(
                    0,
                    relative,
                    reach,
                    f[k],
                    g[0],
                    g[1],
                    g[2],
                    group,
                    x,
                    p,
                    lower,
                    upper,
                    ids_out,
                    kind_out,
                    distance_out,
                    count_out,
                )
            if same == 0 and (theirs & (1 << k)) != 0:
                emit(
                    0,
                    relative,
                    reach,
                    g[k],
                    f[0],
                    f[1],
                    f[2],
                    group,
                    x,
                    p,
                    lower,
                    upper,
                    ids_out,
                    kind_out,
                    distance_out,
                    count_out,
                )
        if same == 1 and j < t:
            continue
        for k in range(3):
            if (mine & (8 << k)) != 0:
                a0 = f[k]
                a1 = f[(k + 1) % 3]
                for m in range(3):
                    if (theirs & (8 << m)) != 0:
                        b0 = g[m]
                        b1 = g[(m + 1) % 3]
                        emit(
                    1,
                    relative,
                    reach,
                    a0,
                    a1,
                    b0,
                    b1,
                    group,
                    x,
                    p,
                    lower,
                    upper,
                    ids_out,
                    kind_out,
                    distance_out,
                    count_out,
                )


@dataclass
class VertexBoxes:
    """Boxes [m] within which each vertex may move while a candidate list stays complete."""

    lower: wp.array
    upper: wp.array

    @staticmethod
    def allocate(count: int, device: str) -> VertexBoxes:
        return VertexBoxes(
            wp.zeros(count, dtype=wp.vec3, device=device), wp.zeros(count, dtype=wp.vec3, device=device)
        )


def sweep(boxes: VertexBoxes, x: wp.array, displacement: wp.array, margin: float) -> None:
    """Set the boxes to the vertices' straight paths, grown by `margin` m."""
    wp.launch(
        swept_boxes_kernel, len(x), [x, displacement, margin], [boxes.lower, boxes.upper], device=x.device
    )


def find(
    candidates: Candidates,
    cloth: Surface,
    others: tuple[Surface, ...],
    boxes: VertexBoxes,
    group: wp.array,
    x: wp.array,
    displacement: wp.array,
    reach: float,
    relative: bool,
) -> None:
    """Fill `candidates` with every stencil that can come within `reach` m while vertices move as swept.

    `others` are the surfaces the scene lets the cloth touch: itself, the body, or both. Stencils with two vertices of
    one `group` (A,) are skipped: a vertex of its own, or vertices being sewn into one. Grows the list when it is full.
    """
    device = x.device
    for surface in {id(s): s for s in (cloth, *others)}.values():
        surface.refit(boxes.lower, boxes.upper)
    while True:
        candidates.count.zero_()
        for other in others:
            assert other.bvh is not None
            wp.launch(
                pair_surfaces_kernel,
                cloth.face_count,
                [
                    cloth.faces,
                    cloth.owned,
                    cloth.lower,
                    cloth.upper,
                    other.bvh.id,
                    other.faces,
                    other.owned,
                    int(other is cloth),
                    int(relative),
                    reach,
                    group,
                    x,
                    displacement,
                    boxes.lower,
                    boxes.upper,
                ],
                [candidates.ids, candidates.kind, candidates.distance, candidates.count],
                device=device,
            )
        found = int(candidates.count.numpy()[0])
        if found <= candidates.capacity:
            candidates.size, candidates.moved = found, 0.0
            return
        capacity = 1 << (found - 1).bit_length()
        candidates.ids = wp.zeros(capacity, dtype=wp.vec4i, device=device)
        candidates.kind = wp.zeros(capacity, dtype=wp.int32, device=device)
        candidates.distance = wp.zeros(capacity, dtype=wp.float32, device=device)
        candidates.capacity = capacity
