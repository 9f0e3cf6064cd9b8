"""Pushes stencils apart that are closer than their offset, all at once and a little at a time.

For garments that come from elsewhere, before the first step: contact forces need a state that is free already.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.contact.candidates import Candidates, ContactSizes, offset
from tryon_solver.contact.distances import stencil_vector, stencil_weights
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import add, places, taken

wp.set_module_options({"enable_backward": False})


@wp.kernel
def push_kernel(
    ids: wp.array(dtype=wp.vec4i),
    kind: wp.array(dtype=wp.int32),
    cloth_count: int,
    sizes: ContactSizes,
    share: float,
    x: wp.array(dtype=wp.vec3),
    push_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
    pushes_out: wp.array(dtype=wp.int32),
    close_out: wp.array(dtype=wp.int32),
):
    """Each stencil that lacks some of `share` times its offset asks its vertices for the way that would give it."""
    c = wp.tid()
    v = ids[c]
    x0 = x[v[0]]
    x1 = x[v[1]]
    x2 = x[v[2]]
    x3 = x[v[3]]
    lam = stencil_weights(kind[c], x0, x1, x2, x3)
    way = stencil_vector(lam, x0, x1, x2, x3)
    d = wp.length(way)
    xi = offset(v, cloth_count, sizes)
    wanted = share * xi
    if d >= wanted or d == 0.0:
        return
    if d < xi:
        wp.atomic_add(close_out, 0, 1)
    size = (wanted - d) / (d * wp.dot(lam, lam))
    for k in range(4):
        if lam[k] != 0.0:
            add(push_out, whole, v[k], (size * lam[k]) * way)
            wp.atomic_add(pushes_out, v[k], 1)


@wp.kernel
def apply_push_kernel(
    push: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
    pushes: wp.array(dtype=wp.int32),
    relaxation: float,
    x: wp.array(dtype=wp.vec3),
):
    """The mean of what was asked of each vertex, times the relaxation."""
    i = wp.tid()
    if pushes[i] > 0:
        x[i] = x[i] + (relaxation / float(pushes[i])) * (push[i] + taken(whole, i))


def push_apart(
    candidates: Candidates, cloth_count: int, sizes: ContactSizes, share: float, relaxation: float, x: wp.array
) -> int:
    """Move x (A,) m once; returns the number of stencils that were closer than their offset before.

    They are pushed to `share` of it, a little above 1.
    """
    device = x.device
    push = wp.zeros_like(x)
    whole = places(3 * len(x), str(device))
    pushes = wp.zeros(len(x), dtype=wp.int32, device=device)
    close = wp.zeros(1, dtype=wp.int32, device=device)
    launch(
        push_kernel,
        candidates.size,
        [candidates.ids, candidates.kind, cloth_count, sizes, share, x],
        [push, whole, pushes, close],
        device=device,
    )
    count = int(close.numpy()[0])
    if count:
        launch(apply_push_kernel, len(x), [push, whole, pushes, relaxation], [x], device=device)
    return count
