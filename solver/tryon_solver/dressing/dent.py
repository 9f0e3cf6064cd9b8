"""The body's collision surface, dented inwards until it is clear of cloth that came inside the body.

Every vertex of it goes in along its normal, past the deepest cloth below it, but no further than a share of the way
through the limb; those that still cross cloth go on. A surface so dented may cross itself: the body with itself is
nobody's business (METHOD.md section 10).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tryon_solver.contact.crossings import CrossingSearch
from tryon_solver.contact.rays import first_and_last_hit
from tryon_solver.geometry.connectivity import Connectivity
from tryon_solver.geometry.normals import vertex_normals
from tryon_solver.geometry.proximity import Surface
from tryon_solver.geometry.surface_repair import connected_faces

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

DEEPEST = 0.06  # m, cloth further inside the body than this does not lie on it
THROUGH = 0.6  # of the way through the limb: cloth beyond that belongs to the other side
STEP = 1e-3  # m, of a vertex that still crosses cloth, in a round, or
DEEPER = 0.25  # of its way in, where that is more: rounds are few where a wearer waits
JUST_INSIDE = 1e-4  # m, where a ray into the limb starts


class Dent:
    """The surface's way inwards. Vertices are in one space, `n` of cloth first."""

    def __init__(self, sim: Simulation, group: np.ndarray) -> None:
        """Of a simulation with a body; `group` as of CrossingSearch. `begin` says where its surface is."""
        assert sim.scene.body is not None
        garment = sim.scene.garment
        self.n, self.faces, self.device = sim.cloth_count, garment.faces, sim.device
        self.edges = garment.edges()
        self.body_faces = sim.scene.body.faces + self.n
        self.body_edges = Connectivity(sim.scene.body.faces, sim.body_count).edges + self.n
        self.cloth_in_body = CrossingSearch(self.edges, self.body_faces, group, sim.device)
        self.body_in_cloth = CrossingSearch(self.body_edges, self.faces, group, sim.device)
        self.clearance = sim.contact.sizes.xi_body + 0.1 * sim.contact.sizes.d_hat
        self.part = connected_faces(len(self.faces), garment.hinges()[:, 4:])  # (F,) of the cloth

    def begin(self, x: np.ndarray) -> None:
        """The surface of x (A, 3) m is the skin that is to give way."""
        skin_faces = self.body_faces - self.n
        self.skin = x[self.n :].copy()
        self.inward = -vertex_normals(self.skin, skin_faces)
        start = self.skin + JUST_INSIDE * self.inward
        far = np.full(len(self.skin), 4 * DEEPEST)
        through, _ = first_and_last_hit(self.skin, skin_faces, start, self.inward, far, self.device)
        self.limit = np.minimum(np.where(through < 0, 4 * DEEPEST, through) * THROUGH, DEEPEST)

    def make_room(self, x: np.ndarray) -> None:
        """Take the surface past the cloth below it."""
        _, deepest = first_and_last_hit(x[: self.n], self.faces, self.skin, self.inward, self.limit, self.device)
        below = deepest >= 0
        x[self.n :][below] += (deepest[below] + self.clearance)[:, None] * self.inward[below]

    def crossing_faces(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Cloth triangles that cross the surface, and its vertices there (ids from 0); both sorted."""
        first, second = self.cloth_in_body.find(x), self.body_in_cloth.find(x)
        cloth = [np.flatnonzero(np.isin(self.faces, self.edges[first[:, 0]]).sum(axis=1) >= 2), second[:, 1]]
        body = [self.body_faces[first[:, 1]].ravel(), self.body_edges[second[:, 0]].ravel()]
        return np.unique(np.concatenate(cloth)), np.unique(np.concatenate(body)) - self.n

    def crossing_count(self, x: np.ndarray) -> int:
        """Edges through triangles, between cloth and surface."""
        return len(self.cloth_in_body.find(x)) + len(self.body_in_cloth.find(x))

    def deepen(self, x: np.ndarray) -> None:
        """Take those vertices of the surface that cross cloth further in, as far as they may go."""
        _, body = self.crossing_faces(x)
        depth = np.linalg.norm(x[self.n :][body] - self.skin[body], axis=1)
        step = np.minimum(np.maximum(STEP, DEEPER * depth), self.limit[body] + self.clearance - depth)
        x[self.n :][body] += np.maximum(step, 0.0)[:, None] * self.inward[body]

    def deepest(self, x: np.ndarray) -> float:
        """Largest distance of the surface from the skin [m]."""
        return float(np.linalg.norm(x[self.n :] - self.skin, axis=1).max(initial=0.0))

    def stuck(self, x: np.ndarray) -> tuple[np.ndarray, str]:
        """Cloth triangles that the surface could not make room for, and in words what is wrong with them."""
        cloth, _ = self.crossing_faces(x)
        if len(cloth):
            return cloth, "pass through the body too deeply for it to give way"
        _, first = np.unique(self.part, return_index=True)
        inside = Surface(x[self.n :], self.body_faces - self.n).contains(x[self.faces[first, 0]])
        return np.flatnonzero(np.isin(self.part, self.part[first[inside]])), "lie inside the body altogether"
