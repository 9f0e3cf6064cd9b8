"""Frees a garment that comes touching or crossing the body or itself, before it is declared free.

The body gives way first: its collision surface is dented inwards until it is clear of the cloth, and returns to the
skin while the garment settles, pushing the cloth out before it (the yielding surface of METHOD.md section 10). Cloth
that crosses cloth is drawn apart along the line of intersection, after P. Volino and N. Magnenat-Thalmann, "Resolving
surface collisions through intersection contour minimization" (2006). Then everything closer than its offset is pushed
apart. What can't be freed so is refused, with its triangles named.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
import warp as wp

from tryon_solver.contact.crossings import CrossingSearch
from tryon_solver.contact.separate import push_apart
from tryon_solver.contact.verify import violations
from tryon_solver.dressing.dent import Dent
from tryon_solver.geometry.connectivity import CORNERS
from tryon_solver.stepping.search import search_around

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

ROUNDS = 400  # of moving and looking again, at most
CONTOUR_STEP = 0.6e-3  # m, of an edge along the intersection line in a round
CONTOUR_SOFTNESS = 0.3  # a gradient much smaller than this moves its edge by less than the step
SPREAD_ROUNDS = 4  # of averaging a move with the neighbours'
LENGTH_ROUNDS = 4  # of giving edges their lengths back after a move
PUSH_SHARE = 1.02  # of the offset is what a stencil is pushed to
PUSH_RELAXATION = 0.7
PUSHES = 60  # between two searches
PATIENCE = 8  # rounds of pushing that bring nothing before what is left is looked at as it is


class TangledError(ValueError):
    """Cloth that could not be freed: `faces` (K,) its triangles, sorted; the message says what they cross."""

    def __init__(self, message: str, faces: np.ndarray) -> None:
        super().__init__(message)
        self.faces = faces


@dataclass(frozen=True)
class Freed:
    """What was found and done. Counts are of edges that passed through a triangle; lengths in m."""

    crossed_itself: int
    crossed_body: int
    too_close: int  # stencils within their offset
    largest_move: float  # of a cloth vertex
    deepest_dent: float  # of the body's surface

    def describe(self) -> str:
        """For people."""
        if not (self.crossed_itself or self.crossed_body or self.too_close):
            return "the garment came free of the body and of itself"
        return (
            f"the garment came with {self.crossed_itself} crossings of itself, {self.crossed_body} of the body and "
            f"{self.too_close} places closer than its thickness; freed by moving cloth by up to "
            f"{1e3 * self.largest_move:.1f} mm and letting the body yield by up to {1e3 * self.deepest_dent:.1f} mm"
        )


def untangle(sim: Simulation, tell: Callable[[float], None] = lambda _share: None, rounds: int = ROUNDS) -> Freed:
    """Make the simulation's state free of contact, in so many rounds; its clock stands. `tell` is told the share that
    is done.

    Raises TangledError.
    """
    return Tangle(sim, rounds).free(tell)


class Tangle:
    """A simulation's cloth and collision surface to be freed, in `most_rounds`: made ready before it is known where
    they are."""

    def __init__(self, sim: Simulation, most_rounds: int) -> None:
        self.sim, self.most_rounds = sim, most_rounds
        self.n = sim.cloth_count
        self.faces = sim.scene.garment.faces
        self.edges = sim.scene.garment.edges()
        group = sim.group.numpy()
        self.itself = CrossingSearch(self.edges, self.faces, group, sim.device) if "cloth" in sim.plan.touches else None
        self.dent: Dent | None = None
        if sim.scene.body is not None and "body" in sim.plan.touches:
            self.dent = Dent(sim, group)

    @cached_property
    def opposite(self) -> np.ndarray:
        """(E, 2) as of `_opposite_corners`: what crosses nothing has no need of it."""
        return _opposite_corners(self.faces, self.edges)

    @cached_property
    def valence(self) -> np.ndarray:
        """(N,) edges at each vertex."""
        return np.bincount(self.edges.ravel(), minlength=self.n).astype(np.float64)

    @cached_property
    def mean_of_neighbours(self) -> sp.csr_matrix:
        """(N, N), a vertex being a neighbour of its own."""
        a, b = self.edges.T
        both = np.concatenate([a, b, np.arange(self.n)]), np.concatenate([b, a, np.arange(self.n)])
        links = sp.coo_matrix((np.ones(len(both[0])), both), shape=(self.n, self.n)).tocsr()
        return sp.diags(1.0 / (self.valence + 1.0)) @ links

    def free(self, tell: Callable[[float], None] = lambda _share: None) -> Freed:
        """As `untangle`, from where the simulation is now."""
        self.x = self.sim.state.x.numpy().astype(np.float64)  # (A, 3) m
        self.x_came = self.x[: self.n].copy()
        a, b = self.edges.T
        self.length = np.linalg.norm(self.x[a] - self.x[b], axis=1)
        self.listed = False  # are the candidates those around x?
        crossed_itself, crossed_body = self.crossing_counts()
        most, left = max(1, crossed_itself + crossed_body), crossed_itself + crossed_body
        if self.dent:
            self.dent.begin(self.x)
            self.dent.make_room(self.x)
        too_close, rounds, stalled, best = None, 0, 0, np.inf
        while rounds < self.most_rounds and stalled < PATIENCE:
            while rounds < self.most_rounds and any(counts := self.crossing_counts()):
                self.listed = False
                left = min(left, sum(counts))
                tell(max(rounds / self.most_rounds, 1.0 - left / most))
                if self.itself is not None:
                    self.draw_apart()
                if self.dent:
                    self.dent.deepen(self.x)
                rounds += 1
            close = self.push()
            too_close = close if too_close is None else too_close
            if close == 0 and not any(self.crossing_counts()):
                break
            stalled = 0 if close < best else stalled + 1
            best = min(best, close)
            rounds += 1
        self.refuse_what_is_left()
        moved = np.linalg.norm(self.x[: self.n] - self.x_came, axis=1)
        return Freed(
            crossed_itself,
            crossed_body,
            too_close or 0,
            float(moved.max(initial=0.0)),
            self.dent.deepest(self.x) if self.dent else 0.0,
        )

    def crossing_counts(self) -> tuple[int, int]:
        """Edges through triangles: cloth through cloth, and between cloth and body."""
        return len(self.crossings()), self.dent.crossing_count(self.x) if self.dent else 0

    def crossings(self) -> np.ndarray:
        """(K, 2) cloth edges through cloth triangles."""
        return np.empty((0, 2), np.int64) if self.itself is None else self.itself.find(self.x)

    def draw_apart(self) -> None:
        """One step that shortens the lines along which cloth crosses cloth.

        An edge e through a triangle with normal n starts lines of intersection along r, one into each triangle at the
        edge; moved by u, it starts them (u - e (u n)/(e n)) r later. Of the direction that shortens them fastest,
        r - (e r)/(e n) n, the part along r would only gather the sheet in its own plane; n's is taken.
        """
        pairs = self.crossings()
        if not len(pairs):
            return
        x = self.x
        a, b = self.edges[pairs[:, 0]].T
        c, d, e = self.faces[pairs[:, 1]].T
        normal = _unit(np.cross(x[d] - x[c], x[e] - x[c]))
        edge = _unit(x[b] - x[a])
        line = np.zeros_like(normal)
        for side in range(2):
            corner = self.opposite[pairs[:, 0], side]
            there = corner >= 0
            own = _unit(np.cross(x[b] - x[a], x[corner] - x[a]))
            along = _unit(np.cross(normal, own))
            inward = np.einsum("kd,kd->k", along, np.cross(own, edge))
            along *= np.where(inward < 0, -1.0, 1.0)[:, None]
            line += np.where(there[:, None], along, 0.0)
        through = np.einsum("kd,kd->k", edge, normal)
        through = np.where(np.abs(through) < 0.05, np.where(through < 0, -0.05, 0.05), through)
        gradient = -(np.einsum("kd,kd->k", edge, line) / through)[:, None] * normal
        size = np.linalg.norm(gradient, axis=1, keepdims=True)
        step = CONTOUR_STEP * gradient / np.sqrt(size**2 + CONTOUR_SOFTNESS**2)
        from_a = np.einsum("kd,kd->k", x[a] - x[c], normal)
        from_b = np.einsum("kd,kd->k", x[b] - x[c], normal)
        t = np.clip(from_a / np.where(from_a == from_b, 1.0, from_a - from_b), 0.0, 1.0)
        total, count = np.zeros((len(x), 3)), np.zeros(len(x))
        for vertex, share in ((a, 1 - t), (b, t)):
            np.add.at(total, vertex, step * share[:, None])
            np.add.at(count, vertex, share)
        for vertex in (c, d, e):
            np.add.at(total, vertex, -step / 3)
            np.add.at(count, vertex, 1 / 3)
        self.move_cloth(total[: self.n] / np.maximum(count[: self.n], 1.0)[:, None])

    def move_cloth(self, step: np.ndarray) -> None:
        """Move the cloth by `step` (N, 3) m as a sheet: neighbours come along, and edges keep their lengths."""
        spread = step
        for _ in range(SPREAD_ROUNDS):
            spread = self.mean_of_neighbours @ spread
        largest = np.linalg.norm(spread, axis=1).max()
        cloth = self.x[: self.n]
        cloth += spread * (CONTOUR_STEP / max(largest, 1e-12))
        a, b = self.edges.T
        for _ in range(LENGTH_ROUNDS):
            way = cloth[b] - cloth[a]
            length = np.linalg.norm(way, axis=1)
            pull = (0.5 * (1.0 - self.length / np.maximum(length, 1e-12)))[:, None] * way
            change = np.zeros_like(cloth)
            np.add.at(change, a, pull)
            np.add.at(change, b, -pull)
            cloth += change / self.valence[:, None]

    def push(self) -> int:
        """Push apart what is too close; returns how many stencils were before."""
        sim = self.sim
        self.list_candidates()
        first = 0
        for k in range(PUSHES):
            close = push_apart(
                sim.candidates, self.n, sim.contact.sizes, PUSH_SHARE, PUSH_RELAXATION, sim.state.x
            )
            first = first if k else close
            if close == 0:
                break
        self.x = sim.state.x.numpy().astype(np.float64)
        self.listed = first == 0
        return first

    def list_candidates(self) -> None:
        """Let the simulation be at x, with the candidates around it."""
        sim = self.sim
        sim.state.x.assign(self.x.astype(np.float32))
        sim.work.direction.zero_()
        sim.searches = 0
        search_around(sim, sim.state.x, sim.work.direction)

    def refuse_what_is_left(self) -> None:
        """Raises TangledError unless the state is free; leaves it in the simulation if it is."""
        sim = self.sim
        left = self.crossings()
        if len(left):
            faces = np.union1d(np.unique(left[:, 1]), _faces_at(self.faces, self.edges[left[:, 0]]))
            raise TangledError(f"{len(faces)} triangles cross other triangles of the garment", faces)
        if self.dent:
            faces, why = self.dent.stuck(self.x)
            if len(faces):
                raise TangledError(f"{len(faces)} triangles {why}", faces)
        if not self.listed:
            self.list_candidates()
        if violations(sim.candidates, self.n, sim.contact.sizes, sim.state.x, sim.work.hits):
            close = self.still_close()
            raise TangledError(f"{len(close)} triangles stay closer to others than the fabric is thick", close)
        for place in (sim.state.x_start, sim.state.x_feasible):
            wp.copy(place, sim.state.x)

    def still_close(self) -> np.ndarray:
        """Triangles with a vertex in a stencil that is too close."""
        candidates = self.sim.candidates
        ids = candidates.ids.numpy()[: candidates.size]
        close = candidates.distance.numpy()[: candidates.size] < self.sim.contact.sizes.xi_self
        touched = np.unique(ids[close])
        return np.flatnonzero(np.isin(self.faces, touched).any(axis=1))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-30)


def _opposite_corners(faces: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(E, 2) the vertices opposite each edge, of `edges` (E, 2) sorted as `Garment.edges`; -1 where there is none."""
    sides = faces[:, CORNERS].reshape(-1, 3).astype(np.int64)
    count = int(faces.max()) + 1
    keys = sides[:, :2].min(axis=1) * count + sides[:, :2].max(axis=1)
    at = np.searchsorted(edges[:, 0].astype(np.int64) * count + edges[:, 1], keys)
    second = np.ones(len(at), bool)
    second[np.unique(at, return_index=True)[1]] = False
    result = np.full((len(edges), 2), -1)
    for column, chosen in enumerate((~second, second)):
        result[at[chosen], column] = sides[chosen, 2]
    return result


def _faces_at(faces: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Triangles that have one of the edges."""
    wanted = {tuple(sorted(edge)) for edge in edges.tolist()}
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    hit = np.array([tuple(side) in wanted for side in sides.tolist()])
    return np.unique(np.flatnonzero(hit) // 3)
