"""Hard cases by the repository's other solvers: the same scene, stepped by XPBD or Chebyshev-Jacobi, judged alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from harness.others import InexpressibleError, Other
from harness.scene import Run
from tryon_solver.baselines.chebyshev_jacobi_pd.solver import ChebyshevJacobi
from tryon_solver.baselines.xpbd.solver import Xpbd
from tryon_solver.scene import FabricDamping, Sleep

SOLVERS: dict[str, Callable[..., Any]] = {"xpbd": Xpbd, "chebyshev": ChebyshevJacobi}


class ByBaseline(Other):
    """A case as such a solver plays it, without fabric damping, which it has not."""

    def __init__(self, run: Run, solver: str) -> None:
        """Raises InexpressibleError."""
        super().__init__(run)
        scene, settings = run.sim.scene, run.sim.settings
        effects = tuple(effect for effect in scene.effects if not isinstance(effect, (FabricDamping, Sleep)))
        try:
            self.solver = SOLVERS[solver](replace(scene, effects=effects), settings)
        except ValueError as error:
            raise InexpressibleError(str(error)) from error
        self.motion = self.solver.start(run.stance(0.0))
        self.count = scene.garment.vertex_count

    def go(self, t: float, dt: float) -> None:
        self.motion = self.solver.step(self.motion, self.run.stance(t), dt)

    def velocities(self) -> np.ndarray:
        return self.motion.v

    def cloth(self) -> np.ndarray:
        return self.motion.x[: self.count].astype(np.float32)

    def surface(self) -> np.ndarray:
        return self.motion.x[self.count :].astype(np.float32)
