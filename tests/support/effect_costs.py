"""What each effect costs: `python effect_costs.py [--vertices 33 --frames 60 --device cuda:0 --out FILE]`.

In one process, which has to be new: first all scenes without their effect, then, one after the other, with it. What is
imported, launched and allocated then and was not before is the effect's. Prints one JSON object; with --out frames are
timed, with and without in turn, and the file has all of it. `--document docs/effects.md --of FILE ...` measures nothing
and writes the tables of such files into that page anew.
"""

from __future__ import annotations

import argparse
import io
import json
import re
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "examples"))

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


def played(
    scene: Any, n: int, with_it: bool, frames: int, tracker: wp.ScopedMemoryTracker, device: str
) -> dict[str, Any]:
    """A scene's run: what was imported before and during it, launched, and is allocated."""
    before = imported()
    LAUNCHED.clear()
    tracker.clear()
    sim, pose = scene.built(n, with_it, device)
    KEPT.append(sim)
    for k in range(frames):
        sim.advance(pose, (k + 1) * DT)
    return {"imported": imported() - before, "launched": set(LAUNCHED), "bytes": live_bytes(tracker)}


def milliseconds(scene: Any, n: int, frames: int, device: str) -> tuple[float, float, float]:
    """Medians of frames without and with the effect, in turn, and what one call of each of its stages takes."""
    sims = [scene.built(n, with_it, device) for with_it in (False, True)]
    times: list[list[float]] = [[], []]
    for k in range(frames):
        for (sim, pose), own in zip(sims, times):
            begun = time.perf_counter()
            sim.advance(pose, (k + 1) * DT)
            wp.synchronize_device(device)
            own.append(1e3 * (time.perf_counter() - begun))
    quiet = [np.median(own[frames // 4 :]) for own in times]
    from tryon_solver.stepping.clocked import contribution_times

    (bare, _), (full, _) = sims
    mine = {c.name for c in full.plan.contributions} - {c.name for c in bare.plan.contributions}
    calls = contribution_times(full)
    return float(quiet[0]), float(quiet[1]), sum(sum(calls[name].values()) for name in mine)


def costs(n: int, frames: int, device: str) -> list[dict[str, Any]]:
    """Of each effect: what only the scene with it imports, launches and allocates."""
    watch()
    found = []
    with wp.ScopedMemoryTracker("effects", print=False) as tracker:
        from effect_scenes import SCENES

        without = [played(scene, n, False, frames, tracker, device) for scene in SCENES]
        for scene, bare in zip(SCENES, without):
            cost = played(scene, n, True, frames, tracker, device)
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


def measured(n: int, frames: int, device: str) -> dict[str, Any]:
    """All of it, with the times of frames and where they were measured."""
    found = costs(n, min(frames, 3), device)
    from effect_scenes import SCENES
    from provenance import commit_of, machine_of

    for cost, scene in zip(found, SCENES):
        cost["ms"] = milliseconds(scene, n, frames, device)
    about = {"commit": commit_of(ROOT), "machine": machine_of(device), "vertices": n, "frames": frames}
    return {"about": about, "effects": found}


def tables(runs: list[dict[str, Any]]) -> str:
    """In Markdown."""
    lines = [
        BEGIN,
        "",
        "Medians of frames of 1/60 s with and without the effect in turn, at preset `live`. Kernels are those that",
        "only the scene with the effect launches, its own or not; memory is what it allocates more. Where cloth moves",
        "otherwise with the effect, another number of iterations is in the ratio: below 1 it calms what it acts on.",
    ]
    for run in runs:
        about = run["about"]
        lines += [
            "",
            f"On {about['machine']}, commit {about['commit']};",
            f"squares of {about['vertices']} by {about['vertices']} vertices, a ball of 642, {about['frames']} frames:",
            "",
            "| effect | scene: cloth that | ms without | ms with | ratio | ms, a call of each stage | kernels | KiB |",
            "|---|---|---|---|---|---|---|---|",
        ]
        for cost in run["effects"]:
            bare, full, calls = cost["ms"]
            kernels = ", ".join(k.rpartition(".")[2].removesuffix("_kernel") for k in cost["launched"]) or "-"
            figures = f"{bare:.1f} | {full:.1f} | {full / bare:.2f} | {calls:.3f}"
            lines.append(f"| {cost['name']} | {cost['shows']} | {figures} | {kernels} | {cost['bytes'] / 1024:.0f} |")
    return "\n".join([*lines, "", END])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vertices", type=int, default=9, help="to a side of the squares")
    parser.add_argument("--frames", type=int, default=3)
    parser.add_argument("--device", default="cpu", help="cpu, cuda:0, ...")
    parser.add_argument("--out", type=Path, help="a JSON file, of times as well")
    parser.add_argument("--document", type=Path, help="a page whose tables are written anew, of the files --of")
    parser.add_argument("--of", type=Path, nargs="+", default=[])
    asked = parser.parse_args()
    if asked.document is not None:
        runs = [json.loads(path.read_text()) for path in asked.of]
        head, _, rest = asked.document.read_text().partition(BEGIN)
        asked.document.write_text(head + tables(runs) + rest.partition(END)[2])
    elif asked.out is None:
        print(json.dumps(costs(asked.vertices, asked.frames, asked.device)))
    else:
        asked.out.write_text(json.dumps(measured(asked.vertices, asked.frames, asked.device), indent=1))


if __name__ == "__main__":
    wp.config.quiet = True
    main()
