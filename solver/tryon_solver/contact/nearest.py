"""Which stencils say how far apart two surfaces are, where their closest points lie on an edge or a corner.

Of a triangle that a vertex is beside, not above, the closest point is on an edge or a corner. Where the vertex is above
the triangle next to it, that one says how far apart they are, and the first, felt as well, would be a ridge along each
edge of a plane, with normals that lean to both sides: what slides over a mesh would have to climb it. So a closest
point counts where it is nearest among all that lie about it, and about once:

- within a triangle, and less where the vertex comes near the edge to another, with

      1 - (1 - r(s)) (1 + r(t))/2,

  s and t the barycentric coordinates [1] of the closest points on this triangle and the other one, across that edge,
  and r(s) smooth from 0 at 0 to 1 from ENDS on. Above a plane both sum to 1; beside a ridge each is half; in a valley
  both come to be felt;
- on the edge of a border;
- on a corner that no edge leads nearer from, its share in each triangle about it;
- of two edges, where it is within both, and less towards their ends, which are corners, by r of both.

What was told at once would have what lies beside an edge or a corner pressed on now by the one side, now by the other,
and not come to rest in between. What is nearest always counts or has what counts beside it, so nothing goes unfelt.
That each contact counts once in a sum over stencils: Li, Ferguson et al. 2023, there by terms that cancel. Ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.contact.distances import stencil_weights

wp.set_module_options({"enable_backward": False})

ENDS = wp.constant(0.05)  # of an edge's length, or of a triangle's height


@dataclass(frozen=True)
class Fans:
    """The triangles about each of A vertices: vertex i's are `starts`[i] to `starts`[i + 1], (A + 1,) int32, of
    `corners` (M,) vec2i, the two other corners of each."""

    starts: wp.array
    corners: wp.array

    @staticmethod
    def of(faces: np.ndarray, count: int, device: str) -> Fans:
        """Of triangles (F, 3) of `count` vertices."""
        vertex = faces.ravel()
        others = np.stack([faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]], axis=1).reshape(-1, 2)
        order = np.argsort(vertex, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(vertex, minlength=count))])
        return Fans(
            wp.array(starts.astype(np.int32), dtype=wp.int32, device=device),
            wp.array(others[order].astype(np.int32), dtype=wp.vec2i, device=device),
        )


@wp.func
def fade(s: float) -> float:
    """r(s)"""
    r = wp.clamp(s / ENDS, 0.0, 1.0)
    return r * r * (3.0 - 2.0 * r)


@wp.func
def share_beside_edge(
    p: int,
    own: float,
    i: int,
    j: int,
    beside: int,
    x: wp.array(dtype=wp.vec3),
    starts: wp.array(dtype=wp.int32),
    corners: wp.array(dtype=wp.vec2i),
) -> float:
    """Of vertex p and the triangle of edge i-j and corner `beside`, of which its closest point has `own`: by what the
    triangles across that edge have."""
    share = float(1.0)
    for k in range(starts[i], starts[i + 1]):
        other = int(-1)
        if corners[k][0] == j:
            other = corners[k][1]
        if corners[k][1] == j:
            other = corners[k][0]
        if other >= 0 and other != beside:
            there = float(1.0)
            if other != p:
                lam = stencil_weights(0, x[p], x[i], x[j], x[other])
                there = fade(-lam[3])
            share *= 1.0 - 0.5 * (1.0 - fade(own)) * (1.0 + there)
    return share


@wp.func
def share_on_corner(
    away: wp.vec3,
    i: int,
    x: wp.array(dtype=wp.vec3),
    starts: wp.array(dtype=wp.int32),
    corners: wp.array(dtype=wp.vec2i),
) -> float:
    """Likewise of corner i."""
    for k in range(starts[i], starts[i + 1]):
        for side in range(2):
            if wp.dot(away, x[corners[k][side]] - x[i]) > 0.0:
                return 0.0
    return 1.0 / float(starts[i + 1] - starts[i])


@wp.func
def share_of_stencil(
    kind: int,
    v: wp.vec4i,
    lam: wp.vec4,
    away: wp.vec3,
    x: wp.array(dtype=wp.vec3),
    starts: wp.array(dtype=wp.int32),
    corners: wp.array(dtype=wp.vec2i),
) -> float:
    """How much a stencil counts, from 0 to 1, whose closest points have the weights lam; `away` leads from the one on
    the triangle to the vertex."""
    if kind == 1:
        return fade(wp.min(lam[0], lam[1])) * fade(wp.min(-lam[2], -lam[3]))
    zeros = int(0)
    present = int(1)
    for k in range(1, 4):
        if lam[k] == 0.0:
            zeros += 1
        else:
            present = k
    if zeros == 2:
        return share_on_corner(away, v[present], x, starts, corners)
    share = float(1.0)
    for k in range(1, 4):
        if -lam[k] < ENDS:
            share *= share_beside_edge(v[0], -lam[k], v[1 + k % 3], v[1 + (k + 1) % 3], v[k], x, starts, corners)
    return share
