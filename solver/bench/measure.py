"""One case, played and timed frame by frame; frames are judged by IPC Toolkit between the timed calls."""

from __future__ import annotations

import ctypes
import gc
import itertools
import resource
import time
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp
from figures import mean, spread
from frame_record import FrameRecord
from judge_apart import judge_apart
from together import Company
from waits import Waits
from worn import LEAD, Case, put_on

MIB = 2**20


def measured(case: Case, seconds: float, every: int, longest: float, company: Company) -> dict[str, Any]:
    """Figures of `seconds` of the motion after the lead into it, or of as many frames as `longest` s of wall time have
    room for, judging included; each `every`-th frame is judged, 0: none.

    What is written of the frames is taken before, and the judge is a process of its own. All of the company begin at
    once, and go on until the last one has measured all."""
    at_first = device_memory(case.device)
    begun = time.perf_counter()
    sim, pose = put_on(case)
    wp.synchronize_device(case.device)
    dressing = time.perf_counter() - begun
    start, warm = sim.state.time, round(LEAD * case.fps)
    unclean = asked = 0
    since = 0.0
    last = warm + round(seconds * case.fps)
    waits = Waits(case.device)
    with judge_apart(sim) as is_clean:
        for k in itertools.count(1):
            if k == warm + 1:
                is_clean()  # its process begins here
                give_back_freed()
                frames = FrameRecord(last - warm, partial(memory, case.device))
                company.meet("warm")
                since = time.perf_counter()
            if k == last + 1:
                company.pass_by("done")
            if k > last and company.all_at("done"):
                break
            t = k / case.fps
            stance = pose(t)
            with waits.counted():
                begun = time.perf_counter()
                report = sim.advance(stance, start + t)
                wp.synchronize_device(case.device)
                elapsed = 1e3 * (time.perf_counter() - begun)
            if not warm < k <= last:
                continue
            frames.add(elapsed, waits.count, report)
            if every and k % every == 0:
                asked += 1
                unclean += not is_clean()
            if time.perf_counter() - since > longest:
                last = k
    give_back_freed()
    body = sim.scene.body
    return {
        **case.plain(),
        "motion": Path(case.motion).stem,  # a file's place says nothing on another machine
        "machine": str(wp.get_device(case.device).name),
        "cloth_vertices": sim.cloth_count,
        "triangles": len(sim.scene.garment.faces),
        "body_vertices": 0 if body is None else len(body.rest_vertices),
        "dressing_s": dressing,
        "frames": len(frames),
        "frame_ms": spread(frames["time_ms"]),
        "behind": int(np.count_nonzero(frames["time_ms"] > 1e3 / case.fps)),
        "waits": spread(frames["waits"]) if wp.get_device(case.device).is_cuda else None,
        "times_ms": frames["time_ms"].tolist(),
        "stages_ms": {name: spread(times) for name, times in frames.stages().items()},
        "steps": mean(frames["steps"]),
        "substeps": {str(n): count for n, count in sorted(Counter(frames["substeps"].astype(int).tolist()).items())},
        "newton": spread(frames["newton_iterations"]),
        "error_mm": spread(1e3 * frames["error"]),
        "late": int(np.count_nonzero(frames["late"] > 0)),
        "pairs": spread(frames["pairs"]),
        "min_gap": float(frames["min_gap"].min()),
        "max_stretch": float(frames["max_stretch"].max()),
        "body_lag": float(frames["body_lag"].max()),
        "void": int(frames["retries"].sum()),
        "asked": asked,
        "unclean": unclean,
        "memory_mib": None if at_first is None else (device_memory(case.device) or 0.0) - at_first,
        "memory_at_most_mib": None if at_first is None else device_memory_at_most(case.device) - at_first,
        "growth_mib": frames.growth(),
        "growth_most_mib": frames.most_growth(),
        "growth_late_mib": frames.late_growth(),
        "simulated_over_wall": 1e3 * len(frames) / case.fps / float(frames["time_ms"].sum()),
    }


def device_memory(device: str) -> float | None:
    """What Warp's pool holds on a GPU [MiB]; None on a processor."""
    if not wp.get_device(device).is_cuda:
        return None
    return float(wp.get_mempool_used_mem_current(device)) / MIB


def device_memory_at_most(device: str) -> float:
    """The most that it has held [MiB], dressing included."""
    return float(wp.get_mempool_used_mem_high(device)) / MIB


def give_back_freed() -> None:
    """What is freed goes back to the machine where the allocator can (glibc): in it growth hides, or it is some."""
    gc.collect()
    if give_back := getattr(ctypes.CDLL(None), "malloc_trim", None):
        give_back(0)


def memory(device: str) -> dict[str, float]:
    """What this process holds [MiB]: of the machine's memory, and of the GPU's if it is on one."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    held = {"process": pages * resource.getpagesize() / MIB}
    on_device = device_memory(device)
    return held if on_device is None else {**held, "device": on_device}
