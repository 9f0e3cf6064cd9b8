"""`python tests/proof`: the demo's garments in its motions, each published frame decoded and judged.

Runs every combination of the garments, motions, presets, edge lengths and devices asked for, each in a process of its
own, and writes one JSON file per case and a table. Exits with 1 when a limit was broken or a case failed, naming the
case, the frame and the limit. Needs warp, numpy, scipy, trimesh, ipctk, fast-simplification, msgpack, msgspec and
zstandard, and the default body; no server is started.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
for folder in ("solver", "server", "protocol", "clients/python", "tests/support", "tests/proof/support"):
    sys.path.insert(0, str(ROOT / folder))

from case import GARMENTS, MOTIONS, Case  # noqa: E402
from table import markdown, name_of  # noqa: E402


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns the exit status."""
    options = parsed(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    if options.one:
        return one(Case.from_plain(json.loads(options.one)), options.out, options.keep)
    cases = [
        Case(
            garment,
            motion,
            options.fabric,
            preset,
            device,
            edge,
            options.fps,
            options.lead,
            options.seconds,
            options.standing,
            options.every,
            tuple(options.set),
        )
        for garment, motion, preset, edge, device in itertools.product(
            options.garments, options.motions, options.presets, options.edges, options.devices
        )
    ]
    begun = time.monotonic()
    results = run_all(cases, options)
    text = markdown(results, about(options, time.monotonic() - begun))
    (options.out / "table.md").write_text(text)
    print(text)
    failed = [r for r in results if r.get("failure") or r.get("broken")]
    print(f"{len(results) - len(failed)} of {len(results)} cases kept every limit; {options.out / 'table.md'}")
    return 1 if failed else 0


def parsed(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(prog="python tests/proof", description=__doc__.partition("\n")[0])
    add = parser.add_argument
    add("--garments", nargs="+", default=list(GARMENTS), help="patterns of the demo, or files")
    add("--motions", nargs="+", default=list(MOTIONS), help="motions of the demo, or BVH files")
    add("--presets", nargs="+", default=["live"])
    add("--edges", nargs="+", type=float, default=[0.018], metavar="M", help="edge lengths [m]")
    add("--devices", nargs="+", default=["cpu"], help="cpu, cuda:0, ...")
    add("--fabric", default="cotton_jersey")
    add("--fps", type=float, default=60.0)
    add("--lead", type=float, default=1.0, metavar="S", help="time in which the body is led into the motion [s]")
    add("--seconds", type=float, default=4.0, metavar="S", help="time of the motion, which repeats [s]")
    add("--standing", type=float, default=2.0, metavar="S", help="time for which the body then stands still [s]")
    add("--every", type=int, default=2, metavar="K", help="IPC Toolkit is asked every K frames")
    add("--set", nargs="*", type=setting, default=[], metavar="NAME=VALUE", help="solver settings unlike the preset's")
    add("--jobs", type=int, default=max(1, (os.cpu_count() or 2) - 1), help="cases at once")
    add("--out", type=Path, default=ROOT / "build" / "proof")
    add("--keep", action="store_true", help="also write the decoded frames of each case (.npz)")
    add("--one", help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


def setting(text: str) -> tuple[str, float | int | str]:
    """NAME=VALUE, the value a number where it is one."""
    name, _, value = text.partition("=")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value


def one(case: Case, out: Path, keep: bool) -> int:
    """Run a case in this process and write its JSON file."""
    import ipctk
    import warp as wp
    from run_case import run_case

    wp.config.quiet = True
    ipctk.set_num_threads(1)
    result = run_case(case, lambda text: print(text, flush=True), out / f"{case.name}.npz" if keep else None)
    (out / f"{case.name}.json").write_text(json.dumps(result, indent=1))
    return 0


def run_all(cases: list[Case], options: argparse.Namespace) -> list[dict[str, Any]]:
    """All cases, `jobs` at once; their results in the order of the cases."""
    waiting, running, results = list(cases), {}, {}
    while waiting or running:
        while waiting and len(running) < options.jobs:
            case = waiting.pop(0)
            running[start(case, options)] = case
        time.sleep(0.2)
        for process in [p for p in running if p.poll() is not None]:
            case = running.pop(process)
            result = results[case] = outcome(case, process.returncode, options.out)
            said = [b["line"] for b in result.get("broken", ())] + [result["failure"]] * bool(result["failure"])
            print(f"{name_of(result)}: {'; '.join(said) or 'kept every limit'}", flush=True)
    return [results[case] for case in cases]


def start(case: Case, options: argparse.Namespace) -> subprocess.Popen[bytes]:
    """A case in a process of its own with one thread, what it prints in a .log beside its JSON file."""
    (options.out / f"{case.name}.json").unlink(missing_ok=True)
    command = [sys.executable, str(HERE), "--one", json.dumps(case.plain()), "--out", str(options.out)]
    with (options.out / f"{case.name}.log").open("wb") as log:
        return subprocess.Popen(
            [*command, "--keep"] if options.keep else command,
            stdout=log,
            stderr=subprocess.STDOUT,
            env={"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", **os.environ},
        )


def outcome(case: Case, status: int, out: Path) -> dict[str, Any]:
    """What a finished process wrote; a failure with its last words when it wrote nothing."""
    written = out / f"{case.name}.json"
    if status == 0 and written.exists():
        return json.loads(written.read_text())
    log = (out / f"{case.name}.log").read_text(errors="replace").strip().splitlines()
    return {"case": case.plain(), "failure": log[-1] if log else f"exit status {status}"}


def about(options: argparse.Namespace, seconds: float) -> dict[str, Any]:
    """What the table was made with."""
    from tryon_server.runtime.devices import list_devices

    def git(*words: str) -> str:
        answer = subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=False)
        return answer.stdout.strip()

    changed = " with changes" if git("status", "--porcelain", "--untracked-files=no") else ""
    return {
        "machine": "; ".join(device.description for device in list_devices()),
        "commit": (git("rev-parse", "--short=12", "HEAD") or "unknown") + changed,
        "settings": f"fabric {options.fabric}, edges {', '.join(f'{1e3 * e:g} mm' for e in options.edges)}, "
        f"{options.fps:g} fps, {options.lead:g} s lead-in, {options.seconds:g} s of motion, {options.standing:g} s "
        f"standing" + "".join(f", {name} {value}" for name, value in options.set),
        "intersections": f"asked of IPC Toolkit in every frame that {options.every} divides"
        if options.every > 1
        else "asked of IPC Toolkit in every frame",
        "wall time": f"{seconds / 60:.1f} min, {options.jobs} cases at once",
    }


if __name__ == "__main__":
    sys.exit(main())
