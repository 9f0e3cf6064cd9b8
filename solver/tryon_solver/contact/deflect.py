"""Turning a motion aside where it would close a gap.

Shortening alone freezes cloth caught between two moving surfaces and uses up nine tenths of every gap it meets. Before
that, each candidate whose closest points would come nearer than a share of their gap pushes its vertices' displacements
apart, by just what is missing, split by the vertices' weights:

    p_i += w_i lam_i / (sum_j w_j lam_j^2) (target - d') n',

d', n', lam the distance, normal and closest points where the motion ends; along the normal at its start where it
passes through, which continuous detection tells from passing by. By the normal at the start alone, cloth that slides
past a vertex would be lifted off it.

A motion that was carried is pushed so whoever closes the gap, since a body takes cloth along that stands in its way.
Of Newton's direction each vertex gives back of its own: it loses the share of its motion along n' that is missing of
all that closes the gap. Pushed by weights, a vertex that falls freely onto a body would throw up the ones beside it
that lie there: silk that slid down a slope was thrown about by millimetres in each step, and stopped. All pushes of a
pass are computed from the same displacements and averaged per vertex, so the outcome does not depend on the order in
which a device works through them. Tangential motion stays. This is the contact projection of position based dynamics
applied to a displacement; it promises nothing, what it leaves is shortened (bounds.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from tryon_solver.contact.bounds import floor_of
from tryon_solver.contact.candidates import Candidates, ContactSizes, candidate_at, offset
from tryon_solver.contact.ccd import time_of_impact
from tryon_solver.contact.distances import approach, stencil_vector, stencil_weights
from tryon_solver.contact.filtering import HITS, MORE, NUMBER, Passes
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import add, places, taken

wp.set_module_options({"enable_backward": False})

DEEP_GAP = 0.5  # share of its gap above xi that a pair deep in contact keeps in a deflected motion
ENTRY_GAP = 0.8  # share of the activation distance down to which a pair may enter contact
RECOVERY = 0.2  # share of what a pair at less than xi lacks that a deflected motion gives back
SURFACE_WEIGHT = wp.constant(0.05)  # how readily the body's surface gives way at first, cloth having 1; it rises to 1
LEAST_PUSH = 1.0e-6  # m
RELAXATION = 1.3  # of the mean of all pushes on a vertex: several candidates push the same one at once


@wp.func
def kept_gap(gap: float, held_gap: float, g_hat: float) -> float:
    """Gap [m] that a deflected motion leaves of `gap`; grows with it.

    A barrier that is out of reach has no say in the motion, and what falls deep into it is thrown out again: so a pair
    comes into contact, and the further in it is the more of its gap it may use up. Of `held_gap` m it uses up nothing.
    """
    share = wp.min(gap / g_hat, 1.0)
    kept = wp.min(gap, g_hat) * (DEEP_GAP + (ENTRY_GAP - DEEP_GAP) * share)
    return wp.max(kept, wp.min(gap, held_gap))


@wp.func
def least_closing(gap: float, held_gap: float, g_hat: float) -> float:
    """How much of its gap a pair with at least `gap` m may lose before it is deflected [m]."""
    closing = gap - kept_gap(gap, held_gap, g_hat)
    if gap < g_hat:
        return wp.min(closing, (1.0 - ENTRY_GAP) * g_hat)
    return closing


@wp.kernel
def deflect_kernel(
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
    held_gap: float,
    at_most: int,
    each_its_own: int,
    changed: wp.array(dtype=wp.int32),
    displacement: wp.array(dtype=wp.vec3),
    push_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
    pushes_out: wp.array(dtype=wp.int32),
    passes: wp.array(dtype=wp.int32),
):
    """Pass 0 looks at every stencil, later ones at those with a vertex that the pass before has pushed."""
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
        xi = offset(v, cloth_count, sizes)
        p0 = displacement[v[0]]
        p1 = displacement[v[1]]
        p2 = displacement[v[2]]
        p3 = displacement[v[3]]
        if least_closing(distance[c] - xi, held_gap, sizes.d_hat) > approach(kind[c], p0, p1, p2, p3):
            continue
        lam = stencil_weights(kind[c], x[v[0]], x[v[1]], x[v[2]], x[v[3]])
        difference = stencil_vector(lam, x[v[0]], x[v[1]], x[v[2]], x[v[3]])
        d = wp.length(difference)
        if d <= 0.0:
            continue
        n = difference / d
        wanted = xi + kept_gap(d - xi, held_gap, sizes.d_hat)
        if d < xi:
            wanted = d + RECOVERY * (xi - d)
        closing = float(0.0)
        for k in range(4):
            closing += lam[k] * wp.dot(n, displacement[v[k]])
        missing = wanted - (d + closing)
        if missing <= LEAST_PUSH:
            continue
        y0 = x[v[0]] + p0
        y1 = x[v[1]] + p1
        y2 = x[v[2]] + p2
        y3 = x[v[3]] + p3
        lam_there = stencil_weights(kind[c], y0, y1, y2, y3)
        there = stencil_vector(lam_there, y0, y1, y2, y3)
        # What ends on the other side of the pair has passed through it, or has passed by what lay ahead
        through = wp.dot(there, n) <= 0.0
        if through:
            x0 = x[v[0]]
            through = time_of_impact(
                kind[c], floor_of(d, xi, sizes.d_hat), x0, x[v[1]], x[v[2]], x[v[3]], p0, p1, p2, p3
            ) < 1.0
        if not through:  # what counts is the distance at the end
            missing = wanted - wp.length(there)
            if missing <= LEAST_PUSH:
                continue
            lam = lam_there
            n = wp.normalize(there)
        surface_weight = wp.pow(SURFACE_WEIGHT, 1.0 - float(number) / float(at_most))
        total = float(0.0)
        closed = float(0.0)
        for k in range(4):
            w = float(1.0)
            if v[k] >= cloth_count:
                w = surface_weight
            total += w * lam[k] * lam[k]
            closed += w * wp.max(-lam[k] * wp.dot(n, displacement[v[k]]), 0.0)
        wp.atomic_add(passes, HITS, 1)
        own = each_its_own == 1 and closed >= missing  # else some of it is to be given that nobody has taken
        for k in range(4):
            along = wp.dot(n, displacement[v[k]])
            if lam[k] != 0.0 and (not own or lam[k] * along < 0.0):
                w = float(1.0)
                if v[k] >= cloth_count:
                    w = surface_weight
                push = lam[k] * missing / total
                if own:
                    push = -along * missing / closed
                add(push_out, whole, v[k], w * push * n)
                wp.atomic_add(pushes_out, v[k], 1)


@wp.kernel
def apply_kernel(
    passes: wp.array(dtype=wp.int32),
    relaxation: float,
    push: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
    pushes: wp.array(dtype=wp.int32),
    changed: wp.array(dtype=wp.int32),
    displacement: wp.array(dtype=wp.vec3),
):
    """p += relaxation * mean push; clears the sums for the next pass."""
    i = wp.tid()
    if pushes[i] > 0:
        displacement[i] = displacement[i] + (relaxation / float(pushes[i])) * (push[i] + taken(whole, i))
        changed[i] = passes[NUMBER]
        push[i] = wp.vec3()
        pushes[i] = 0


@dataclass(frozen=True)
class DeflectionScratch:
    """Sums of one pass: `push` (A,) vec3 m with its `whole` (order_free.py), `pushes` (A,) int32, zero between
    passes."""

    push: wp.array
    whole: wp.array
    pushes: wp.array

    @staticmethod
    def allocate(count: int, device: str) -> DeflectionScratch:
        return DeflectionScratch(
            wp.zeros(count, dtype=wp.vec3, device=device),
            places(3 * count, device),
            wp.zeros(count, dtype=wp.int32, device=device),
        )


def deflect(
    candidates: Candidates,
    near: bool,
    cloth_count: int,
    sizes: ContactSizes,
    x: wp.array,
    displacement: wp.array,
    changed: wp.array,
    scratch: DeflectionScratch,
    passes: Passes,
    at_most: int,
    held_gap: float = 0.0,
    each_its_own: bool = False,
) -> None:
    """Turn `displacement` (A,) m aside, in at most `at_most` passes; of `held_gap` m no pair is to use up anything.
    With `each_its_own` vertices give back of their own motion alone.

    With `near` only the near list is looked at. `changed` (A,) int32 and `passes` are scratch.
    """
    count, entries = candidates.entries(near)
    changed.fill_(-2)

    def deflect_once() -> None:
        launch(
            deflect_kernel,
            count,
            [
                *entries,
                candidates.ids,
                candidates.kind,
                candidates.distance,
                cloth_count,
                sizes,
                x,
                held_gap,
                at_most,
                int(each_its_own),
            ],
            [changed, displacement, scratch.push, scratch.whole, scratch.pushes, passes.state],
            device=x.device,
        )
        launch(
            apply_kernel,
            len(x),
            [passes.state, RELAXATION],
            [scratch.push, scratch.whole, scratch.pushes, changed, displacement],
            device=x.device,
        )

    passes.repeat(deflect_once, at_most)
