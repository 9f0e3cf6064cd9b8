"""What is watched: a simulation under way, or whatever answers the same questions."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import warp as wp

from harness.energy import EnergyMeter
from harness.oracle import SubSteps
from harness.scene import Run
from tryon_solver.results import StepReport
from tryon_solver.simulation import PoseInterval


class Subject(Protocol):
    """Cloth and collision surface, frame by frame. Positions in m, energies in J."""

    faces: np.ndarray  # (F, 3) of the cloth
    uv_corners: np.ndarray  # (F, 3, 2) m
    body_faces: np.ndarray  # (G, 3) of the surface, in its own numbering
    strain_limits: np.ndarray  # (F,)
    total_mass: float  # kg
    offsets: tuple[float, float] | None  # m of cloth from body and from cloth, above which gaps are told; None: untold

    def advance(self, t: float) -> StepReport:
        """Go to the frame at t [s]."""

    def cloth(self) -> np.ndarray:
        """(N, 3) as published."""

    def surface(self) -> np.ndarray:
        """(B, 3) as published."""

    def skin(self, t: float) -> np.ndarray | None:
        """(B, 3) where the surface should be at t [s]; None where that can't be told (other solvers)."""

    def moves(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """The sub-steps accepted on the way to this frame, (A, 3) before and after."""

    def leads(self, start: np.ndarray, end: np.ndarray) -> bool:
        """Do these sub-steps lead from one frame's cloth and surface (A, 3) to the next one's? To be asked before them;
        True where not all are known."""

    def energies(self) -> tuple[float, float, float]:
        """Kinetic, stored, and potential in gravity."""

    def work(self) -> float:
        """Done on the cloth since the frame before."""


class Simulated:
    """A case that the solver runs; what its steps should overwrite is not a number before the first."""

    def __init__(self, run: Run, heard: SubSteps) -> None:
        sim, garment = run.sim, run.sim.scene.garment
        self.run, self.sim, self.heard = run, sim, heard
        self.faces, self.uv_corners = garment.faces, garment.uv_corners
        self.body_faces = np.zeros((0, 3), np.int32) if sim.scene.body is None else sim.scene.body.faces
        self.strain_limits = np.array([fabric.strain_limit for fabric in sim.scene.fabric_of_face()])
        self.total_mass = float(sim.mass.sum())
        self.offsets = sim.contact.sizes.xi_body, sim.contact.sizes.xi_self
        self.meter = EnergyMeter(sim)
        self.done = 0.0
        commit = sim.commit

        def measured(interval: PoseInterval) -> None:
            commit(interval)
            self.meter.contact()
            self.done += self.meter.work()

        sim.commit = measured  # type: ignore[method-assign]
        self.meter.contact()
        poison(run)

    def advance(self, t: float) -> StepReport:
        return self.run.advance(t)

    def cloth(self) -> np.ndarray:
        return self.sim.cloth_positions()

    def surface(self) -> np.ndarray:
        return self.sim.body_positions()

    def skin(self, t: float) -> np.ndarray:
        return np.zeros((0, 3)) if self.sim.scene.body is None else self.sim.scene.body.surface(self.run.stance(t))

    def moves(self) -> list[tuple[np.ndarray, np.ndarray]]:
        return self.heard.take()

    def leads(self, start: np.ndarray, end: np.ndarray) -> bool:
        all_heard = self.heard.by_launches or not wp.get_device(self.sim.device).is_cuda
        return self.heard.lead(start, end) if all_heard else True

    def energies(self) -> tuple[float, float, float]:
        return self.meter.energies()

    def work(self) -> float:
        done, self.done = self.done, 0.0
        return done


def poison(run: Run) -> None:
    """Fill with NaN what a step has to write before it reads it."""
    sim = run.sim
    nothing = wp.vec3(np.nan, np.nan, np.nan)
    work, state = sim.work, sim.state
    for vectors in (
        work.gradient,
        work.corner_gradient,
        work.direction,
        work.product,
        work.residual,
        work.preconditioned,
        work.total,
        state.x_start,
        state.x_feasible,
        state.x_hat,
        state.acceleration,
        sim.to_trial,
        sim.x_carried,
    ):
        vectors.fill_(nothing)
    for numbers in (work.alpha, *([sim.filtering.travel] if sim.touching else []), *work.scalars):
        numbers.fill_(np.nan)
