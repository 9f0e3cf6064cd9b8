"""Two surfaces brought within reach of each other, and the solver's contact pairs there.

The only place of the tests that calls the solver's search and pair collection.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp
from reference_distances import all_stencils, stencil_distances, stencil_keys
from scipy.spatial.transform import Rotation
from small_scenes import STILL, fabric, icosphere, layers, rigid_body, sheet

from tryon_solver.baselines.newton_ipc.distance import closest
from tryon_solver.baselines.newton_ipc.shares import Neighbours
from tryon_solver.baselines.newton_ipc.shares import shares as reference_shares
from tryon_solver.contact import pairs
from tryon_solver.scene import BodyContact, Friction, Scene, SelfContact
from tryon_solver.simulation import Simulation, build
from tryon_solver.stepping.gradient import add_contact_gradient
from tryon_solver.stepping.search import search_around

MU_BODY, MU_SELF = 0.35, 0.25


@dataclass(frozen=True)
class TwoSurfaces:
    """A simulation whose vertices fall into two surfaces, and every stencil between them."""

    sim: Simulation
    first: np.ndarray  # (A,) bool, vertices of the first surface
    x_rest: np.ndarray  # (A, 3) m, both surfaces where they were made
    kinds: np.ndarray  # (S,)
    stencils: np.ndarray  # (S, 4)

    @property
    def xi(self) -> float:
        """Thickness offset [m] of a contact between the two."""
        sizes = self.sim.contact.sizes
        return sizes.xi_body if self.sim.body_count else sizes.xi_self

    def edge_at(self, vertex: int, direction: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(2,) ends of the vertex's edge that is most nearly across the direction."""
        edges = np.unique(self.stencils[self.kinds == 1].reshape(-1, 2), axis=0)
        edges = edges[(edges == vertex).any(1)]
        along = x[edges[:, 1]] - x[edges[:, 0]]
        return edges[np.argmin(np.abs(along @ direction) / np.linalg.norm(along, axis=1))]


def which_stencils(surfaces: TwoSurfaces, ids: np.ndarray) -> np.ndarray:
    """(P,) index into `surfaces.stencils` of pairs with vertices `ids` (P, 4)."""
    side = surfaces.first[ids]
    kinds = np.where((side[:, 0] != side[:, 1]) & (side[:, 1] == side[:, 2]) & (side[:, 2] == side[:, 3]), 0, 1)
    keys = stencil_keys(surfaces.kinds, surfaces.stencils)
    order = np.argsort(keys)
    wanted = stencil_keys(kinds, ids)
    found = order[np.searchsorted(keys, wanted, sorter=order)]
    assert (keys[found] == wanted).all()
    return found


def two_sheets() -> TwoSurfaces:
    """Two square sheets that can only touch each other: 25 mm triangles."""
    garment, x = layers(2, 5, 5, 0.1, 0.05)
    n = garment.vertex_count // 2
    sim = build(Scene(garment, x, None, fabric(mu_body=MU_BODY, mu_self=MU_SELF), (SelfContact(), Friction())))
    first, second = garment.faces[garment.panel_of_face == 0], garment.faces[garment.panel_of_face == 1]
    return TwoSurfaces(sim, np.arange(2 * n) < n, x, *all_stencils(first, second))


def sheet_and_ball() -> TwoSurfaces:
    """A square sheet and a ball of 25 mm triangles."""
    garment, x = sheet(5, 5, 0.1, 0.1)
    vertices, faces = icosphere(0.04, 1)
    vertices = vertices - [0, 0.06, 0]
    effects = (BodyContact(), Friction())
    scene = Scene(garment, x, rigid_body(vertices, faces), fabric(mu_body=MU_BODY, mu_self=MU_SELF), effects)
    sim = build(scene, None, "cpu", STILL)
    n = garment.vertex_count
    both = np.vstack([x, vertices])
    return TwoSurfaces(sim, np.arange(len(both)) < n, both, *all_stencils(garment.faces, faces + n))


def distances(surfaces: TwoSurfaces, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (..., S) m and weights (..., S, 4) of every stencil at positions (..., A, 3)."""
    return stencil_distances(surfaces.kinds, x[..., surfaces.stencils, :])


def triangles(surfaces: TwoSurfaces) -> np.ndarray:
    """(F, 3) of both surfaces."""
    sim = surfaces.sim
    faces = sim.scene.garment.faces
    return np.vstack([faces, sim.scene.body.faces + sim.cloth_count]) if sim.body_count else faces


def shares(surfaces: TwoSurfaces, x: np.ndarray) -> np.ndarray:
    """(S,) how much each stencil counts at positions (A, 3), by the reference."""
    neighbours = Neighbours.of(triangles(surfaces), len(x))
    at = closest(surfaces.kinds, x[surfaces.stencils])
    return reference_shares(neighbours, surfaces.kinds, surfaces.stencils, at, x)


MEETINGS = ("corners", "anywhere", "parallel edges", "edges that cross")


def near_state(surfaces: TwoSurfaces, rng: np.random.Generator, closest: float, meeting: str) -> np.ndarray:
    """(A, 3) float64 m of float32 values: noisy surfaces turned at random whose smallest distance is `closest` m.

    They meet vertex to vertex, wherever they happen to, or with two edges parallel within half a degree, of which the
    nearest points are an end's, or within both.
    """
    first, second = surfaces.first, ~surfaces.first
    x = surfaces.x_rest + 1e-3 * rng.standard_normal(surfaces.x_rest.shape)
    for side in (first, second):
        x[side] = (x[side] - x[side].mean(0)) @ Rotation.random(rng=rng).as_matrix().T
    direction = rng.standard_normal(3)
    direction /= np.linalg.norm(direction)
    across = np.cross(direction, rng.standard_normal(3))
    aside = 0.0 if meeting == "corners" else 0.03 / np.linalg.norm(across)
    a = np.flatnonzero(first)[np.argmax(x[first] @ direction)]
    b = np.flatnonzero(second)[np.argmin(x[second] @ direction)]
    if "edges" in meeting:
        ends_a, ends_b = (surfaces.edge_at(v, direction, x) for v in (a, b))
        edge_a, edge_b = x[ends_a[1]] - x[ends_a[0]], x[ends_b[1]] - x[ends_b[0]]
        x[second] = Rotation.align_vectors(edge_a[None], edge_b[None])[0].apply(x[second])
        outward = direction - (direction @ edge_a) / (edge_a @ edge_a) * edge_a
        direction, aside = outward / np.linalg.norm(outward), 0.0
        turn = rng.standard_normal(3) if meeting == "parallel edges" else direction
        x[second] = Rotation.from_rotvec(8e-3 * turn).apply(x[second])
        x[second] += x[ends_a].mean(0) - x[ends_b].mean(0)
    else:
        x[second] += x[a] - x[b]
    while not brought_together(surfaces, x, aside * across + 0.2 * direction, direction, closest):
        aside *= 0.7
    return x.astype(np.float32).astype(np.float64)


def brought_together(
    surfaces: TwoSurfaces, x: np.ndarray, start: np.ndarray, direction: np.ndarray, closest: float
) -> bool:
    """Move the second surface, shifted by `start`, against `direction` until `closest` m away; False if it misses.

    Each step is the distance that is still missing, so the surfaces can't pass through each other.
    """
    moved = x.copy()
    moved[~surfaces.first] += start
    travelled = 0.0
    while travelled < 0.4:
        missing = distances(surfaces, moved)[0].min() - closest
        if missing < 1e-6:
            x[:] = moved
            return True
        moved[~surfaces.first] -= missing * direction
        travelled += missing
    return False


def find_pairs(sim: Simulation, x: np.ndarray) -> None:
    """Leaves the contact pairs at x in `sim.pairs`."""
    sim.state.x.assign(x.astype(np.float32))
    sim.work.direction.zero_()
    search_around(sim, sim.state.x, sim.work.direction)
    pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)


def contact_gradient(sim: Simulation, friction: bool) -> np.ndarray:
    """(A, 3) N: dB/dx of the pairs at the current positions; with `friction`, that of the friction potential too."""
    out = wp.zeros(sim.all_count, dtype=wp.vec3, device=sim.device)
    if friction:
        for term in sim.stages.contact:
            term.prepare(sim.pairs, sim.state, sim.state.x, None)
        add_contact_gradient(sim, sim.state.x, sim.state.x, out)
    elif sim.pairs.size:
        pairs.add_gradient(sim.pairs, sim.state.x, sim.state.x, out, sim.sums)
        sim.sums.settle(out)
    return out.numpy().astype(np.float64)


def pair_table(sim: Simulation) -> dict[str, np.ndarray]:
    """The pairs as float64 arrays, sorted by their vertex ids."""
    size = sim.pairs.size
    names = ("ids", "lam", "normal", "slope", "curvature", "energy")
    table = {name: getattr(sim.pairs, name).numpy()[:size] for name in names}
    order = np.lexsort(table["ids"].T[::-1])
    return {k: v[order] if k == "ids" else v[order].astype(np.float64) for k, v in table.items()}
