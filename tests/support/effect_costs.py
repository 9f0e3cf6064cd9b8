"""What each effect costs: `python effect_costs.py [--vertices 33 --frames 60 --device cuda:0 --jobs 8 --out FILE]`.

In one process, which has to be new: first all scenes without their effect, then, one after the other, with it. What is
imported, launched and allocated then and was not before is the effect's. Prints one JSON object; with --out frames are
timed, too, with and without in turn, each scene in a process of its own on a core of its own, --jobs at once, and the
file has all of it. `--document docs/effects.md --of FILE ...` measures nothing and writes the tables of such files into
that page anew.
"""

from __future__ import annotations

import argparse
import fcntl
import io
import json
import os
import re
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import IO, Any

import numpy as np
import warp as wp

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "examples"))

LAUNCHED: set[str] = set()
KEPT: list[object] = []  # simulations: where one was freed another's launch could look like one that is known
DT = 1 / 60
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


def timed(scene: Any, n: int, frames: int, device: str) -> dict[str, Any]:
    """Without and with the effect, frames in turn: medians of their `ms`, means of their Newton `iterations`; what one
    call of each of its stages takes, `calls`."""
    sims = [scene.built(n, with_it, device) for with_it in (False, True)]
    times: list[list[float]] = [[], []]
    iterations: list[list[int]] = [[], []]
    for k in range(frames):
        for (sim, pose), own, newton in zip(sims, times, iterations):
            begun = time.perf_counter()
            report = sim.advance(pose, (k + 1) * DT)
            wp.synchronize_device(device)
            own.append(1e3 * (time.perf_counter() - begun))
            newton.append(report.newton_iterations)
    from tryon_solver.stepping.clocked import contribution_times

    (bare, _), (full, _) = sims
    mine = {c.name for c in full.plan.contributions} - {c.name for c in bare.plan.contributions}
    taken = contribution_times(full)
    return {
        "ms": [float(np.median(own[frames // 4 :])) for own in times],
        "iterations": [float(np.mean(newton[frames // 4 :])) for newton in iterations],
        "calls": {stage: ms for name in sorted(mine) for stage, ms in taken[name].items()},
    }


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


def measured(asked: argparse.Namespace) -> dict[str, Any]:
    """All of it, with the times of frames and where they were measured."""
    n, frames, device = asked.vertices, asked.frames, asked.device
    found = costs(n, min(frames, 3), device)
    from effect_scenes import SCENES
    from process_pool import Tasks
    from provenance import commit_of, machine_of

    same = ["--vertices", str(n), "--frames", str(frames), "--device", device, "--jobs", str(asked.jobs)]
    with TemporaryDirectory() as folder:
        own = [sys.executable, __file__, *same, "--out"]
        commands = {f"effect-{k}": [*own, f"{folder}/effect-{k}.json", "--one", str(k)] for k in range(len(SCENES))}
        times = Tasks(Path(folder), asked.jobs).run(commands, lambda name, _: print(name, flush=True))
    for cost, (name, its) in zip(found, times.items()):
        if "failure" in its:
            raise RuntimeError(f"{name}, {cost['name']}: {its['failure']}")
        cost.update(its)
    about = {"commit": commit_of(ROOT), "machine": machine_of(device)}
    return {"about": {**about, "vertices": n, "frames": frames, "jobs": asked.jobs}, "effects": found}


def on_a_core_of_its_own(jobs: int) -> IO[bytes]:
    """Keep this process to a core that none of the others has; who holds the file that is returned has it."""
    for core in sorted(os.sched_getaffinity(0))[:jobs]:
        lock = (Path(gettempdir()) / f"effect-costs-core-{core}").open("wb")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.close()
            continue
        os.sched_setaffinity(0, {core})
        return lock
    raise RuntimeError(f"--jobs {jobs}: there are not as many cores that nobody measures on; ask for fewer")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vertices", type=int, default=9, help="to a side of the squares")
    parser.add_argument("--frames", type=int, default=3)
    parser.add_argument("--device", default="cpu", help="cpu, cuda:0, ...")
    parser.add_argument("--jobs", type=int, default=1, help="scenes timed at once, each on a core of its own")
    parser.add_argument("--out", type=Path, help="a JSON file, of times as well")
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--document", type=Path, help="a page whose tables are written anew, of the files --of")
    parser.add_argument("--of", type=Path, nargs="+", default=[])
    asked = parser.parse_args()
    if asked.document is not None:
        from effect_cost_tables import write

        write(asked.document, [json.loads(path.read_text()) for path in asked.of])
    elif asked.one is not None:
        from effect_scenes import SCENES

        with on_a_core_of_its_own(asked.jobs):
            asked.out.write_text(json.dumps(timed(SCENES[asked.one], asked.vertices, asked.frames, asked.device)))
    elif asked.out is None:
        print(json.dumps(costs(asked.vertices, asked.frames, asked.device)))
    else:
        asked.out.write_text(json.dumps(measured(asked), indent=1))


if __name__ == "__main__":
    wp.config.quiet = True
    main()
