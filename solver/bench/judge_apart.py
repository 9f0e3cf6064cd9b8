"""IPC Toolkit in a process of its own, so that what its threads hold does not look like growth of the solver."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:  # neither is needed where the other is
    from frame_judge import FrameJudge

    from tryon_solver.simulation import Simulation

_judge: FrameJudge


class JudgeApart:
    """Asked of one simulation's frames, while it waits for the verdict; its process ends with the `with` block."""

    def __init__(self, sim: Simulation) -> None:
        assert sim.scene.body is not None
        self._sim = sim
        shapes = (sim.scene.garment.faces, sim.scene.body.faces, sim.cloth_positions(), sim.body_positions())
        # spawned, not forked: a process that has used CUDA can't be
        apart = multiprocessing.get_context("spawn")
        self._judge = ProcessPoolExecutor(1, mp_context=apart, initializer=_prepare, initargs=shapes)

    def __enter__(self) -> JudgeApart:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._judge.shutdown()

    def finds_clean(self) -> bool:
        """Does nothing in the simulation's present frame cross, and is nothing inside the body?"""
        return self._judge.submit(_clean, self._sim.cloth_positions(), self._sim.body_positions()).result()


def _prepare(cloth_faces: np.ndarray, body_faces: np.ndarray, cloth: np.ndarray, body: np.ndarray) -> None:
    global _judge
    from frame_judge import FrameJudge

    _judge = FrameJudge(cloth_faces, body_faces, cloth, body)


def _clean(cloth: np.ndarray, body: np.ndarray) -> bool:
    return bool(_judge.judge(cloth, body).clean)
