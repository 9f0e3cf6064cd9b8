"""Edges that pass through triangles, found anew at any positions: what no candidate list may contain.

For garments that come from elsewhere. A state of our own is free by construction and never asks.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})


ROUNDING = 1e-15  # of the sum of a volume's terms without their signs: it is no more exact (Shewchuk 1997, orient3d)


@wp.func
def orientation(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, d: wp.vec3d) -> wp.float64:
    """Six times the signed volume of the tetrahedron; 0 where rounding might have made its sign."""
    p = b - a
    q = c - a
    r = d - a
    x1 = p[1] * q[2]
    x2 = p[2] * q[1]
    y1 = p[2] * q[0]
    y2 = p[0] * q[2]
    z1 = p[0] * q[1]
    z2 = p[1] * q[0]
    volume = (x1 - x2) * r[0] + (y1 - y2) * r[1] + (z1 - z2) * r[2]
    terms = (wp.abs(x1) + wp.abs(x2)) * wp.abs(r[0]) + (wp.abs(y1) + wp.abs(y2)) * wp.abs(r[1])
    terms += (wp.abs(z1) + wp.abs(z2)) * wp.abs(r[2])
    return wp.where(wp.abs(volume) > wp.float64(ROUNDING) * terms, volume, wp.float64(0.0))


@wp.func
def widened(x: wp.vec3) -> wp.vec3d:
    return wp.vec3d(wp.float64(x[0]), wp.float64(x[1]), wp.float64(x[2]))


@wp.kernel
def crossings_kernel(
    bvh: wp.uint64,
    edges: wp.array(dtype=wp.vec2i),
    faces: wp.array(dtype=wp.vec3i),
    group: wp.array(dtype=wp.int32),
    x: wp.array(dtype=wp.vec3),
    pairs_out: wp.array(dtype=wp.vec2i),
    count_out: wp.array(dtype=wp.int32),
):
    e = wp.tid()
    i = edges[e][0]
    j = edges[e][1]
    p = widened(x[i])
    q = widened(x[j])
    zero = wp.float64(0.0)
    query = wp.bvh_query_aabb(bvh, wp.min(x[i], x[j]), wp.max(x[i], x[j]))
    t = int(0)
    while wp.bvh_query_next(query, t):
        f = faces[t]
        shared = bool(False)
        for k in range(3):
            if group[f[k]] == group[i] or group[f[k]] == group[j]:
                shared = True
        if not shared:
            a = widened(x[f[0]])
            b = widened(x[f[1]])
            c = widened(x[f[2]])
            above = orientation(a, b, c, p)
            below = orientation(a, b, c, q)
            # an edge with an end in the triangle's plane touches it or does not: its distance tells, not this
            if (above > zero and below < zero) or (above < zero and below > zero):
                s0 = orientation(p, q, a, b)
                s1 = orientation(p, q, b, c)
                s2 = orientation(p, q, c, a)
                if (s0 >= zero and s1 >= zero and s2 >= zero) or (s0 <= zero and s1 <= zero and s2 <= zero):
                    slot = wp.atomic_add(count_out, 0, 1)
                    if slot < pairs_out.shape[0]:
                        pairs_out[slot] = wp.vec2i(e, t)


class CrossingSearch:
    """Finds which of some edges cross which of some triangles; both index one space of vertices."""

    def __init__(self, edges: np.ndarray, faces: np.ndarray, group: np.ndarray, device: str) -> None:
        """`edges` (E, 2), `faces` (F, 3); `group` (A,): an edge and a triangle of one group don't cross."""
        self.edges, self.faces, self.device = edges, faces, device
        self._edges: wp.array = wp.array(edges.astype(np.int32), dtype=wp.vec2i, device=device)
        self._faces: wp.array = wp.array(faces.astype(np.int32), dtype=wp.vec3i, device=device)
        self._group: wp.array = wp.array(group.astype(np.int32), dtype=wp.int32, device=device)
        self._lower = wp.zeros(len(faces), dtype=wp.vec3, device=device)
        self._upper = wp.zeros(len(faces), dtype=wp.vec3, device=device)
        self._count = wp.zeros(1, dtype=wp.int32, device=device)
        self._pairs = wp.zeros(4096, dtype=wp.vec2i, device=device)
        self._bvh: wp.Bvh | None = None
        self._found_at = np.zeros((0, 3), np.float32)  # the positions that were asked last
        self._found = np.zeros((0, 2), np.int32)  # and what was found there

    def find(self, x: np.ndarray) -> np.ndarray:
        """(K, 2) indices of edge and triangle, sorted, for positions x (A, 3) m, as float32.

        For those that were asked last nothing is searched.
        """
        x = x.astype(np.float32)
        if np.array_equal(x, self._found_at):
            return self._found
        a, b, c = (x[self.faces[:, k]] for k in range(3))
        self._lower.assign(np.minimum(np.minimum(a, b), c))  # many times faster than a reduction over three
        self._upper.assign(np.maximum(np.maximum(a, b), c))
        if self._bvh is None:
            self._bvh = wp.Bvh(self._lower, self._upper)
        else:
            self._bvh.refit()
        positions: wp.array = wp.array(x, dtype=wp.vec3, device=self.device)
        while True:
            self._count.zero_()
            launch(
                crossings_kernel,
                len(self.edges),
                [self._bvh.id, self._edges, self._faces, self._group, positions],
                [self._pairs, self._count],
                device=self.device,
            )
            found = int(self._count.numpy()[0])
            if found <= len(self._pairs):
                break
            self._pairs = wp.zeros(2 * found, dtype=wp.vec2i, device=self.device)
        pairs = self._pairs.numpy()[:found]
        self._found_at, self._found = x, pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
        return self._found
