"""One case, played and timed frame by frame; frames are judged by IPC Toolkit between the timed calls."""

from __future__ import annotations

import itertools
import resource
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import warp as wp
from figures import mean, spread
from frame_judge import FrameJudge
from together import Company
from worn import LEAD, Case, put_on

from tryon_solver.results import StepReport
from tryon_solver.simulation import Simulation

MIB = 2**20


def measured(case: Case, seconds: float, every: int, longest: float, company: Company) -> dict[str, Any]:
    """Figures of `seconds` of the motion after the lead into it, or of as many frames as `longest` s of wall time have
    room for, judging included; each `every`-th frame is judged, 0: none.

    All of the company begin at once, and go on until the last one has measured all."""
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
    since = 0.0
    memory_at_first: dict[str, float] = {}
    last = warm + round(seconds * case.fps)
    for k in itertools.count(1):
        if k == warm + 1:
            memory_at_first = memory(case.device)
            company.meet("warm")
            since = time.perf_counter()
        if k == last + 1:
            company.pass_by("done")
        if k > last and company.all_at("done"):
            break
        t = k / case.fps
        stance = pose(t)
        begun = time.perf_counter()
        report = sim.advance(stance, start + t)
        wp.synchronize_device(case.device)
        elapsed = 1e3 * (time.perf_counter() - begun)
        if not warm < k <= last:
            continue
        times.append(elapsed)
        reports.append(report)
        if every and k % every == 0:
            asked += 1
            unclean += not judge.judge(sim.cloth_positions(), sim.body_positions()).clean
        if time.perf_counter() - since > longest:
            last = k
    body = sim.scene.body
    return {
        **case.plain(),
        "motion": Path(case.motion).stem,  # a file's place says nothing on another machine
        "machine": str(wp.get_device(case.device).name),
        "cloth_vertices": sim.cloth_count,
        "triangles": len(sim.scene.garment.faces),
        "body_vertices": 0 if body is None else len(body.rest_vertices),
        "dressing_s": dressing,
        "frames": len(times),
        "frame_ms": spread(times),
        "times_ms": times,
        "stages_ms": stages(reports),
        "steps": mean([r.steps for r in reports]),
        "substeps": dict(sorted(Counter(str(r.substeps) for r in reports).items(), key=lambda entry: int(entry[0]))),
        "newton": spread([r.newton_iterations for r in reports]),
        "error_mm": spread([1e3 * r.error for r in reports]),
        "late": sum(r.late > 0 for r in reports),
        "pairs": spread([r.pairs for r in reports]),
        "min_gap": min(r.min_gap for r in reports),
        "max_stretch": max(r.max_stretch for r in reports),
        "body_lag": max(r.body_lag for r in reports),
        "void": sum(r.retries for r in reports),
        "asked": asked,
        "unclean": unclean,
        "memory_mib": None if at_first is None else (device_memory(case.device) or 0.0) - at_first,
        "growth_mib": {name: now - memory_at_first[name] for name, now in memory(case.device).items()},
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


def memory(device: str) -> dict[str, float]:
    """What this process holds [MiB]: of the machine's memory, and of the GPU's if it is on one."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    held = {"process": pages * resource.getpagesize() / MIB}
    on_device = device_memory(device)
    return held if on_device is None else {**held, "device": on_device}


def stages(reports: Sequence[StepReport]) -> dict[str, dict[str, float]]:
    """Each verb's time in a frame [ms]; on a GPU that of the host, which waits within the verbs that read."""
    names = list(dict.fromkeys(name for r in reports for name in r.times_ms))
    return {name: spread([r.times_ms.get(name, 0.0) for r in reports]) for name in names}
