"""How far each vertex may move: local continuous collision detection.

One shared time of impact lets a single armpit pair freeze the whole garment. Here each vertex has its own fraction
alpha of its displacement. A candidate that would come too close shortens its own four vertices; shortening changes the
paths of their neighbours' stencils, so the check is repeated until a whole pass shortens nothing. Fractions only
shrink, hence it ends; then every candidate has been proven free along exactly the paths taken. No global time of
impact, in the spirit of the local bounds of Lan et al. 2023 and of offset geometric contact (2025), with exact paths
instead of spheres.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.contact.candidates import Candidates, ContactSizes, VertexBoxes
from tryon_solver.contact.ccd import time_of_impact
from tryon_solver.contact.distances import stencil_vector, stencil_weights

wp.set_module_options({"enable_backward": False})

KEPT_GAP = 0.1  # share of a pair's gap above xi that one move may not use up, so that the next barrier step can act
SHORTEN = 0.98  # of a found time of impact, so that rounding of the shortened path can't land under the floor
MOST_PASSES = 60


@wp.func
def offset(ids: wp.vec4i, kind: int, cloth_count: int, sizes: ContactSizes) -> float:
    """Thickness offset xi [m] of a stencil."""
    second = ids[1]
    if kind == 1:
        second = ids[2]
    if ids[0] >= cloth_count or second >= cloth_count:
        return sizes.xi_body
    return sizes.xi_self


@wp.kernel
def shorten_kernel(
    ids: wp.array(dtype=wp.vec4i),
    kind: wp.array(dtype=wp.int32),
    distance: wp.array(dtype=wp.float32),
    moved: float,
    longest: float,
    cloth_count: int,
    sizes: ContactSizes,
    x: wp.array(dtype=wp.vec3),
    displacement: wp.array(dtype=wp.vec3),
    number: int,
    near: wp.array(dtype=wp.int32),
    near_count: wp.array(dtype=wp.int32),
    changed: wp.array(dtype=wp.int32),
    alpha: wp.array(dtype=wp.float32),
    hits_out: wp.array(dtype=wp.int32),
):
    """Pass 0 looks at every stencil and lists those that their vertices' own travel could close, at any fractions.

    Later passes look at the listed ones with a vertex that the pass before, or this one so far, has shortened.
    """
    c = wp.tid()
    if number > 0:
        c = near[c]
    apart = (1.0 - KEPT_GAP) * (distance[c] - 2.0 * moved - wp.max(sizes.xi_body, sizes.xi_self))
    if apart > 2.0 * longest:
        return
    v = ids[c]
    if number > 0:
        newest = wp.max(wp.max(changed[v[0]], changed[v[1]]), wp.max(changed[v[2]], changed[v[3]]))
        if newest < number - 1:
            return
    a0 = alpha[v[0]]
    a1 = alpha[v[1]]
    a2 = alpha[v[2]]
    a3 = alpha[v[3]]
    x0 = x[v[0]]
    x1 = x[v[1]]
    x2 = x[v[2]]
    x3 = x[v[3]]
    p0 = a0 * displacement[v[0]]
    p1 = a1 * displacement[v[1]]
    p2 = a2 * displacement[v[2]]
    p3 = a3 * displacement[v[3]]
    xi = offset(v, kind[c], cloth_count, sizes)
    furthest = wp.max(wp.max(wp.length_sq(p0), wp.length_sq(p1)), wp.max(wp.length_sq(p2), wp.length_sq(p3)))
    if (1.0 - KEPT_GAP) * (distance[c] - 2.0 * moved - xi) > 2.0 * wp.sqrt(furthest):
        return
    if number == 0:
        near[wp.atomic_add(near_count, 0, 1)] = c
    d = wp.length(stencil_vector(stencil_weights(kind[c], x0, x1, x2, x3), x0, x1, x2, x3))
    mean = 0.25 * (p0 + p1 + p2 + p3)
    travel = wp.max(
        wp.max(wp.length_sq(p0 - mean), wp.length_sq(p1 - mean)),
        wp.max(wp.length_sq(p2 - mean), wp.length_sq(p3 - mean)),
    )
    # a pair already at or under xi may part, and may not come closer than it is
    floor = 0.98 * d
    if d > xi:
        floor = wp.min(xi + KEPT_GAP * (d - xi), floor)
    if d - 2.0 * wp.sqrt(travel) >= floor:
        return
    toi = time_of_impact(kind[c], floor, x0, x1, x2, x3, p0, p1, p2, p3)
    if toi < 1.0:
        shorter = SHORTEN * toi
        wp.atomic_min(alpha, v[0], shorter * a0)
        wp.atomic_min(alpha, v[1], shorter * a1)
        wp.atomic_min(alpha, v[2], shorter * a2)
        wp.atomic_min(alpha, v[3], shorter * a3)
        for k in range(4):
            changed[v[k]] = number
        wp.atomic_add(hits_out, 0, 1)


@wp.kernel
def stay_in_box_kernel(
    x: wp.array(dtype=wp.vec3),
    displacement: wp.array(dtype=wp.vec3),
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    alpha_out: wp.array(dtype=wp.float32),
):
    """Largest fraction that keeps the vertex in its box, where the candidate list is complete."""
    i = wp.tid()
    t = float(1.0)
    for k in range(3):
        step = displacement[i][k]
        if step > 0.0:
            t = wp.min(t, (upper[i][k] - x[i][k]) / step)
        elif step < 0.0:
            t = wp.min(t, (lower[i][k] - x[i][k]) / step)
    alpha_out[i] = wp.max(t, 0.0)


@wp.kernel
def leaving_kernel(
    x: wp.array(dtype=wp.vec3),
    displacement: wp.array(dtype=wp.vec3),
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    leaving_out: wp.array(dtype=wp.int32),
):
    i = wp.tid()
    there = x[i] + displacement[i]
    for k in range(3):
        if there[k] < lower[i][k] or there[k] > upper[i][k]:
            leaving_out[0] = 1


@wp.kernel
def move_kernel(
    x: wp.array(dtype=wp.vec3),
    displacement: wp.array(dtype=wp.vec3),
    alpha: wp.array(dtype=wp.float32),
    x_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    x_out[i] = x[i] + alpha[i] * displacement[i]


def leaving(x: wp.array, displacement: wp.array, boxes: VertexBoxes, flag: wp.array) -> bool:
    """Would any vertex leave its box? `flag` (1,) int32 is scratch."""
    flag.zero_()
    wp.launch(leaving_kernel, len(x), [x, displacement, boxes.lower, boxes.upper], [flag], device=x.device)
    return bool(flag.numpy()[0])


def stay_in_boxes(x: wp.array, displacement: wp.array, boxes: VertexBoxes, alpha_out: wp.array) -> None:
    """Set alpha to the largest fractions that keep every vertex in its box."""
    wp.launch(
        stay_in_box_kernel, len(x), [x, displacement, boxes.lower, boxes.upper], [alpha_out], device=x.device
    )


def shorten(
    candidates: Candidates,
    cloth_count: int,
    sizes: ContactSizes,
    x: wp.array,
    displacement: wp.array,
    longest: float,
    alpha: wp.array,
    changed: wp.array,
    hits: wp.array,
) -> int:
    """Shrink `alpha` until the move x + alpha * displacement is proven free; returns the passes it took.

    `longest` m bounds the displacements; `changed` (A,) int32 is scratch. If MOST_PASSES do not suffice, alpha becomes
    zero everywhere: nobody moves, which is always free.
    """
    if candidates.size == 0:
        return 0
    changed.fill_(-2)
    candidates.near_count.zero_()
    count = candidates.size
    for done in range(MOST_PASSES):
        hits.zero_()
        wp.launch(
            shorten_kernel,
            count,
            [
                candidates.ids,
                candidates.kind,
                candidates.distance,
                candidates.moved,
                longest,
                cloth_count,
                sizes,
                x,
                displacement,
                done,
            ],
            [candidates.near, candidates.near_count, changed, alpha, hits],
            device=x.device,
        )
        if int(hits.numpy()[0]) == 0:
            return done
        if done == 0:
            count = int(candidates.near_count.numpy()[0])
    alpha.zero_()
    return MOST_PASSES
