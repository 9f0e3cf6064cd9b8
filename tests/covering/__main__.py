"""`python tests/covering`: all effects together, in scenes in which any two of their variants that may meet do meet.

The scenes are the rows of a pairwise covering array (support/effect_factors.py): small cloths and coarse garments on
bodies that stand and move, 3 s each. IPC Toolkit judges every frame for what crosses; a position that is no number, a
vertex that is too fast, a triangle that is torn and a step that raises are told with their frame. A line of
`scenes.jsonl` is written for each scene as it ends: what was cut off goes on where it was. Exits with 1 when something
does not hold, naming the scene and the frame.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OURS = ("tests/covering/support", "tests/support", "solver")
sys.path[:0] = [str(ROOT / folder) for folder in OURS]  # this checkout is judged, whatever is installed

from covering_page import page  # noqa: E402
from effect_factors import rows  # noqa: E402
from process_pool import Tasks  # noqa: E402
from provenance import commit_of, machine_of  # noqa: E402

SECONDS = 3.0


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns the exit status."""
    options = parsed(arguments)
    if options.document is not None:
        return document(options.document, options.of)
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    if options.one is not None:
        return one(options.one, options, out)
    asked = [k for k in range(len(rows())) if not options.scenes or k in options.scenes]
    kept = out / "scenes.jsonl"
    done = {result["scene"] for result in read(kept) if is_of(result, options)}
    commands = {
        f"scene-{k:02d}": [sys.executable, str(HERE), *same(options, out), "--one", str(k)]
        for k in asked
        if k not in done
    }

    def told(name: str, result: dict[str, Any]) -> None:
        """Keep the result of a scene that has ended, and tell of it."""
        if "failure" in result:  # its process has ended early: it is played again next time
            print(f"{name}: {result['failure']}", flush=True)
            failed.append(name)
            return
        with kept.open("a") as lines:
            lines.write(json.dumps(result) + "\n")
        print(f"{name}: {'; '.join(result['broken'][:3]) or 'holds'}", flush=True)

    failed: list[str] = []
    Tasks(out, options.jobs, options.longest).run(commands, told)
    results = [result for result in read(kept) if is_of(result, options)]
    text = page({options.device: results})
    (out / "table.md").write_text(text)
    print(text)
    return 1 if failed or any(result["broken"] for result in results) else 0


def parsed(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(prog="python tests/covering", description=__doc__.partition("\n")[0])
    add = parser.add_argument
    add("--scenes", nargs="+", type=int, default=[], metavar="K", help="these alone, by their number from 0")
    add("--seconds", type=float, default=SECONDS, metavar="S", help=f"of each scene ({SECONDS:g})")
    add("--device", default="cpu", help="cpu, cuda:0, ...")
    add("--jobs", type=int, default=1, help="scenes at once, each in a process of one thread")
    add("--longest", type=float, default=3600.0, metavar="S", help="a scene that takes longer has failed (3600)")
    add("--out", type=Path, default=ROOT / "build" / "effects")
    add("--document", type=Path, metavar="FILE", help="play nothing: the page of the runs --of")
    add("--of", nargs="+", type=Path, default=[], metavar="FILE", help="scenes.jsonl of runs, for --document")
    add("--one", type=int, help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


def same(options: argparse.Namespace, out: Path) -> list[str]:
    """What a scene's own process is told."""
    return ["--out", str(out), "--device", options.device, "--seconds", str(options.seconds)]


def one(k: int, options: argparse.Namespace, out: Path) -> int:
    """Play a scene in this process and write its JSON file."""
    import ipctk
    import warp as wp
    from covered_run import play

    wp.config.quiet = True
    ipctk.set_num_threads(1)
    row = rows()[k]
    about = {"commit": commit_of(ROOT), "machine": machine_of(options.device)}
    result = {"scene": k, "row": row, **play(row, options.seconds, options.device), "about": about}
    (out / f"scene-{k:02d}.json").write_text(json.dumps(result))
    return 0


def read(path: Path) -> list[dict[str, Any]]:
    """The results in a file; a last line that was cut off is left out."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().split("\n")[:-1]]


def is_of(result: dict[str, Any], options: argparse.Namespace) -> bool:
    """Is it a scene of the array as it is now, played as it is asked for?"""
    array, k = rows(), result["scene"]
    machine = result["about"]["machine"]
    return (
        k < len(array)
        and result["row"] == array[k]
        and result["seconds"] == options.seconds
        and f"device {options.device}" in machine
    )


def document(path: Path, runs: list[Path]) -> int:
    """Write the page of runs."""
    results = {run.stem: sorted(read(run), key=lambda result: int(result["scene"])) for run in runs}
    path.write_text(page(results))
    return 1 if any(result["broken"] for run in results.values() for result in run) else 0


if __name__ == "__main__":
    sys.exit(main())
