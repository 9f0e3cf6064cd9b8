"""IPC Toolkit in a process of its own, so that what its threads hold does not look like growth of the solver."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:  # neither is needed where the other is
    from frame_judge import FrameJudge

    from tryon_solver.simulation import Simulation

_judge: FrameJudge


@contextmanager
def judge_apart(sim: Simulation) -> Iterator[Callable[[], bool]]:
    """Who says whether in the simulation's present frame nothing crosses and nothing is inside the body; the simulation
    waits for it."""
    assert sim.scene.body is not None
    shapes = (sim.scene.garment.faces, sim.scene.body.faces, sim.cloth_positions(), sim.body_positions())
    # spawned, not forked: a process that has used CUDA can't be
    apart = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=apart, initializer=_prepare, initargs=shapes) as judge:
        yield lambda: judge.submit(_clean, sim.cloth_positions(), sim.body_positions()).result()


def _prepare(cloth_faces: np.ndarray, body_faces: np.ndarray, cloth: np.ndarray, body: np.ndarray) -> None:
    global _judge
    from frame_judge import FrameJudge

    _judge = FrameJudge(cloth_faces, body_faces, cloth, body)


def _clean(cloth: np.ndarray, body: np.ndarray) -> bool:
    return bool(_judge.judge(cloth, body).clean)
