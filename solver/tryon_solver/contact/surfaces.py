"""The triangles that can touch: cloth and body in one index space, each vertex and edge owned by one triangle.

Vertices 0..cloth_count-1 are cloth, the rest the body's collision surface. A triangle pair found by the broad phase is
expanded to point-triangle and edge-edge stencils over the vertices and edges the two triangles *own*, so that each
stencil appears once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
import warp as wp

from tryon_solver.geometry.connectivity import Connectivity
from tryon_solver.linalg.clear import clear
from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})


SURFACES_KEPT = 8


@wp.struct
class Side:
    """A surface's triangles as in `Surface`, for kernels."""

    faces: wp.array(dtype=wp.vec3i)
    owned: wp.array(dtype=wp.int32)
    lower: wp.array(dtype=wp.vec3)
    upper: wp.array(dtype=wp.vec3)
    budget: wp.array(dtype=wp.float32)
    known: wp.array(dtype=wp.float32)


@wp.struct
class Reach:
    """From how far off cloth feels a surface [m]: from `farthest`; but cloth of one garment itself from no farther than
    the least of the stencil's vertices' `own` (N,). `garment` (A,) int32 is as in ContactSizes. Of another surface than
    the cloth `own` is empty."""

    farthest: float
    own: wp.array(dtype=wp.float32)
    garment: wp.array(dtype=wp.int32)


@wp.func
def of_one_garment(a: int, b: int, reach: Reach) -> bool:
    """Are these vertices, one of the cloth and one of the surface, cloth of one garment?"""
    return reach.own.shape[0] > 0 and (reach.garment.shape[0] == 0 or reach.garment[a] == reach.garment[b])


@wp.func
def reach_of_stencil(v: wp.vec4i, reach: Reach) -> float:
    """Of either kind, its first and its last vertex are on different sides."""
    least = reach.farthest
    if of_one_garment(v[0], v[3], reach):
        for k in range(4):
            least = wp.min(least, reach.own[v[k]])
    return least


@wp.func
def reach_of_triangles(f: wp.vec3i, g: wp.vec3i, reach: Reach) -> float:
    """No stencil of the two, which has vertices of both, has more."""
    least = reach.farthest
    if of_one_garment(f[0], g[0], reach):
        of_f = float(0.0)
        of_g = float(0.0)
        for k in range(3):
            of_f = wp.max(of_f, reach.own[f[k]])
            of_g = wp.max(of_g, reach.own[g[k]])
        least = wp.min(least, wp.min(of_f, of_g))
    return least


@dataclass
class Surface:
    """Triangles of one kind with their bounding boxes and tree.

    `faces` (F,) vec3i ids in the shared index space; `owned` (F,) int32: bit k set when the triangle owns its vertex k,
    bit 3+k when it owns the edge from vertex k to vertex k+1. `lower`, `upper` (F,) vec3 m boxes. `budget` (F,)
    float32 m as in `Region`; `known` (F,) float32 m, the budget that the candidate list already covers;
    `gained` (1,) int32 is 1 when some budget is above its `known`. Cloth feels it from `reach.farthest` m on, or
    later. `packets` (P, 32) int32 as in packets.py, of cloth on a GPU.
    """

    faces: wp.array
    owned: wp.array
    lower: wp.array
    upper: wp.array
    budget: wp.array
    known: wp.array
    gained: wp.array
    face_count: int
    reach: Reach
    bvh: wp.Bvh | None = None
    packets: wp.array | None = None

    @staticmethod
    def build(faces: np.ndarray, owned: np.ndarray, reach: float, device: str) -> Surface:
        """`faces` (F, 3) int32 in the shared index space; `owned` (F,) as above; `reach` m, at most."""
        count = len(faces)
        felt = Reach()
        felt.farthest = reach
        return Surface(
            wp.array(faces.astype(np.int32), dtype=wp.vec3i, device=device),
            wp.array(owned, dtype=wp.int32, device=device),
            wp.zeros(count, dtype=wp.vec3, device=device),
            wp.zeros(count, dtype=wp.vec3, device=device),
            wp.zeros(count, dtype=wp.float32, device=device),
            wp.zeros(count, dtype=wp.float32, device=device),
            wp.zeros(1, dtype=wp.int32, device=device),
            count,
            felt,
        )

    def apart(self) -> Surface:
        """The same triangles, with boxes, tree and budgets of their own: of these the candidate list that there is
        knows, and a search beside it must not tell the next one otherwise."""
        lower, upper, budget = wp.clone(self.lower), wp.clone(self.upper), wp.clone(self.budget)
        known, gained = wp.clone(self.known), wp.clone(self.gained)
        return replace(self, lower=lower, upper=upper, budget=budget, known=known, gained=gained, bvh=None)

    @cached_property
    def side(self) -> Side:
        """Its arrays, for kernels."""
        side = Side()
        side.faces, side.owned = self.faces, self.owned
        side.lower, side.upper = self.lower, self.upper
        side.budget, side.known = self.budget, self.known
        return side

    def enclose(self, centre: wp.array, half_way: wp.array, budget: wp.array, margin: float) -> None:
        """Boxes of the triangles, for vertices within `budget` of paths around `centre`.

        All in m; `margin` is added on every side. The triangle's budget is the largest of its vertices', what it was
        before becomes `known`.
        """
        device = self.faces.device
        clear(self.gained)
        launch(
            face_boxes_kernel,
            self.face_count,
            [self.faces, centre, half_way, budget, margin],
            [self.lower, self.upper, self.budget, self.known, self.gained],
            device=device,
        )

    def refit(self) -> None:
        """The tree over the boxes as they are."""
        if self.bvh is None:
            self.bvh = wp.Bvh(self.lower, self.upper)
        else:
            self.bvh.refit()


def ownership(faces: np.ndarray) -> np.ndarray:
    """(F,) int32 bits as in `Surface.owned`, of a body's triangles (F, 3): kept, since those of the garment before are
    the same."""
    return _ownership(faces.astype(np.int32).tobytes())


@lru_cache(maxsize=SURFACES_KEPT)
def _ownership(triangles: bytes) -> np.ndarray:
    faces = np.frombuffer(triangles, np.int32).reshape(-1, 3)
    return Connectivity(faces, int(faces.max()) + 1).owned


@wp.kernel
def face_boxes_kernel(
    faces: wp.array(dtype=wp.vec3i),
    centre: wp.array(dtype=wp.vec3),
    half_way: wp.array(dtype=wp.vec3),
    budget: wp.array(dtype=wp.float32),
    margin: float,
    lower_out: wp.array(dtype=wp.vec3),
    upper_out: wp.array(dtype=wp.vec3),
    budget_out: wp.array(dtype=wp.float32),
    known_out: wp.array(dtype=wp.float32),
    gained_out: wp.array(dtype=wp.int32),
):
    t = wp.tid()
    f = faces[t]
    lower = centre[f[0]]
    upper = lower
    largest = float(0.0)
    for k in range(3):
        x = centre[f[k]]
        way = wp.abs(half_way[f[k]])
        lower = wp.min(lower, x - way)
        upper = wp.max(upper, x + way)
        largest = wp.max(largest, budget[f[k]])
    grow = wp.vec3(margin + largest, margin + largest, margin + largest)
    lower_out[t] = lower - grow
    upper_out[t] = upper + grow
    known = budget_out[t]
    if largest > known:
        gained_out[0] = 1
    known_out[t] = known
    budget_out[t] = largest
