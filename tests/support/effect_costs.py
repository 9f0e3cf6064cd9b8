"""What each effect costs: `python effect_costs.py [--vertices 9] [--frames 3] [--document docs/effects.md]`.

In one process, which has to be new: first all scenes without their effect, then, one after the other, with it. What is
imported, launched and allocated then and was not before is the effect's. Prints one JSON object; with --document the
table of that file is written anew, of frames with and without, in turn.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import platform
import re
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))

LAUNCHED: set[str] = set()
KEPT: list[object] = []  # simulations: where one was freed another's launch could look like one that is known
DT = 1 / 60
BEGIN, END = "<!-- made by `make effects-page` -->", "<!-- until here -->"
UNITS = {"B": 1, "KB": 2**10, "MB": 2**20}


def watch() -> None:
    """Record the kernels that are launched over anything."""
    launch = wp.launch

    def recorded(kernel: wp.Kernel, *arguments: object, **named: object) -> object:
        dim = arguments[0] if arguments else named["dim"]
        if dim not in (0, [0], (0,)):
            LAUNCHED.add(f"{kernel.module.name}.{kernel.key}")
        return launch(kernel, *arguments, **named)

    wp.launch = recorded


def live_bytes(tracker: wp.ScopedMemoryTracker) -> dict[str, float]:
    """By the file that allocated them."""
    out = io.StringIO()
    tracker.report(file=out, max_items=100000)
    found: dict[str, float] = {}
    for size, unit, file in re.findall(r"([\d.]+) (B|KB|MB) : .* : ([\w.]+\.py):\d+ : ", out.getvalue()):
        found[file] = found.get(file, 0.0) + float(size) * UNITS[unit]
    return found


def imported() -> set[str]:
    return {name for name in sys.modules if name == "hem_weights" or name.startswith("tryon_solver.")}


def played(scene: Any, n: int, with_it: bool, frames: int, tracker: wp.ScopedMemoryTracker) -> dict[str, Any]:
    """A scene's run: what was imported before and during it, launched, and is allocated."""
    before = imported()
    LAUNCHED.clear()
    tracker.clear()
    sim, pose = scene.built(n, with_it)
    KEPT.append(sim)
    for k in range(frames):
        sim.advance(pose, (k + 1) * DT)
    return {"imported": imported() - before, "launched": set(LAUNCHED), "bytes": live_bytes(tracker)}


def milliseconds(scene: Any, n: int, frames: int) -> tuple[float, float, float]:
    """Medians of frames without and with the effect, in turn, and what one call of each of its stages takes."""
    sims = [scene.built(n, with_it) for with_it in (False, True)]
    times: list[list[float]] = [[], []]
    for k in range(frames):
        for (sim, pose), own in zip(sims, times):
            begun = time.perf_counter()
            sim.advance(pose, (k + 1) * DT)
            own.append(1e3 * (time.perf_counter() - begun))
    quiet = [np.median(own[frames // 4 :]) for own in times]
    from tryon_solver.stepping.clocked import contribution_times

    (bare, _), (full, _) = sims
    mine = {c.name for c in full.plan.contributions} - {c.name for c in bare.plan.contributions}
    calls = contribution_times(full)
    return float(quiet[0]), float(quiet[1]), sum(sum(calls[name].values()) for name in mine)


def costs(n: int, frames: int) -> list[dict[str, Any]]:
    """Of each effect: what only the scene with it imports, launches and allocates."""
    watch()
    found = []
    with wp.ScopedMemoryTracker("effects", print=False) as tracker:
        from effect_scenes import SCENES

        without = [played(scene, n, False, frames, tracker) for scene in SCENES]
        for scene, bare in zip(SCENES, without):
            cost = played(scene, n, True, frames, tracker)
            files = {file: size - bare["bytes"].get(file, 0.0) for file, size in cost["bytes"].items()}
            found.append(
                {
                    "name": scene.name,
                    "shows": scene.shows,
                    "own": sorted(scene.own),
                    "imported": sorted(cost["imported"]),
                    "imported_before": sorted(set(scene.own) & (imported() - cost["imported"])),
                    "launched": sorted(cost["launched"] - bare["launched"]),
                    "allocated_in": sorted(file for file in cost["bytes"] if file not in bare["bytes"]),
                    "bytes": sum(files.values()),
                }
            )
    return found


def table(found: list[dict[str, Any]], n: int, timed: dict[str, tuple[float, float, float]]) -> str:
    """In Markdown."""
    lines = [
        BEGIN,
        "",
        f"Squares of {n} by {n} vertices (the ball has 642), medians of frames of 1/60 s with and without the effect",
        f"in turn, at preset `live`, on one of {os.cpu_count()} cores ({platform.machine()}). Kernels are those that",
        "only the scene with the effect launches, its own or not; memory is what it allocates more. Where cloth moves",
        "otherwise with the effect, another number of iterations is in the ratio: below 1 it calms what it acts on.",
        "",
        "| effect | scene: cloth that | ms without | ms with | ratio | ms, a call of each stage | kernels | KiB |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for cost in found:
        bare, full, calls = timed[cost["name"]]
        kernels = ", ".join(k.rpartition(".")[2].removesuffix("_kernel") for k in cost["launched"]) or "-"
        figures = f"{bare:.1f} | {full:.1f} | {full / bare:.2f} | {calls:.3f}"
        lines.append(f"| {cost['name']} | {cost['shows']} | {figures} | {kernels} | {cost['bytes'] / 1024:.0f} |")
    return "\n".join([*lines, "", END])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vertices", type=int, default=9, help="to a side of the squares")
    parser.add_argument("--frames", type=int, default=3)
    parser.add_argument("--document", type=Path, help="a file whose table is written anew")
    asked = parser.parse_args()
    found = costs(asked.vertices, min(asked.frames, 3))
    if asked.document is None:
        print(json.dumps(found))
        return
    from effect_scenes import SCENES

    timed = {scene.name: milliseconds(scene, asked.vertices, asked.frames) for scene in SCENES}
    text = asked.document.read_text()
    head, _, rest = text.partition(BEGIN)
    asked.document.write_text(head + table(found, asked.vertices, timed) + rest.partition(END)[2])


if __name__ == "__main__":
    wp.config.quiet = True
    main()
