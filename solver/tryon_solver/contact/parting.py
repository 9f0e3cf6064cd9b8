"""Going as far as what touches is parted by it, no further.

Newton's direction parts what is pressed too close by micrometres along a normal that holds where it begins, and slides
the same two edges past each other by millimetres. Along so long a way the normal turns: the pair parts at first and
ends nearer than it began. Turned aside there (deflect.py) or shortened by its time of impact (bounds.py), a knot of
such pairs stays shut whatever presses it open. With a pair's distance along the way taken for the parabola through
where it begins, with its slope there, and where it ends,

    d(t) = d + a t - c t^2,   a = n . sum_i lam_i p_i,   c = d + a - d(1),

its vertices go to where it parts most, t = a/(2 c), if the whole way would leave it less than a deflected motion leaves
it (`kept_gap`) and a > 0. Ours.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.contact.bounds import offset
from tryon_solver.contact.candidates import Candidates, ContactSizes
from tryon_solver.contact.deflect import kept_gap
from tryon_solver.contact.distances import approach, stencil_vector, stencil_weights

wp.set_module_options({"enable_backward": False})


@wp.kernel
def part_kernel(
    near: wp.array(dtype=wp.int32),
    near_count: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    kind: wp.array(dtype=wp.int32),
    distance: wp.array(dtype=wp.float32),
    cloth_count: int,
    sizes: ContactSizes,
    x: wp.array(dtype=wp.vec3),
    displacement: wp.array(dtype=wp.vec3),
    alpha: wp.array(dtype=wp.float32),
):
    """Lowers `alpha` of the vertices of pairs within the barrier's reach, see the module."""
    c = wp.tid()
    if c >= near_count[0]:
        return
    c = near[c]
    v = ids[c]
    xi = offset(v, kind[c], cloth_count, sizes)
    if distance[c] > xi + sizes.d_hat:
        return
    x0 = x[v[0]]
    x1 = x[v[1]]
    x2 = x[v[2]]
    x3 = x[v[3]]
    p0 = displacement[v[0]]
    p1 = displacement[v[1]]
    p2 = displacement[v[2]]
    p3 = displacement[v[3]]
    lam = stencil_weights(kind[c], x0, x1, x2, x3)
    difference = stencil_vector(lam, x0, x1, x2, x3)
    d = wp.length(difference)
    if d <= 0.0:
        return
    kept = xi + kept_gap(wp.max(d - xi, 0.0), 0.0, sizes.d_hat)
    if d - approach(kind[c], p0, p1, p2, p3) >= kept:
        return
    n = difference / d
    parting = wp.dot(n, stencil_vector(lam, p0, p1, p2, p3))
    if parting <= 0.0:
        return
    y0 = x0 + p0
    y1 = x1 + p1
    y2 = x2 + p2
    y3 = x3 + p3
    there = stencil_vector(stencil_weights(kind[c], y0, y1, y2, y3), y0, y1, y2, y3)
    at_end = wp.length(there)
    if wp.dot(there, n) < 0.0:  # passed through
        at_end = -at_end
    bent = d + parting - at_end
    if at_end >= kept or bent <= 0.0:
        return
    share = 0.5 * parting / bent
    if share < 1.0:
        for k in range(4):
            wp.atomic_min(alpha, v[k], share)


@wp.kernel
def shorten_kernel(alpha: wp.array(dtype=wp.float32), displacement: wp.array(dtype=wp.vec3)):
    """p *= alpha; alpha = 1."""
    i = wp.tid()
    displacement[i] = alpha[i] * displacement[i]
    alpha[i] = 1.0


def part(
    candidates: Candidates,
    cloth_count: int,
    sizes: ContactSizes,
    x: wp.array,
    displacement: wp.array,
    alpha: wp.array,
) -> None:
    """Shorten `displacement` (A,) m where pairs of the near list would part most before its end; `alpha` (A,), scratch,
    is one before and after."""
    wp.launch(
        part_kernel,
        candidates.near_size,
        [
            candidates.near,
            candidates.near_count,
            candidates.ids,
            candidates.kind,
            candidates.distance,
            cloth_count,
            sizes,
            x,
            displacement,
        ],
        [alpha],
        device=x.device,
    )
    wp.launch(shorten_kernel, len(x), [], [alpha, displacement], device=x.device)
