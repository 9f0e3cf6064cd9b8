"""A run that is given frame by frame, for the harness to judge: the good one, from which bad ones differ in one way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from frame_judge import principal_stretches
from harness.oracle import SubSteps
from small_scenes import icosphere, sheet

from tryon_solver.results import StepReport

DT, SECONDS, STOPS = 1 / 60, 2.0, 0.5
LAST = round(SECONDS / DT)
REPORT = StepReport(0.0, 1, 1, 1, 1, 0.0, 1e-3, 1.0, 0.0, 0, 0, 0, 0.0)


class Scripted:
    """A square over a ball that hangs in the air and does what it is told: override a method, or an attribute."""

    def __init__(self) -> None:
        garment, x = sheet(9, 9, 0.2, 0.2)
        self.ball, self.body_faces = icosphere(0.08, 2)
        self.faces, self.uv_corners = garment.faces, garment.uv_corners
        self.strain_limits = np.full(len(self.faces), 1.1)
        self.total_mass = 0.01
        self.offsets: tuple[float, float] | None = None
        self.x_start = x + [0, 0.1, 0]
        self.k = 0
        self.before = self.positions(0)

    def positions(self, _k: int) -> np.ndarray:
        """(N, 3) m of a frame."""
        return self.x_start

    def advance(self, t: float) -> StepReport:
        self.before = self.positions(self.k)
        self.k = round(t / DT)
        return replace(self.report(self.k), max_stretch=self.told_stretch())

    def report(self, _k: int) -> StepReport:
        """But for the largest stretch."""
        return REPORT

    def told_stretch(self) -> float:
        x = self.cloth()
        return float(principal_stretches(x, self.faces, self.uv_corners).max()) if np.isfinite(x).all() else np.nan

    def cloth(self) -> np.ndarray:
        return self.positions(self.k).astype(np.float32)

    def surface(self) -> np.ndarray:
        return self.ball.astype(np.float32)

    def skin(self, _t: float) -> np.ndarray:
        return self.ball

    def moves(self) -> list[tuple[np.ndarray, np.ndarray]]:
        return [tuple(np.vstack([x, self.ball]).astype(np.float32) for x in (self.before, self.positions(self.k)))]

    def leads(self, start: np.ndarray, end: np.ndarray) -> bool:
        heard = SubSteps(by_launches=True)
        heard.moves = self.moves()
        return heard.lead(start, end)

    def energies(self) -> tuple[float, float, float]:
        """Falls a little and comes to rest."""
        gone = min(self.k / 30, 1.0)
        return 0.0, 1e-3, 1e-2 * (1 - gone)

    def work(self) -> float:
        return 0.0
