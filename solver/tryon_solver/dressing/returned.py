"""Cloth that an edit took away and that is wanted again: put where it hung, among what is worn, which has moved on.

It lies over nothing of what is worn, so there is nothing to carry it over from. But where the garment hung when it was
worn with that cloth is known: from that stance it goes with the body to the one of the moment, by the field that
carries cloth along (body/carry.py), which leads to y. What is worn is at p by now; at its vertices u = p - y, and from
there u spreads over the cloth that comes back, as the gap of a seam that is drawn shut does: x = y + u. What has come
off since, or is in the way, goes back to y with it. Ours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tryon_solver.dressing.new_cut import NewCut
from tryon_solver.geometry.normals import vertex_normals
from tryon_solver.geometry.overlay import Overlay
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.spread import Points, spread
from tryon_solver.simulation import Simulation
from tryon_solver.state import positions

GIVES = 3.0  # times a gap: so far on either side of it the fabric is put anew
LACKING = 0.1  # mean edges beside what is worn, in the pattern: up to there the cloth beside it goes on straight
REACHES = (4.0, 1.0, 0.0)  # times the widest way: so far the cloth that comes back gives way to what is worn. Where the
# first leaves a tangle that can't be freed, as where a skirt hangs beside the leg by now, the next is tried; by the
# last nothing gives way, and what is worn goes back with it to where it hung
SLID = 0.15  # m: what is worn and has come further than this from where it hung lies beyond the shoulders or the hips
# that held it (those of a T-shirt and of skirts, which give way by the first reach, by up to 0.12), and goes back


@dataclass(frozen=True, eq=False)
class Hung:
    """A garment as it hung: its `mesh` then, in the size that is worn, its triangles `faces` (F, 3) as sewn, the cloth
    (N, 3) m, the body's `surface` (B, 3) m and stance."""

    mesh: PanelMesh
    faces: NDArray[np.int32]
    cloth: Points
    surface: Points
    pose: Any

    def of_cut(self, cut: NewCut) -> Points:
        """(N, 3) m: where the vertices of another cut, sewn, hung in it."""
        overlay = Overlay.of(self.mesh, cut.mesh)
        places = np.einsum("vk,vkd->vd", overlay.weights, self.cloth[self.faces[overlay.face]])
        return cut.welded.mean_of_vertices(places)


def lacking(cut: NewCut, before: PanelMesh, overlay: Overlay) -> NDArray[np.bool_]:
    """(V,): which unsewn vertices of the cut lie over no cloth of `before`, over which the overlay is laid. What lies
    on another piece is not asked about: that is laid on it."""
    off = lies_off(cut.mesh, cut.garment.mean_edge_length(), before, overlay)
    off[cut.mesh.laid.vertices] = False
    return off


def lies_off(mesh: PanelMesh, edge: float, before: PanelMesh, overlay: Overlay) -> NDArray[np.bool_]:
    """(V,): which unsewn vertices of a mesh, of edges of `edge` m on the mean, lie over no cloth of `before`."""
    inside = np.clip(overlay.weights, 0.0, None)
    inside /= inside.sum(axis=1, keepdims=True)
    nearest = np.einsum("vk,vkd->vd", inside, before.placed[before.faces[overlay.face]])
    off: NDArray[np.bool_] = np.linalg.norm(mesh.placed - nearest, axis=1) > LACKING * edge
    return off


def torn(mesh: PanelMesh, places: Points, limit: float) -> NDArray[np.bool_]:
    """(V,): which unsewn vertices lie beside a gap of their own piece, with its two sides at their `places` (V, 3) m:
    sides of triangles that are longer there than `limit` times their length in the pattern, and all within `GIVES`
    times what is too much of that."""
    ends = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    own, there = (np.linalg.norm(at[ends[:, 1]] - at[ends[:, 0]], axis=1) for at in (mesh.uv, places))
    over = np.flatnonzero(there > limit * own)
    near = cKDTree(mesh.placed).query_ball_point(mesh.placed[ends[over]].mean(axis=1), GIVES * (there - own)[over])
    beside = np.zeros(len(places), bool)
    for side, vertices in zip(over, near):
        beside[[k for k in vertices if mesh.panel_of_vertex[k] == mesh.panel_of_vertex[ends[side, 0]]]] = True
    return beside


class Returning:
    """What comes back with a cut, which takes over from what is `worn` and is simulated by `new`; once it was `put`,
    `came_back` tells whether there was anything, and `with_all` whether what is worn went back with it."""

    def __init__(self, hung: Hung, reach: float, cut: NewCut, worn: Simulation, new: Simulation) -> None:
        """`reach`: one of REACHES."""
        assert worn.body is not None
        assert worn.scene.body is not None
        self.hung, self.reach, self.cut, self.worn, self.new = hung, reach, cut, worn, new
        self.surface = worn.body_positions().astype(np.float64)
        self.faces = worn.scene.body.faces
        self.came_back = self.with_all = False

    def put(self, missing: NDArray[np.bool_], places: Points, speeds: Points) -> None:
        """Write into the places (V, 3) m and speeds (V, 3) m/s of the cut's unsewn vertices those of the ones that are
        `missing` (V,), outside the body; the others' are of what is worn. It goes as fast as the body beside it. Where
        all goes back, all are `missing` from then on."""
        self.came_back = bool(missing.any())
        if not self.came_back:
            return
        cut, welded = self.cut, self.cut.welded.welded_of_vertex
        known = np.bincount(welded[~missing], minlength=cut.welded.vertex_count)
        free = np.flatnonzero(known == 0)
        there, going = (mean_of(values[~missing], welded[~missing], known) for values in (places, speeds))
        y = gone_along(self.worn, self.new, self.hung, self.hung.of_cut(cut))
        way = there - y
        way[free] = 0.0
        sides = cut.garment.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        sides = sides[np.isin(sides, free).any(axis=1)]
        widest = float(np.linalg.norm(way[np.unique(sides)], axis=1).max(initial=0.0))
        self.with_all = self.reach == 0.0 or widest > SLID
        if self.with_all:
            missing[:], free, x = True, np.arange(len(y)), y
        else:
            edge = cut.garment.mean_edge_length()
            x = y + spread(sides, way, free, edge / max(self.reach * widest, edge))
        assert self.worn.body is not None
        _, nearest = cKDTree(self.surface).query(x[free])
        normals = vertex_normals(self.surface, self.faces)[nearest]
        outside = np.einsum("kd,kd->k", x[free] - self.surface[nearest], normals)
        x[free] += np.maximum(self.new.contact.sizes.xi_body - outside, 0.0)[:, None] * normals
        going[free] = self.worn.body.felt.numpy()[self.worn.cloth_count :][nearest]
        places[missing], speeds[missing] = x[welded[missing]], going[welded[missing]]


def mean_of(values: Points, welded: NDArray[np.integer], known: NDArray[np.integer]) -> Points:
    """(N, 3): of each sewn vertex the mean over `values` (K, 3) of vertices that are sewn into `welded` (K,), `known`
    (N,) of each; 0 of none."""
    total = np.stack([np.bincount(welded, weights=values[:, k], minlength=len(known)) for k in range(3)], axis=1)
    mean: Points = total / np.maximum(known, 1)[:, None]
    return mean


def stances_apart(worn: Simulation, new: Simulation, hung: Hung) -> float:
    """m: how far the skin of the body of what is `worn` is at most from where it was when the garment hung so, had it
    the root there that it has now; `new` is of the same body."""
    assert worn.body is not None
    assert new.body is not None
    moving, skin = new.body.moving, wp.zeros(len(hung.surface), dtype=wp.vec3, device=new.device)
    before, now = moving.transforms(hung.pose), worn.body.transforms()
    places = []
    for transforms, stance in ((now[0] @ np.linalg.inv(before[0]) @ before, hung.pose), (now, worn.body.pose)):
        moving.take(transforms, stance)
        moving.write(skin)
        places.append(skin.numpy().copy())
    return float(np.linalg.norm(places[1] - places[0], axis=1).max())


def gone_along(worn: Simulation, new: Simulation, hung: Hung, cloth: Points) -> Points:
    """(N, 3) m: the cloth of `new` from where it hung so to where the body's motion since then leads it.

    The body goes straight from one stance to the other, all of it with the root at once, then the rest in parts in
    which no skin goes further than in a step's (`substep_travel`): one field over the whole way, weighted where it
    begins, takes cloth between two legs through itself.
    """
    assert worn.body is not None
    assert new.body is not None
    carry, settings, moving, device = new.body.carry, new.settings, new.body.moving, new.device
    before, end = moving.transforms(hung.pose), worn.body.transforms()
    as_one = end[0] @ np.linalg.inv(before[0])
    x: wp.array = wp.array(positions(cloth, hung.surface), dtype=wp.vec3, device=device)
    way = wp.zeros_like(x)
    carry.take(as_one, np.broadcast_to(np.eye(4), end.shape))
    carry.fetch()
    carry.move_along(x)
    before = as_one @ before
    skin, skin_after = (wp.zeros(len(hung.surface), dtype=wp.vec3, device=device) for _ in range(2))
    for transforms, stance, there in ((before, hung.pose, skin), (end, worn.body.pose, skin_after)):
        moving.take(transforms, stance)
        moving.write(there)
    travel = float(np.linalg.norm(skin_after.numpy() - skin.numpy(), axis=1).max())
    parts = max(1, math.ceil(travel / settings.substep_travel))
    for k in range(1, parts + 1):
        stance = worn.body.pose if k == parts else moving.between(hung.pose, worn.body.pose, k / parts)
        after = moving.transforms(stance)
        after = end[0] @ np.linalg.inv(after[0]) @ after
        moving.take(after, stance)
        moving.write(skin_after)
        carry.set_places(x, settings.carry_none)
        carry.take(as_one, after @ np.linalg.inv(before))
        carry.fetch()
        carry.find_field(x, settings.carry_full, settings.carry_none, way)
        carry.move_surface(skin, skin_after, way)
        x = wp.array(x.numpy() + way.numpy(), dtype=wp.vec3, device=device)
        wp.copy(skin, skin_after)
        before = after
    return x.numpy()[: len(cloth)].astype(np.float64)
