"""How long it takes from a process's start to its first frame, with and without kernels in Warp's cache."""

from __future__ import annotations

import time
from typing import Any
from unittest import mock

import warp as wp
from worn import Case, put_on


def measured(case: Case, begun: float) -> dict[str, Any]:
    """Seconds since `begun`, of `time.time()`, of one process: until all was imported, until the garment was worn, how
    much of that its kernels took to be compiled, side by side, or loaded, and until the first frame was there. A
    processor's kernels are compiled as they are called, which is not told apart."""
    from tryon_solver import simulation

    imported = time.time() - begun
    kernels = 0.0
    compile_kernels = simulation.compile_kernels

    def timed(device: str) -> None:
        nonlocal kernels
        since = time.perf_counter()
        compile_kernels(device)
        kernels += time.perf_counter() - since

    with mock.patch.object(simulation, "compile_kernels", timed):
        sim, pose = put_on(case)
    wp.synchronize_device(case.device)
    worn = time.time() - begun
    sim.advance(pose(1.0 / case.fps), sim.state.time + 1.0 / case.fps)
    wp.synchronize_device(case.device)
    return {
        **case.plain(),
        "cloth_vertices": sim.cloth_count,
        "imported_s": imported,
        "kernels_s": kernels,
        "worn_s": worn,
        "first_frame_s": time.time() - begun,
    }
