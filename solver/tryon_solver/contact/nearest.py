"""Which stencils say how far apart two surfaces are, where their closest points lie on an edge or a corner.

Of a triangle that a vertex is beside, not above, the closest point is on an edge or a corner. Where the vertex is above
the triangle next to it, that one says how far apart they are, and the first, felt as well, would be a ridge along each
edge of a plane, with normals that lean to both sides: what slides over a mesh would have to climb it. So a closest
point counts where it is nearest among all that lie about it, and once:

- on an edge, where the vertex is beside the triangle on its other side, too, half in either, a ridge of the surface;
- on the edge of a border;
- on a corner that no edge leads nearer from, its share in each triangle about it;
- of two edges, where it is within both: ends are corners.

The two points of two surfaces that are nearest to each other always are among these, so nothing goes unfelt. That each
contact counts once in a sum over stencils: Li, Ferguson et al. 2023, there by terms that cancel. Ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

wp.set_module_options({"enable_backward": False})


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
def share_on_edge(
    away: wp.vec3,
    i: int,
    j: int,
    beside: int,
    x: wp.array(dtype=wp.vec3),
    starts: wp.array(dtype=wp.int32),
    corners: wp.array(dtype=wp.vec2i),
) -> float:
    """Of edge i-j of the triangle with corner `beside`; `away` leads from the closest point to the vertex."""
    along = x[j] - x[i]
    triangles = float(1.0)
    for k in range(starts[i], starts[i + 1]):
        other = int(-1)
        if corners[k][0] == j:
            other = corners[k][1]
        if corners[k][1] == j:
            other = corners[k][0]
        if other >= 0 and other != beside:
            across = x[other] - x[i]
            across -= (wp.dot(across, along) / wp.length_sq(along)) * along
            if wp.dot(away, across) > 0.0:
                return 0.0
            triangles += 1.0
    return 1.0 / triangles


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
        return wp.where(lam[0] * lam[1] * lam[2] * lam[3] == 0.0, 0.0, 1.0)
    zeros = int(0)
    absent = int(1)
    present = int(1)
    for k in range(1, 4):
        if lam[k] == 0.0:
            zeros += 1
            absent = k
        else:
            present = k
    if zeros == 0:
        return 1.0
    if zeros == 1:
        return share_on_edge(
            away, v[1 + absent % 3], v[1 + (absent + 1) % 3], v[absent], x, starts, corners
        )
    return share_on_corner(away, v[present], x, starts, corners)
