"""What a bench keeps of each frame: numbers in memory taken beforehand, so that a long run's own record does not look
like growth of the solver."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tryon_solver.results import StepReport

KEPT = (
    "steps",
    "substeps",
    "newton_iterations",
    "error",
    "late",
    "pairs",
    "min_gap",
    "max_stretch",
    "body_lag",
    "retries",
)


class FrameRecord:
    """Room for `frames` frames: of each its time [ms], the report's figures in KEPT and its stages' times [ms]."""

    def __init__(self, frames: int, stages: Iterable[str]) -> None:
        self._columns = {name: np.full(frames, np.nan) for name in ("time_ms", *KEPT)}  # written: really taken
        self._stages = {name: np.full(frames, 0.0) for name in stages}
        self._frames = frames
        self._count = 0

    def add(self, time_ms: float, report: StepReport) -> None:
        """Keep a frame's figures."""
        self._columns["time_ms"][self._count] = time_ms
        for name in KEPT:
            self._columns[name][self._count] = getattr(report, name)
        for name, time in report.times_ms.items():
            if name not in self._stages:
                self._stages[name] = np.full(self._frames, 0.0)
            self._stages[name][self._count] = time
        self._count += 1

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, name: str) -> np.ndarray:
        """(frames,) of "time_ms" or of one of KEPT."""
        return self._columns[name][: self._count]

    def stages(self) -> dict[str, np.ndarray]:
        """(frames,) [ms] of each stage; on a GPU that of the host, which waits within the stages that read."""
        return {name: times[: self._count] for name, times in self._stages.items()}
