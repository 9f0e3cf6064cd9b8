"""Is a body held so that a pattern can be brought around it and sewn? Measured on its skin, without a skeleton.

Three things keep pieces from closing. Skin that lies before other skin (an arm on the trunk, crossed arms, legs
together): cloth has to pass between. Limbs before or behind the trunk (a stride, a seat, arms held out): pieces come
from there. Arms that level sections can't tell from the trunk (raised, crossed): no sleeve is placed around them. Skin
counts as other skin where the way to it along the surface, which no pose changes, is long: armpits and fingers are
narrow in any pose. All of it is ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from tryon_solver.geometry.body_parts import FEWEST_VERTICES, Points, find_trunk
from tryon_solver.geometry.panel_mesh import PanelMesh

NEAR = 0.04  # m, skin that has other skin so near before it is crowded
ROOM = 0.12  # m, skin that has none so near has all the room that pieces need
ALONG = 0.3  # m along the surface, beyond which skin is other skin
HELD_TOGETHER = 0.03  # m between parts of a surface (hair, a jacket) that are taken to hang together
AHEAD = 0.3  # m before or behind the trunk's middle, which nothing of who stands in an A pose reaches
SAMPLES = 1200  # of the skin's vertices are asked what is before them
CROWDED_MOST = 0.02  # share of the covered skin; none of it is in an A pose
AHEAD_MOST = 0.06  # share of the whole skin; less than 1 % of it in an A pose, 27 % of who sits
CLOSE_OPEN = 0.04  # share of the covered skin with less than ROOM, which tells open stances from more open ones
UNEVEN_MOST = 0.5  # by so much of both an arm has more vertices than the other, where the trunk is taken for one
LABEL_OF_SLEEVES = "arm"  # GarmentCode's


@dataclass(frozen=True)
class Covered:
    """What a pattern goes around: heights above y = 0 [m], and whether any of it are sleeves."""

    low: float
    high: float
    sleeves: bool

    @staticmethod
    def by(panels: PanelMesh) -> Covered:
        """As the pattern draws it."""
        heights = panels.placed[:, 1]
        return Covered(float(heights.min()), float(heights.max()), LABEL_OF_SLEEVES in panels.panel_labels)


@dataclass(frozen=True)
class Held:
    """How a body is held, for a garment."""

    crowded: float  # share of the covered skin that has other skin within NEAR before it
    close: float  # the same within ROOM
    ahead: float  # share of the whole skin that is more than AHEAD before or behind the trunk's middle
    uneven: float  # (left - right) / (left + right) of the arms' vertices, absolute; infinite where an arm is not found
    sleeves: bool  # whether the garment has some

    @property
    def strain(self) -> float:
        """What is worst, over what dressing takes: up to 1 for a stance to be dressed in."""
        return max(self.crowded / CROWDED_MOST, self.ahead / AHEAD_MOST, self._armless)

    @property
    def strain_to_choose(self) -> float:
        """The same for who has the choice: the arms are to be found and held alike, whatever the garment."""
        return max(self.strain, self.uneven / UNEVEN_MOST)

    @property
    def rank(self) -> float:
        """Of several stances that dressing takes, the one to be dressed in is that with the lowest; 0 in an A pose."""
        return max(self.strain_to_choose, self.close / CLOSE_OPEN)

    @property
    def _armless(self) -> float:
        return self.uneven if self.sleeves and not np.isfinite(self.uneven) else 0.0

    def describe(self) -> str:
        """What is wrong with it, for people; "" where nothing is."""
        said = []
        if self.crowded > CROWDED_MOST:
            said.append(
                f"{100 * self.crowded:.0f} % of the skin that the garment covers has other skin within "
                f"{100 * NEAR:g} cm before it, as arms on the trunk or legs on each other have"
            )
        if self.ahead > AHEAD_MOST:
            said.append(
                f"{100 * self.ahead:.0f} % of the skin is more than {100 * AHEAD:g} cm before or behind the trunk's "
                "middle, as of who sits, bends, strides or holds the arms out"
            )
        if self._armless:
            said.append("its arms can't be told from its trunk by level sections, as when crossed or raised")
        return " and ".join(said)


@dataclass(frozen=True)
class Skin:
    """A body's surface, at any of its stances: what of it is other skin to what."""

    vertices: Points  # (B, 3) m, at one of them
    faces: NDArray[np.int32]  # (F, 3), turning outwards

    def held(self, x: Points, covered: Covered) -> Held:
        """How it is held at x (B, 3) m, where patterns expect it: on y = 0, facing +Z, its trunk over x = z = 0."""
        areas = np.linalg.norm(self._normals(x), axis=1)
        trunk = find_trunk(x, self.faces)
        arms = [np.count_nonzero(trunk.arms(x, side)) for side in (1, -1)]
        uneven = abs(arms[0] - arms[1]) / sum(arms) if min(arms) >= FEWEST_VERTICES else np.inf
        here = (x[:, 1] > covered.low) & (x[:, 1] < covered.high)
        room = self._room(x)[here[self._samples]]
        area = areas[self._samples][here[self._samples]]
        of = float(area.sum()) or 1.0
        return Held(
            crowded=float(area[room < NEAR].sum()) / of,
            close=float(area[room < ROOM].sum()) / of,
            ahead=float(areas[np.abs(x[:, 2]) > AHEAD].sum() / areas.sum()),
            uneven=float(uneven),
            sleeves=covered.sleeves,
        )

    def _room(self, x: Points) -> NDArray[np.float64]:
        """(S,) m, how far the nearest other skin on the outer side of each sample is; infinite beyond ROOM."""
        near = cKDTree(x).query_ball_point(x[self._samples], ROOM)
        mine = np.repeat(np.arange(len(near)), [len(found) for found in near])
        theirs = np.concatenate([np.asarray(found, np.intp) for found in near])
        other = ~self._same[mine, theirs]
        mine, theirs = mine[other], theirs[other]
        towards = x[theirs] - x[self._samples[mine]]
        before = np.einsum("kd,kd->k", towards, self._normals(x)[self._samples[mine]]) > 0
        room = np.full(len(self._samples), np.inf)
        np.minimum.at(room, mine[before], np.linalg.norm(towards[before], axis=1))
        return room

    def _normals(self, x: Points) -> Points:
        """(B, 3) m^2, outwards, twice the area of the faces around a vertex."""
        a, b, c = (x[self.faces[:, k]] for k in range(3))
        across = np.cross(b - a, c - a)
        return np.stack(
            [np.bincount(self.faces.ravel(), np.repeat(across[:, k], 3), len(x)) for k in range(3)], axis=1
        )

    @cached_property
    def _samples(self) -> NDArray[np.intp]:
        """(S,) vertices, evenly through the numbering."""
        used = np.unique(self.faces)
        return used[:: max(1, len(used) // SAMPLES)].astype(np.intp)

    @cached_property
    def _same(self) -> NDArray[np.bool_]:
        """(S, B) which vertices are nearer to a sample along the surface than ALONG: no other skin."""
        x, count = self.vertices, len(self.vertices)
        ends = np.vstack([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]])
        sides = np.unique(np.sort(ends, axis=1), axis=0)
        part = connected_components(_graph(sides, np.ones(len(sides)), count), directed=False)[1]
        if np.ptp(part[np.unique(self.faces)]) > 0:
            pairs = cKDTree(x).query_pairs(HELD_TOGETHER, output_type="ndarray")
            sides = np.vstack([sides, pairs[part[pairs[:, 0]] != part[pairs[:, 1]]]])
        lengths = np.linalg.norm(x[sides[:, 0]] - x[sides[:, 1]], axis=1)
        graph = _graph(sides, np.maximum(lengths, np.finfo(np.float64).tiny), count)
        return np.isfinite(dijkstra(graph, directed=False, indices=self._samples, limit=ALONG))


def _graph(sides: NDArray[np.integer], lengths: NDArray[np.float64], count: int) -> sp.csr_matrix:
    return sp.coo_matrix((lengths, (sides[:, 0], sides[:, 1])), shape=(count, count)).tocsr()
