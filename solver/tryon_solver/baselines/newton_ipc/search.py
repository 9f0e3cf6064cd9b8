"""Which stencils matter, and how far a move is free: IPC Toolkit's broad phase and continuous collision detection."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import ipctk
import numpy as np

from tryon_solver.baselines.newton_ipc.discrete import Discrete
from tryon_solver.baselines.newton_ipc.distance import EDGE_EDGE, POINT_TRIANGLE, closest

ipctk.set_logger_level(ipctk.LoggerLevel.error)

SLACK = 1e-5  # m: stencils that much out of reach are listed, for probes around the point
RESCALING = 0.9  # share of the way to a contact that a move may take: additive CCD's eta


@dataclass(frozen=True)
class Stencils:
    """`kinds` (S,), vertex `ids` (S, 4)."""

    kinds: np.ndarray
    ids: np.ndarray


@dataclass(frozen=True)
class Search:
    """One toolkit mesh per sort of contact, each with the thickness offset that holds for it."""

    discrete: Discrete

    @cached_property
    def meshes(self) -> list[tuple[ipctk.CollisionMesh, int, float]]:
        """(mesh, how many of the vertices it has, offset xi m)."""
        discrete, found = self.discrete, []
        n, b = discrete.cloth_count, discrete.body_count
        if discrete.touches_self:
            found.append((_mesh(n, discrete.faces), n, discrete.contact.xi_self))
        if discrete.touches_body:
            mesh = _mesh(n + b, np.vstack([discrete.faces, discrete.body_faces]))
            patches = np.concatenate([np.zeros(n), np.ones(b)]).astype(np.int32)
            mesh.can_collide = ipctk.make_vertex_patches_filter(patches)  # cloth with body, nothing else
            found.append((mesh, n + b, discrete.contact.xi_body))
        return found

    def within_reach(self, x: np.ndarray) -> Stencils:
        """All stencils nearer than offset, activation distance and a slack at x (A, 3) m."""
        kinds, ids = [np.zeros(0, int)], [np.zeros((0, 4), int)]
        for mesh, count, xi in self.meshes:
            reach = xi + self.discrete.contact.d_hat + SLACK
            candidates = ipctk.Candidates()
            candidates.build(mesh, _fortran(x[:count]), 0.5 * reach * 1.01)
            faces, edges = np.asarray(mesh.faces), np.asarray(mesh.edges)
            pt = np.array([(c.vertex_id, c.face_id) for c in candidates.fv_candidates], int).reshape(-1, 2)
            ee = np.array([(c.edge0_id, c.edge1_id) for c in candidates.ee_candidates], int).reshape(-1, 2)
            ee.sort(axis=1)  # friction knows contacts by their names; the toolkit names two edges in either order
            kind = np.repeat([POINT_TRIANGLE, EDGE_EDGE], [len(pt), len(ee)])
            stencil = np.column_stack([pt[:, 0], faces[pt[:, 1]]])
            stencil = np.vstack([stencil, np.hstack([edges[ee[:, 0]], edges[ee[:, 1]]])])
            near = closest(kind, x[stencil]).d < reach
            ids.append(stencil[near])
            kinds.append(kind[near])
        return Stencils(np.concatenate(kinds), np.vstack(ids))

    def free_share(self, x: np.ndarray, direction: np.ndarray) -> float:
        """The share of the move from x (A, 3) m by `direction` that keeps every distance above its offset."""
        share = 1.0
        narrow = ipctk.AdditiveCCD(conservative_rescaling=RESCALING)
        for mesh, count, xi in self.meshes:
            start, end = _fortran(x[:count]), _fortran((x + share * direction)[:count])
            candidates = ipctk.Candidates()
            candidates.build(mesh, start, end, 0.5 * xi * 1.01)
            share *= candidates.compute_collision_free_stepsize(mesh, start, end, xi, narrow)
        return share


def _mesh(count: int, faces: np.ndarray) -> ipctk.CollisionMesh:
    faces = np.asfortranarray(faces.astype(np.int32))
    return ipctk.CollisionMesh(np.zeros((count, 3), order="F"), ipctk.edges(faces), faces)


def _fortran(x: np.ndarray) -> np.ndarray:
    return np.asfortranarray(x, dtype=np.float64)
