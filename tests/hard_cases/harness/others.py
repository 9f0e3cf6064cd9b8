"""Hard cases by other solvers: what all of them have in common, and which there are."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace

import numpy as np

from harness.scene import Run
from tryon_solver.body.model import BodyModel
from tryon_solver.results import StepReport

OURS = "ours"
BASELINES = ("xpbd", "chebyshev")
PEERS = ("vbd", "style3d")
"""Of NVIDIA's Newton, which is installed apart: `pip install -e '.[peers]'`."""

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
"""Cases that all can be given: one fabric, no pins that are led, a body that is posed by joints."""


class InexpressibleError(ValueError):
    """A case that the other solver has no means for."""


class Other(ABC):
    """A case as another solver plays it. Its energy is not asked: what it does to the cloth as work can't be told."""

    def __init__(self, run: Run) -> None:
        """Raises InexpressibleError."""
        scene = run.sim.scene
        if run.drive is not None or run.step is not None:
            raise InexpressibleError("what drives this case knows our solver only")
        if scene.body is not None and not isinstance(scene.body, BodyModel):
            raise InexpressibleError(f"it follows bodies that are posed by joints, no {type(scene.body).__name__}")
        if scene.panel_fabrics:
            raise InexpressibleError("it takes garments of one fabric")
        self.run, self.last, self.kinetic = run, 0.0, 0.0
        self.faces, self.uv_corners = scene.garment.faces, scene.garment.uv_corners
        self.body_faces = np.zeros((0, 3), np.int32) if scene.body is None else scene.body.faces
        self.strain_limits = np.array([fabric.strain_limit for fabric in scene.fabric_of_face()])
        self.mass = run.sim.mass
        self.total_mass = float(self.mass.sum())
        self.offsets = None

    @abstractmethod
    def go(self, t: float, dt: float) -> None:
        """Step by dt to t [s]."""

    @abstractmethod
    def velocities(self) -> np.ndarray:
        """(N, 3) m/s of the cloth."""

    @abstractmethod
    def cloth(self) -> np.ndarray:
        """(N, 3) as published."""

    @abstractmethod
    def surface(self) -> np.ndarray:
        """(B, 3) as published."""

    def advance(self, t: float) -> StepReport:
        self.go(t, t - self.last)
        self.last = t
        return replace(self.run.sim.reported, time=t, body_lag=0.0, retries=0, reverts=0, advice="")

    def skin(self, _t: float) -> np.ndarray:
        return self.surface()

    def moves(self) -> list[tuple[np.ndarray, np.ndarray]]:
        return []

    def leads(self, _start: np.ndarray, _end: np.ndarray) -> bool:
        return True

    def energies(self) -> tuple[float, float, float]:
        return 0.5 * float(self.mass @ (self.velocities() ** 2).sum(1)), 0.0, 0.0

    def work(self) -> float:
        """As much as the cloth is faster for, so that no growth is told."""
        kinetic, before = self.energies()[0], self.kinetic
        self.kinetic = kinetic
        return kinetic - before


def played_by(solver: str, run: Run) -> Other:
    """The case as `solver` plays it. Raises InexpressibleError; ImportError without Newton where that is asked for."""
    if solver in BASELINES:
        from harness.baseline import ByBaseline

        return ByBaseline(run, solver)
    from harness.by_newton import ByNewton

    return ByNewton(run, solver)
