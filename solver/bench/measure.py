"""One case, played and timed frame by frame; frames are judged by IPC Toolkit between the timed calls."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp
from frame_judge import FrameJudge
from worn import LEAD, Case, put_on

from tryon_solver.results import StepReport
from tryon_solver.simulation import Simulation

MIB = 2**20


def measured(case: Case, seconds: float, every: int) -> dict[str, Any]:
    """Figures of `seconds` of the motion after the lead into it; each `every`-th frame is judged, 0: none."""
    at_first = device_memory(case.device)
    begun = time.perf_counter()
    sim, pose = put_on(case)
    wp.synchronize_device(case.device)
    dressing = time.perf_counter() - begun
    start, warm = sim.state.time, round(LEAD * case.fps)
    judge = judge_of(sim)
    times: list[float] = []
    reports: list[StepReport] = []
    unclean = asked = 0
    for k in range(1, warm + round(seconds * case.fps) + 1):
        t = k / case.fps
        stance = pose(t)
        begun = time.perf_counter()
        report = sim.advance(stance, start + t)
        wp.synchronize_device(case.device)
        elapsed = 1e3 * (time.perf_counter() - begun)
        if k <= warm:
            continue
        times.append(elapsed)
        reports.append(report)
        if every and k % every == 0:
            asked += 1
            unclean += not judge.judge(sim.cloth_positions(), sim.body_positions()).clean
    body = sim.scene.body
    return {
        **case.plain(),
        "machine": str(wp.get_device(case.device).name),
        "cloth_vertices": sim.cloth_count,
        "triangles": len(sim.scene.garment.faces),
        "body_vertices": 0 if body is None else len(body.rest_vertices),
        "dressing_s": dressing,
        "frames": len(times),
        "frame_ms": spread(times),
        "stages_ms": stages(reports),
        "steps": mean([r.steps for r in reports]),
        "substeps": dict(sorted(Counter(str(r.substeps) for r in reports).items(), key=lambda entry: int(entry[0]))),
        "newton": spread([r.newton_iterations for r in reports]),
        "pairs": spread([r.pairs for r in reports]),
        "min_gap": min(r.min_gap for r in reports),
        "max_stretch": max(r.max_stretch for r in reports),
        "body_lag": max(r.body_lag for r in reports),
        "void": sum(r.retries for r in reports),
        "asked": asked,
        "unclean": unclean,
        "memory_mib": None if at_first is None else (device_memory(case.device) or 0.0) - at_first,
        "simulated_over_wall": 1e3 * len(times) / case.fps / sum(times),
    }


def judge_of(sim: Simulation) -> FrameJudge:
    """IPC Toolkit, ready for this cloth and this body."""
    assert sim.scene.body is not None
    return FrameJudge(sim.scene.garment.faces, sim.scene.body.faces, sim.cloth_positions(), sim.body_positions())


def device_memory(device: str) -> float | None:
    """What Warp's pool holds on a GPU [MiB]; None on a processor."""
    if not wp.get_device(device).is_cuda:
        return None
    return float(wp.get_mempool_used_mem_current(device)) / MIB


def stages(reports: Sequence[StepReport]) -> dict[str, dict[str, float]]:
    """Each verb's time in a frame [ms]; on a GPU that of the host, which waits within the verbs that read."""
    names = list(dict.fromkeys(name for r in reports for name in r.times_ms))
    return {name: spread([r.times_ms.get(name, 0.0) for r in reports]) for name in names}


def spread(values: Sequence[float]) -> dict[str, float]:
    """Median, 99th percentile and largest."""
    return {
        "p50": float(np.percentile(values, 50)),
        "p99": float(np.percentile(values, 99)),
        "max": float(np.max(values)),
    }


def mean(values: Sequence[float]) -> float:
    return float(np.mean(values))
