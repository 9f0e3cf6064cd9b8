"""What a bench keeps of each frame: numbers in memory taken beforehand, so that a long run's own record does not look
like growth of the solver."""

from __future__ import annotations

from collections.abc import Callable, Mapping

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
STAGES = 32  # room for so many; a step has some twenty verbs


class FrameRecord:
    """Room for `frames` frames: of each its time [ms], how often the host waited in it, the report's figures in KEPT,
    its stages' times [ms], and what `held` says is held of each memory after it [MiB]."""

    def __init__(self, frames: int, held: Callable[[], Mapping[str, float]]) -> None:
        self._columns = {name: np.full(frames, np.nan) for name in ("time_ms", "waits", *KEPT)}
        self._spare = [np.full(frames, 0.0) for _ in range(STAGES)]  # written: really taken
        self._stages: dict[str, np.ndarray] = {}
        self._held = held
        self._memory = {name: np.full(frames, np.nan) for name in held()}
        self._count = 0
        self._before = dict(held())  # read last: this record's own room is in it

    def add(self, time_ms: float, waits: int, report: StepReport) -> None:
        """Keep a frame's figures. IndexError: more stages than there is room for."""
        self._columns["time_ms"][self._count] = time_ms
        self._columns["waits"][self._count] = waits
        for name in KEPT:
            self._columns[name][self._count] = getattr(report, name)
        for name, time in report.times_ms.items():
            if name not in self._stages:
                self._stages[name] = self._spare.pop()
            self._stages[name][self._count] = time
        for name, held in self._held().items():
            self._memory[name][self._count] = held
        self._count += 1

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, name: str) -> np.ndarray:
        """(frames,) of "time_ms", "waits" or of one of KEPT."""
        return self._columns[name][: self._count]

    def stages(self) -> dict[str, np.ndarray]:
        """(frames,) [ms] of each stage; on a GPU that of the host, which waits within the stages that read."""
        return {name: times[: self._count] for name, times in self._stages.items()}

    def growth(self) -> dict[str, float]:
        """How much more of each memory is held now than before the first frame [MiB]."""
        return {name: held - self._before[name] for name, held in self._held().items()}

    def most_growth(self) -> dict[str, float]:
        """How much more was held after any frame, at most [MiB], what was freed and the allocator keeps among it."""
        return {name: float(held[: self._count].max()) - self._before[name] for name, held in self._memory.items()}

    def late_growth(self) -> dict[str, float]:
        """The same of the second half of the frames that were played; nothing of fewer than two."""
        if self._count < 2:
            return {}
        middle = self._count // 2 - 1
        return {name: float(held[self._count - 1] - held[middle]) for name, held in self._memory.items()}
