"""The reference in time: implicit Euler steps, each solved to the end, of a garment on a moving body."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from tryon_solver.baselines.newton_ipc import cache
from tryon_solver.baselines.newton_ipc.contact import Presliding
from tryon_solver.baselines.newton_ipc.discrete import Discrete
from tryon_solver.baselines.newton_ipc.newton import Solved, solve
from tryon_solver.baselines.newton_ipc.potential import Lagged, StepProblem
from tryon_solver.baselines.newton_ipc.search import Search
from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose, skin
from tryon_solver.scene import Scene
from tryon_solver.settings import Settings

TOLERANCE = 1e-8  # m


@dataclass(frozen=True)
class Motion:
    """Where everything is and how it moves: `x` (A, 3) m, cloth and surface; `v` (N, 3) m/s; the body's pose; how far
    contacts have given, which other solvers do not keep."""

    x: np.ndarray
    v: np.ndarray
    pose: Pose | None
    known: Presliding = field(default_factory=Presliding.none)


class Reference:
    """A scene solved in float64, step by step.

    `held` (K,) cloth vertices stand still; `kept_in` is a folder where solved steps are kept and looked up (cache.py).
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings | None = None,
        held: np.ndarray | None = None,
        kept_in: Path | None = None,
    ) -> None:
        self.scene = scene
        self.discrete = Discrete.build(scene, settings or Settings(), held)
        self.search = Search(self.discrete)
        self.kept_in = kept_in
        self.solved: Solved | None = None  # of the last step

    @cached_property
    def digest(self) -> str:
        """Of the discrete energy and of the code that solves it."""
        return cache.content_hash(self.discrete, *(path.read_bytes() for path in cache.source_files()))

    def start(self, pose: Pose | None = None) -> Motion:
        """The scene at rest in its start position."""
        cloth = self.scene.x_start
        return Motion(np.vstack([cloth, self.skin(pose)]), np.zeros_like(cloth), pose)

    def skin(self, pose: Pose | None) -> np.ndarray:
        """(B, 3) m, the tracked skin. Raises TypeError for a body that is not posed by joints."""
        body = self.scene.body
        if body is None or pose is None:
            return np.zeros((0, 3))
        if not isinstance(body, BodyModel):
            raise TypeError(f"the reference follows bodies that are posed by joints, no {type(body).__name__}")
        return skin(body, pose)

    def problem(self, motion: Motion, pose: Pose | None, dt: float) -> StepProblem:
        """The step from `motion` by dt [s] to `pose`."""
        discrete = self.discrete
        n = discrete.cloth_count
        x_hat = motion.x[:n] + dt * motion.v + dt * dt * discrete.acceleration
        x_hat[discrete.held] = motion.x[discrete.held]
        lag = motion.x[n:] - self.skin(motion.pose)
        size = np.linalg.norm(lag, axis=1, keepdims=True)
        kept = lag * (1 - np.minimum(1, discrete.return_speed * dt / np.maximum(size, 1e-300)))
        hold = discrete.skin_hold + discrete.skin_firmness * size[:, 0]
        return StepProblem(discrete, dt, motion.x, x_hat, self.skin(pose) + kept, hold, motion.known, motion.v)

    def step(self, motion: Motion, pose: Pose | None, dt: float, tolerance: float = TOLERANCE) -> Motion:
        """Advance by dt [s] to `pose`; what Newton did is in `solved`. Raises NotConvergedError."""
        found, key = None, ""
        if self.kept_in is not None:
            skins = self.skin(motion.pose), self.skin(pose)
            key = cache.content_hash(self.digest, motion.x, motion.v, motion.known, *skins, dt, tolerance)
            found = cache.load(self.kept_in, key)
        if found is None:
            found = solve(self.problem(motion, pose, dt), self.search, motion.x, tolerance)
            if self.kept_in is not None:
                cache.save(self.kept_in, key, found)
        return self.moved(motion, pose, dt, found)

    def moved(self, motion: Motion, pose: Pose | None, dt: float, found: Solved) -> Motion:
        """From `motion` in dt [s] to where Newton has come to, and the body to `pose`."""
        self.solved, n = found, self.discrete.cloth_count
        return Motion(found.x, (found.x[:n] - motion.x[:n]) / dt, pose, found.known)

    def at(self, problem: StepProblem, x: np.ndarray) -> Lagged:
        """The potential of a step with what is lagged taken at x (A, 3) m."""
        return Lagged(problem, self.search, x)
