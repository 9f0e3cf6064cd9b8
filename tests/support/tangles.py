"""Two sheets over a ball, thrown at each other: feasible states and motions that would not be."""

from __future__ import annotations

from functools import cached_property

import ipctk
import numpy as np
from reference_distances import all_stencils, stencil_distances, stencil_keys
from small_scenes import STILL, fabric, icosphere, layers, rigid_body

from tryon_solver.scene import BodyContact, Scene, SelfContact
from tryon_solver.simulation import Simulation, build

ipctk.set_logger_level(ipctk.LoggerLevel.error)


class Tangle:
    """A simulation of two sheets above a ball, with an oracle's mesh of the same triangles."""

    def __init__(self, columns: int = 9, size: float = 0.2, apart: float = 0.006, device: str = "cpu") -> None:
        garment, x = layers(2, columns, columns, size, apart)
        ball, self.ball_faces = icosphere(0.06, 2)
        ball = ball - np.array([0, 0.06 + apart, 0])
        scene = Scene(garment, x, rigid_body(ball, self.ball_faces), fabric(), (BodyContact(), SelfContact()))
        self.sim: Simulation = build(scene, None, device, STILL)
        self.x = np.vstack([x, ball]).astype(np.float32).astype(np.float64)
        self.cloth = garment.vertex_count

    @cached_property
    def faces(self) -> np.ndarray:
        """(F, 3) of cloth and ball in one index space."""
        return np.vstack([self.sim.scene.garment.faces, self.ball_faces + self.cloth])

    @cached_property
    def oracle(self) -> ipctk.CollisionMesh:
        """Everything but the ball with itself collides."""
        faces = np.asfortranarray(self.faces)
        mesh = ipctk.CollisionMesh(np.asfortranarray(self.x), ipctk.edges(faces), faces)
        mesh.can_collide = ipctk.make_static_obstacle_filter(self.cloth)
        return mesh

    @cached_property
    def stencils(self) -> tuple[np.ndarray, np.ndarray]:
        """Kinds (S,) and ids (S, 4) of everything that may collide."""
        cloth, ball = self.sim.scene.garment.faces, self.ball_faces + self.cloth
        own, body = all_stencils(cloth, cloth), all_stencils(cloth, ball)
        return np.concatenate([own[0], body[0]]), np.vstack([own[1], body[1]])

    @cached_property
    def keys(self) -> np.ndarray:
        """(S,) of the stencils, as `candidate_keys`."""
        return stencil_keys(*self.stencils)

    def distances(self, x: np.ndarray, which: np.ndarray | slice = slice(None)) -> np.ndarray:
        """(S,) m, of the stencils picked out by `which`."""
        kinds, ids = self.stencils
        return stencil_distances(kinds[which], x.take(ids[which], axis=0))[0]

    def is_free(self, x: np.ndarray, moved: np.ndarray) -> bool:
        """Is the straight way free of collisions, by the oracle? (Its own description says the opposite.)"""
        start, end = np.asfortranarray(x), np.asfortranarray(moved)
        return bool(ipctk.is_step_collision_free(self.oracle, start, end))

    def throw(self, rng: np.random.Generator, speed: float) -> np.ndarray:
        """(A, 3) m: a smooth random field that brings the layers through each other, noise, and a common drift."""
        waves = 12 * rng.standard_normal((4, 3))
        phases, strengths = rng.uniform(0, 6, 4), rng.standard_normal((4, 3))
        field = np.einsum("ki,nk->ni", strengths, np.cos(self.x @ waves.T + phases))
        layer = np.where(np.arange(len(self.x)) < self.cloth // 2, 1.0, -1.0)
        noise = 0.2 * rng.standard_normal(self.x.shape)
        drift = rng.standard_normal(3)
        motion = layer[:, None] * field + noise + drift
        return (speed * motion).astype(np.float32).astype(np.float64)

    def set_motion(self, x: np.ndarray, motion: np.ndarray) -> None:
        """Put positions and displacements where the solver's filters take them."""
        self.sim.state.x.assign(x.astype(np.float32))
        self.sim.work.direction.assign(motion.astype(np.float32))
        self.sim.searches = 0

    def candidates(self) -> tuple[np.ndarray, np.ndarray]:
        """Kinds (C,) and ids (C, 4) of the solver's candidates."""
        c = self.sim.candidates
        return c.kind.numpy()[: c.size], c.ids.numpy()[: c.size]

    def candidate_keys(self) -> np.ndarray:
        """The solver's candidates as sorted keys that don't depend on the order of corners and edges, each once."""
        return np.unique(stencil_keys(*self.candidates()))
