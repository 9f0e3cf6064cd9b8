"""How far each vertex may move: local continuous collision detection.

One shared time of impact lets a single armpit pair freeze the whole garment. Here each vertex has its own fraction
alpha of its displacement. A candidate that would come too close shortens its own four vertices; shortening changes the
paths of their neighbours' stencils, so the check is repeated until a whole pass shortens nothing. Fractions only
shrink, hence it ends; then every candidate has been proven free along exactly the paths taken. No global time of
impact, in the spirit of the local bounds of Lan et al. 2023 and of offset geometric contact (2025), with exact paths
instead of spheres.
"""

from __future__ import annotations

from collections.abc import Callable

import warp as wp

from tryon_solver.contact.candidates import Candidates, ContactSizes, candidate_at, offset
from tryon_solver.contact.ccd import time_of_impact
from tryon_solver.contact.distances import approach, stencil_vector, stencil_weights
from tryon_solver.contact.filtering import HITS, MORE, NUMBER, Passes
from tryon_solver.contact.region import Region
from tryon_solver.linalg.clear import clear
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read

wp.set_module_options({"enable_backward": False})

KEPT_GAP = 0.1  # share of a pair's gap above xi that one move may not use up, so that the next barrier step can act; of
# a gap wider than the barrier reaches, of that: what slides passes closer by than a share of how far it was ahead
CREEP = 0.02  # share of its distance that a pair at or under xi may lose in one move, so that it can slide
LEAST = 0.52  # of xi: down to here, above the share at which a commit is void
PARTING = 1.0e-5  # share of its distance that it may lose even there: with none at all, it could not part either
SHORTEN = 0.98  # of a found time of impact, so that rounding of the shortened path can't land under the floor
BORDER = 1.0e-2  # share of its budget, squared, by which a vertex outside of its region still counts as on its border
MOST_PASSES = 60


@wp.func
def floor_of(d: float, xi: float, d_hat: float) -> float:
    """Distance [m] down to which a pair at d may come in one move; its barrier acts below xi + d_hat."""
    # a pair already at or under xi may part; let come closer without end, its commits would be void for ever
    floor = wp.max((1.0 - CREEP) * d, wp.min(LEAST * xi, (1.0 - PARTING) * d))
    if d > xi:
        floor = wp.min(xi + KEPT_GAP * wp.min(d - xi, d_hat), floor)
    return floor


@wp.kernel
def shorten_kernel(
    near: wp.array(dtype=wp.int32),
    listed: wp.array(dtype=wp.int32),
    some: int,
    threads: int,
    ids: wp.array(dtype=wp.vec4i),
    kind: wp.array(dtype=wp.int32),
    distance: wp.array(dtype=wp.float32),
    cloth_count: int,
    sizes: ContactSizes,
    x: wp.array(dtype=wp.vec3),
    displacement: wp.array(dtype=wp.vec3),
    before: wp.array(dtype=wp.float32),
    changed: wp.array(dtype=wp.int32),
    alpha: wp.array(dtype=wp.float32),
    passes: wp.array(dtype=wp.int32),
):
    """Pass 0 looks at every stencil, later ones at those with a vertex that the pass before, or this one so far, has
    shortened; it goes by `before`."""
    if passes[MORE] == 0:
        return
    for entry in range(wp.tid(), listed[0], threads):
        c = candidate_at(near, some, entry)
        v = ids[c]
        number = passes[NUMBER]
        if number > 0:
            newest = wp.max(wp.max(changed[v[0]], changed[v[1]]), wp.max(changed[v[2]], changed[v[3]]))
            if newest < number - 1:
                continue
        a0 = before[v[0]]
        a1 = before[v[1]]
        a2 = before[v[2]]
        a3 = before[v[3]]
        p0 = a0 * displacement[v[0]]
        p1 = a1 * displacement[v[1]]
        p2 = a2 * displacement[v[2]]
        p3 = a3 * displacement[v[3]]
        xi = offset(v, cloth_count, sizes)
        closer = approach(kind[c], p0, p1, p2, p3)
        if (1.0 - KEPT_GAP) * (distance[c] - xi) > closer:
            continue
        x0 = x[v[0]]
        x1 = x[v[1]]
        x2 = x[v[2]]
        x3 = x[v[3]]
        d = wp.length(stencil_vector(stencil_weights(kind[c], x0, x1, x2, x3), x0, x1, x2, x3))
        floor = floor_of(d, xi, sizes.d_hat)
        if d - closer >= floor:
            continue
        toi = time_of_impact(kind[c], floor, x0, x1, x2, x3, p0, p1, p2, p3)
        if toi < 1.0:
            shorter = SHORTEN * toi
            wp.atomic_min(alpha, v[0], shorter * a0)
            wp.atomic_min(alpha, v[1], shorter * a1)
            wp.atomic_min(alpha, v[2], shorter * a2)
            wp.atomic_min(alpha, v[3], shorter * a3)
            for k in range(4):
                changed[v[k]] = number
            wp.atomic_add(passes, HITS, 1)


@wp.kernel
def give_up_kernel(passes: wp.array(dtype=wp.int32), most: int, alpha_out: wp.array(dtype=wp.float32)):
    """Nobody moves where `most` passes did not suffice."""
    i = wp.tid()
    if passes[NUMBER] >= most:
        alpha_out[i] = 0.0


@wp.kernel
def stay_kernel(
    x: wp.array(dtype=wp.vec3),
    displacement: wp.array(dtype=wp.vec3),
    anchor: wp.array(dtype=wp.vec3),
    budget: wp.array(dtype=wp.float32),
    alpha_out: wp.array(dtype=wp.float32),
):
    """Largest fraction that keeps the vertex within its budget of its anchor, where the candidate list is complete."""
    i = wp.tid()
    here = x[i] - anchor[i]
    there = here + displacement[i]
    alpha_out[i] = 1.0
    if wp.length_sq(there) > budget[i] * budget[i]:
        # |here + t p| = budget for the larger t, or |here| where a move ended on the border and rounding put it outside
        a = wp.length_sq(displacement[i])
        b = wp.dot(here, displacement[i])
        c = wp.length_sq(here) - budget[i] * budget[i]
        t = float(0.0)
        if a > 0.0 and c < BORDER * budget[i] * budget[i]:
            t = wp.clamp((wp.sqrt(b * b - a * wp.min(c, 0.0)) - b) / a, 0.0, 1.0)
        alpha_out[i] = t


@wp.kernel
def leaving_kernel(
    x: wp.array(dtype=wp.vec3),
    displacement: wp.array(dtype=wp.vec3),
    alpha: wp.array(dtype=wp.float32),
    anchor: wp.array(dtype=wp.vec3),
    budget: wp.array(dtype=wp.float32),
    leaving_out: wp.array(dtype=wp.int32),
):
    i = wp.tid()
    if wp.length_sq(x[i] + alpha[i] * displacement[i] - anchor[i]) > budget[i] * budget[i]:
        wp.atomic_add(leaving_out, 0, 1)


def count_leaving(
    x: wp.array, displacement: wp.array, alpha: wp.array, region: Region, count_out: wp.array
) -> None:
    """Count (int32) the vertices that x + alpha * displacement takes further than their budget from their anchors."""
    clear(count_out)
    launch(
        leaving_kernel,
        len(x),
        [x, displacement, alpha, region.anchor, region.budget],
        [count_out],
        device=x.device,
    )


@wp.kernel
def outside_kernel(
    x: wp.array(dtype=wp.vec3),
    displacement: wp.array(dtype=wp.vec3),
    further: wp.array(dtype=wp.vec3),
    anchor: wp.array(dtype=wp.vec3),
    budget: wp.array(dtype=wp.float32),
    outside_out: wp.array(dtype=wp.int32),
):
    """One within a ball at both ends of a straight way is so all along it."""
    i = wp.tid()
    here = x[i] - anchor[i]
    there = here + displacement[i]
    if wp.max(wp.length_sq(here), wp.length_sq(there)) > budget[i] * budget[i]:
        wp.atomic_add(outside_out, 0, 1)
    if wp.length_sq(there + further[i]) > budget[i] * budget[i]:
        wp.atomic_add(outside_out, 1, 1)


@wp.kernel
def allowed_kernel(
    displacement: wp.array(dtype=wp.vec3), alpha: wp.array(dtype=wp.float32), allowed_out: wp.array(dtype=wp.vec3)
):
    i = wp.tid()
    allowed_out[i] = alpha[i] * displacement[i]


def find_allowed(displacement: wp.array, alpha: wp.array, allowed_out: wp.array) -> None:
    """What alpha leaves of each vertex's displacement, both of (A,) vectors m."""
    launch(allowed_kernel, len(displacement), [displacement, alpha], [allowed_out], device=displacement.device)


def outside(x: wp.array, displacement: wp.array, further: wp.array, region: Region) -> tuple[int, int]:
    """How many vertices are further than their budget from their anchors somewhere on the way from x (A,) m along
    `displacement`, and how many where they would be if they went `further` (A,) m from its end, for the host, which
    waits for it."""
    clear(region.outside)
    inputs = [x, displacement, further, region.anchor, region.budget]
    launch(outside_kernel, len(x), inputs, [region.outside], device=x.device)
    now, then = read(region.outside)[0]
    return int(now), int(then)


def leaving(x: wp.array, displacement: wp.array, alpha: wp.array, region: Region, counter: wp.array) -> int:
    """The same for the host, which waits for it. `counter` (1,) int32 is scratch."""
    count_leaving(x, displacement, alpha, region, counter)
    return int(read(counter)[0][0])


def stay_in_region(x: wp.array, displacement: wp.array, region: Region, alpha_out: wp.array) -> None:
    """Set alpha to the largest fractions that keep every vertex within its budget of its anchor."""
    launch(
        stay_kernel, len(x), [x, displacement, region.anchor, region.budget], [alpha_out], device=x.device
    )


def shorten(
    candidates: Candidates,
    near: bool,
    cloth_count: int,
    sizes: ContactSizes,
    x: wp.array,
    displacement: wp.array,
    alpha: wp.array,
    before: wp.array,
    changed: wp.array,
    passes: Passes,
    level: Callable[[], None] | None = None,
) -> None:
    """Shrink `alpha` until the move x + alpha * displacement is proven free.

    With `near` only the near list is looked at, which must have been made for it. `before` (A,) float32, `changed` (A,)
    int32 and `passes` are scratch; the last tells how many passes it took. By `before` threads that run at once go by
    the fractions that the pass began with, so that it matters to none who was first; where it has no places they go by
    those that others have just made, and shorten less. If MOST_PASSES do not suffice, alpha becomes zero everywhere:
    nobody moves, which is always free. `level` is launched after each pass, and may shrink fractions further, which it
    tells in `changed`.
    """
    count, entries = candidates.entries(near)
    changed.fill_(-2)
    begun_with = before if len(before) else alpha

    def shorten_once() -> None:
        if len(before):
            wp.copy(before, alpha)
        launch(
            shorten_kernel,
            count,
            [
                *entries,
                candidates.ids,
                candidates.kind,
                candidates.distance,
                cloth_count,
                sizes,
                x,
                displacement,
                begun_with,
            ],
            [changed, alpha, passes.state],
            device=x.device,
        )
        if level is not None:
            level()

    passes.repeat(shorten_once, MOST_PASSES)
    launch(give_up_kernel, len(x), [passes.state, MOST_PASSES], [alpha], device=x.device)


@wp.kernel
def clear_kernel(
    passes: wp.array(dtype=wp.int32),
    leaving: wp.array(dtype=wp.int32),
    fits: wp.array(dtype=wp.int32),
    count: wp.array(dtype=wp.int32),
    travel: wp.array(dtype=wp.float32),
    longest: float,
    clear_out: wp.array(dtype=wp.int32),
):
    held = passes[NUMBER] > 0 or leaving[0] > 0
    clear_out[0] = wp.where(fits[0] == 0 or count[0] == 0 or held or travel[0] > longest, 0, 1)


def find_clear(
    passes: Passes, leaving: wp.array, candidates: Candidates, travel: wp.array, longest: float, clear_out: wp.array
) -> None:
    """For the device: is all of a motion free, of which `passes` held nothing and nobody is `leaving` (1,) the region,
    by a list for which there was room and that is not empty, and is its `travel` (1,) m no longer than `longest` m?"""
    inputs = [passes.state, leaving, candidates.fits, candidates.count, travel, longest]
    launch(clear_kernel, 1, inputs, [clear_out], device=clear_out.device)
