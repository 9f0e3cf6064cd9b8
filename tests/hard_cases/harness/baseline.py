"""Hard cases by other solvers: the same scene, stepped by XPBD or Chebyshev-Jacobi, judged alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from harness.scene import Run
from tryon_solver.baselines.chebyshev_jacobi_pd.solver import ChebyshevJacobi
from tryon_solver.baselines.xpbd.solver import Xpbd
from tryon_solver.body.model import BodyModel
from tryon_solver.results import StepReport
from tryon_solver.scene import FabricDamping, Sleep

SOLVERS: dict[str, Callable[..., Any]] = {"xpbd": Xpbd, "chebyshev": ChebyshevJacobi}
TELLING = (
    "needle",
    "knife_edge",
    "corner",
    "three_layers_dropped",
    "ten_layers_dropped",
    "weight_100",
    "bending_0",
    "arms_pressed_in",
    "deep_squat",
    "jump",
)
"""Cases that both can be given: one fabric, no pins that are led, a body that is posed by joints."""


class InexpressibleError(ValueError):
    """A case that the other solver has no means for."""


class ByBaseline:
    """A case as such a solver plays it. Its energy is not asked: what it does to the cloth as work can't be told."""

    def __init__(self, run: Run, solver: str) -> None:
        """Raises InexpressibleError."""
        scene, settings = run.sim.scene, run.sim.settings
        if run.drive is not None or run.step is not None:
            raise InexpressibleError("what drives this case knows our solver only")
        if scene.body is not None and not isinstance(scene.body, BodyModel):
            raise InexpressibleError(f"it follows bodies that are posed by joints, no {type(scene.body).__name__}")
        effects = tuple(effect for effect in scene.effects if not isinstance(effect, (FabricDamping, Sleep)))
        try:
            self.solver = SOLVERS[solver](replace(scene, effects=effects), settings)
        except ValueError as error:
            raise InexpressibleError(str(error)) from error
        garment = scene.garment
        self.run, self.last = run, 0.0
        self.motion = self.solver.start(run.stance(0.0))
        self.count, self.kinetic = garment.vertex_count, 0.0
        self.faces, self.uv_corners = garment.faces, garment.uv_corners
        self.body_faces = np.zeros((0, 3), np.int32) if scene.body is None else scene.body.faces
        self.strain_limits = np.array([fabric.strain_limit for fabric in scene.fabric_of_face()])
        self.mass = run.sim.mass
        self.total_mass = float(self.mass.sum())

    def advance(self, t: float) -> StepReport:
        self.motion = self.solver.step(self.motion, self.run.stance(t), t - self.last)
        self.last = t
        return replace(self.run.sim.reported, time=t, body_lag=0.0, retries=0, reverts=0, advice="")

    def cloth(self) -> np.ndarray:
        return self.motion.x[: self.count].astype(np.float32)

    def surface(self) -> np.ndarray:
        return self.motion.x[self.count :].astype(np.float32)

    def skin(self, _t: float) -> np.ndarray:
        return self.surface()

    def moves(self) -> list[tuple[np.ndarray, np.ndarray]]:
        return []

    def energies(self) -> tuple[float, float, float]:
        return 0.5 * float(self.mass @ (self.motion.v**2).sum(1)), 0.0, 0.0

    def work(self) -> float:
        """As much as the cloth is faster for, so that no growth is told."""
        kinetic, before = self.energies()[0], self.kinetic
        self.kinetic = kinetic
        return kinetic - before
