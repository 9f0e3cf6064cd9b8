"""Float64 check of what is about to be committed: after rounding to float32, is every near pair still apart?"""

from __future__ import annotations

import warp as wp

from tryon_solver.contact.candidates import Candidates, ContactSizes, offset
from tryon_solver.contact.distances import stencil_vector, stencil_weights
from tryon_solver.linalg.finite import count_not_finite
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read

wp.set_module_options({"enable_backward": False})

SAFE_SHARE = 0.5  # of the thickness offset: closer than this a commit is void


@wp.func
def point_segment_sq(p: wp.vec3d, a: wp.vec3d, b: wp.vec3d) -> wp.float64:
    ab = b - a
    length_sq = wp.dot(ab, ab)
    t = wp.float64(0.0)
    if length_sq > wp.float64(0.0):
        t = wp.clamp(wp.dot(p - a, ab) / length_sq, wp.float64(0.0), wp.float64(1.0))
    return wp.length_sq(p - a - t * ab)


@wp.func
def point_triangle_sq(p: wp.vec3d, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.float64:
    """Squared distance: the plane's where the foot is inside, else the nearest side's."""
    n = wp.cross(b - a, c - a)
    n_sq = wp.length_sq(n)
    sides = wp.min(point_segment_sq(p, a, b), wp.min(point_segment_sq(p, b, c), point_segment_sq(p, c, a)))
    if n_sq > wp.float64(0.0):
        zero = wp.float64(0.0)
        if (
            wp.dot(wp.cross(b - a, p - a), n) >= zero
            and wp.dot(wp.cross(c - b, p - b), n) >= zero
            and wp.dot(wp.cross(a - c, p - c), n) >= zero
        ):
            h = wp.dot(p - a, n)
            return h * h / n_sq
    return sides


@wp.func
def edge_edge_sq(a0: wp.vec3d, a1: wp.vec3d, b0: wp.vec3d, b1: wp.vec3d) -> wp.float64:
    """Squared distance: the lines' where both feet are inside, else the nearest end's."""
    u = a1 - a0
    v = b1 - b0
    w = a0 - b0
    a = wp.dot(u, u)
    b = wp.dot(u, v)
    c = wp.dot(v, v)
    d = wp.dot(u, w)
    e = wp.dot(v, w)
    ends = wp.min(
        wp.min(point_segment_sq(a0, b0, b1), point_segment_sq(a1, b0, b1)),
        wp.min(point_segment_sq(b0, a0, a1), point_segment_sq(b1, a0, a1)),
    )
    denominator = a * c - b * b
    if denominator > wp.float64(1.0e-14) * a * c:
        s = (b * e - c * d) / denominator
        t = (a * e - b * d) / denominator
        zero = wp.float64(0.0)
        one = wp.float64(1.0)
        if s >= zero and s <= one and t >= zero and t <= one:
            return wp.min(ends, wp.length_sq(w + s * u - t * v))
    return ends


@wp.kernel
def verify_kernel(
    count: wp.array(dtype=wp.int32),
    threads: int,
    ids: wp.array(dtype=wp.vec4i),
    kind: wp.array(dtype=wp.int32),
    distance: wp.array(dtype=wp.float32),
    cloth_count: int,
    sizes: ContactSizes,
    x: wp.array(dtype=wp.vec3),
    violations_out: wp.array(dtype=wp.int32),
):
    """Counts candidates closer than SAFE_SHARE of their offset, exact where float32 says they are near it."""
    for c in range(wp.tid(), count[0], threads):
        if distance[c] > 2.0 * wp.max(sizes.xi_body, sizes.xi_self):
            continue
        v = ids[c]
        xi = offset(v, cloth_count, sizes)
        x0 = x[v[0]]
        x1 = x[v[1]]
        x2 = x[v[2]]
        x3 = x[v[3]]
        d = wp.length(stencil_vector(stencil_weights(kind[c], x0, x1, x2, x3), x0, x1, x2, x3))
        if d > 2.0 * xi:
            continue
        y0 = wp.vec3d(wp.float64(x0[0]), wp.float64(x0[1]), wp.float64(x0[2]))
        y1 = wp.vec3d(wp.float64(x1[0]), wp.float64(x1[1]), wp.float64(x1[2]))
        y2 = wp.vec3d(wp.float64(x2[0]), wp.float64(x2[1]), wp.float64(x2[2]))
        y3 = wp.vec3d(wp.float64(x3[0]), wp.float64(x3[1]), wp.float64(x3[2]))
        d_sq = wp.float64(0.0)
        if kind[c] == 0:
            d_sq = point_triangle_sq(y0, y1, y2, y3)
        else:
            d_sq = edge_edge_sq(y0, y1, y2, y3)
        least = wp.float64(SAFE_SHARE) * wp.float64(xi)
        if not (d_sq > least * least):
            wp.atomic_add(violations_out, 0, 1)


def violations(candidates: Candidates, cloth_count: int, sizes: ContactSizes, x: wp.array, counter: wp.array) -> int:
    """Number of candidates closer than SAFE_SHARE of their thickness offset at x, plus vertices that are not finite."""
    count_violations(candidates, cloth_count, sizes, x, counter)
    return int(read(counter)[0][0])


def count_violations(
    candidates: Candidates, cloth_count: int, sizes: ContactSizes, x: wp.array, counter: wp.array
) -> None:
    """Count them into `counter` (1,) int32."""
    count_not_finite(x, counter)
    threads = candidates.threads
    inputs = [candidates.count, threads, candidates.ids, candidates.kind, candidates.distance, cloth_count, sizes, x]
    launch(verify_kernel, threads, inputs, [counter], device=x.device)
