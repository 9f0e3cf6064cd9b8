"""What holds a garment besides its cut: elastic, drawstrings and belts, which draw it in, and rows of buttons and zips.

Elastic around the body, of the ratio r and the stiffness k [N], pulls with T = k (l/L - r) where its length L in the
pattern is stretched to l. Around something round it presses with 2 pi T in all (T/radius on each length of it), and
friction carries mu of that. So it carries a garment of the weight W where it is stretched to

    l = L (r + W/(2 pi mu k)),

and holds wherever the body is at least so wide. Belts: the capstan's pressure (Euler 1769); the rest ours.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra

from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.lines import chain, corners_of_edges
from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import Effect, Elastic, Fasteners

G = 9.81  # m/s^2
JOINED = 1e-9  # m, of what is buttoned: no length at all means no edge to a sparse matrix


@dataclass(frozen=True, eq=False)
class Holding:
    """Edges (E, 2) of the mesh with elastic in them, and the share (E,) of their length in the pattern at which it
    carries the garment, at most 1; pairs (P, 2) of vertices that are fastened to each other. `bears` is the stretch
    that the fabric bears, infinite where that is not known."""

    elastic: np.ndarray
    shares: np.ndarray
    fastened: np.ndarray
    bears: float = np.inf

    @property
    def is_any(self) -> bool:
        """Is there anything besides the cut that holds?"""
        return len(self.elastic) > 0 or len(self.fastened) > 0


NOTHING = Holding(np.zeros((0, 2), np.int32), np.zeros(0), np.zeros((0, 2), np.int32))


def holding(effects: Sequence[Effect], garment: Garment, fabric: Fabric) -> Holding:
    """What these effects do for the hold of a garment of that fabric on the skin."""
    weight = fabric.areal_density * G * float(garment.signed_areas().sum())
    lines = [line for effect in effects if isinstance(effect, Elastic) for line in effect.lines if line.stiffness]
    pairs = [effect.pairs for effect in effects if isinstance(effect, Fasteners)]
    pull = weight / (2 * np.pi * fabric.mu_body) if fabric.mu_body else np.inf  # N
    shares = [np.full(len(line.edges), min(line.ratio + pull / line.stiffness, 1.0)) for line in lines]
    return Holding(
        np.vstack([NOTHING.elastic, *(line.edges for line in lines)]),
        np.concatenate([NOTHING.shares, *shares]),
        np.vstack([NOTHING.fastened, *pairs]),
        fabric.strain_limit,
    )


def rings(
    garment: Garment, x: np.ndarray, held: Holding, axis: tuple[float, float]
) -> Iterator[tuple[np.ndarray, float]]:
    """Rings around the vertical line at `axis`, its x and z [m], along borders, elastic and what is fastened: of each
    the vertices of the garment at x (N, 3) m, and how long it is where it carries the garment [m].

    Each is the shortest through one of the places where such lines cross the half-plane in front of that line: a way on
    two copies of the garment, which change where it is crossed, from a vertex to its copy.
    """
    borders = [chain(loop, closed=True) for loop in boundary_loops(garment.faces)]
    edges = np.vstack([*borders, held.elastic])
    flat = garment.uv_corners.reshape(-1, 2)
    corners = corners_of_edges(garment, edges, "rings")
    lengths = np.linalg.norm(flat[corners[:, 0]] - flat[corners[:, 1]], axis=1)
    lengths[len(edges) - len(held.elastic) :] *= held.shares
    ends = np.vstack([edges, held.fastened]).astype(np.int64)
    lengths = np.concatenate([lengths, np.full(len(held.fastened), JOINED)])
    low, high = np.sort(ends, axis=1).T
    order = np.lexsort((lengths, high, low))  # of a border with elastic in it, the elastic
    first = np.unique(low[order] * garment.vertex_count + high[order], return_index=True)[1]
    low, high, lengths = low[order][first], high[order][first], lengths[order][first]
    a, b = x[low], x[high]
    apart = (a[:, 0] > axis[0]) != (b[:, 0] > axis[0])
    step = np.where(apart, b[:, 0] - a[:, 0], 1.0)
    crosses = apart & (a[:, 2] + (axis[0] - a[:, 0]) / step * (b[:, 2] - a[:, 2]) > axis[1])
    count = garment.vertex_count
    other = np.where(crosses, count, 0)
    rows, columns = np.concatenate([low, low + count]), np.concatenate([high + other, high + count - other])
    graph = sp.csr_matrix((np.tile(lengths, 2), (rows, columns)), shape=(2 * count, 2 * count))
    starts = np.unique(low[crosses])
    if not len(starts):
        return
    ways, before = dijkstra(graph, directed=False, indices=starts, return_predecessors=True)
    for k, start in enumerate(starts.tolist()):
        if np.isfinite(ways[k, start + count]):
            way = [start + count]
            while way[-1] != start:
                way.append(int(before[k, way[-1]]))
            yield np.unique(np.array(way) % count), float(ways[k, start + count])
