"""`python tests/accuracy`: the error of single steps against a float64 Newton IPC reference, and what they take.

A case is a garment in motion and a length of step. The reference takes the same steps, one after the other; from each
of its states the solver takes one at every preset, and with `--sweep` at `live` with one thing changed at a time.
Writes one JSON file per case, and a page; exits with 1 when a limit is broken. The reference's steps are kept in
.cache.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OURS = ("tests/accuracy/support", "tests/support", "solver/bench", "solver")
sys.path[:0] = [str(ROOT / folder) for folder in OURS]  # this checkout is judged, whatever is installed

from accuracy_case import AccuracyCase, presets, scenes, sweep  # noqa: E402
from accuracy_table import broken, markdown, plot  # noqa: E402
from process_pool import Tasks  # noqa: E402
from provenance import commit_of, machine_of  # noqa: E402

STEPS = (30, 60)  # 1/s: those of `draft` and of `live`


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns the exit status."""
    options = parsed(arguments)
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    if options.one:
        return one(AccuracyCase(**json.loads(options.one)), options.sweep, out)
    if options.document is None:
        commands = {
            case.name: [sys.executable, str(HERE), "--out", str(out), "--one", json.dumps(case.plain())]
            + ["--sweep"] * options.sweep
            for rate in options.rates
            for case in scenes(1 / rate, vertices=options.vertices, states=options.states)
            if not options.scenes or case.scene in options.scenes
        }
        Tasks(out, options.jobs).run(commands, told)
    page = options.document or out / "accuracy.md"
    results = {path.stem: json.loads(path.read_text()) for path in sorted(out.glob("*.json"))}
    folder = page.parent / page.stem
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "error_against_time.svg").write_text(plot(results))
    page.write_text(markdown(results) + f"\n![Error of a step against its time]({page.stem}/error_against_time.svg)\n")
    print(page.read_text())
    return 1 if broken(results) else 0


def parsed(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(prog="python tests/accuracy", description=__doc__.partition("\n")[0])
    add = parser.add_argument
    add("--scenes", nargs="+", help=f"these alone: {'; '.join(case.scene for case in scenes(1.0))}")
    add("--rates", nargs="+", type=int, default=list(STEPS), metavar="R", help="steps a second (30 60)")
    add("--states", type=int, default=50, metavar="N", help="of the reference in a case (50)")
    add("--vertices", type=int, default=600, metavar="N", help="of the garment's mesh, about (600)")
    add("--sweep", action="store_true", help="`live` with one thing changed at a time, too")
    add("--jobs", type=int, default=1, help="cases at once")
    add("--out", type=Path, default=ROOT / "build" / "accuracy")
    add("--document", type=Path, metavar="FILE", help="play nothing: the page of what --out holds, and a plot")
    add("--one", help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


def told(name: str, found: dict[str, Any]) -> None:
    """Tell of a case that has ended."""
    print(f"{name}: {found.get('failure', 'done')}", flush=True)


def one(case: AccuracyCase, swept: bool, out: Path) -> int:
    """Measure one case in this process and write its JSON file."""
    import warp as wp
    from one_step_errors import errors

    wp.config.quiet = True
    begun = time.monotonic()
    settings = {**presets(case.dt), **(sweep() if swept else {})}
    rows = errors(case, settings, lambda text: print(f"{time.monotonic() - begun:.0f} s: {text}", flush=True))
    about = {"commit": commit_of(ROOT), "machine": machine_of("cpu")}
    (out / f"{case.name}.json").write_text(json.dumps({"about": about, "case": case.plain(), "rows": rows}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
