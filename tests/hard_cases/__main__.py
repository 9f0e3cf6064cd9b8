"""`python tests/hard_cases`: every hard case, played and judged; 1 when a limit was broken.

Each case runs in a process of its own. Writes one JSON file and one log per case and a table, all in build/hard; says
which case broke which limit in which frame. `--list` names the cases. Needs what the tests need, the default body too.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SOURCES = ("tests/hard_cases", "tests/proof/support", "tests/support", "solver", "server", "protocol", "clients/python")
sys.path[:0] = [str(ROOT / folder) for folder in SOURCES]  # this checkout is judged, whatever is installed

from process_pool import Tasks  # noqa: E402
from provenance import commit_of, machine_of  # noqa: E402

RUN = "run.json"  # what a run leaves for the document
DRESSED = "dressed"  # what its cases leave for each other; none is left from a run before


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns the exit status."""
    options = parsed(arguments)
    if options.document:
        return write_document(options)
    if options.compare:
        return write_comparison(options)
    from harness.alike import held_to
    from harness.others import OURS, PEERS, TELLING
    from harness.table import holds, markdown, verdict_of
    from scenes import SCENES, named

    names = options.scenes or (TELLING if options.telling or options.solver != OURS else [])
    chosen = [scene for scene in SCENES if chosen_by(names, scene.name, scene.apart)]
    if options.list:
        asked = [scene for scene in SCENES if not names or scene in chosen]
        print("\n".join(f"{scene.name:40s} {scene.stresses}{' (only by name)' * scene.apart}" for scene in asked))
        return 0
    if not chosen:
        print(f"no case is called {' or '.join(options.scenes)}; --list names them all", file=sys.stderr)
        return 2
    if options.solver in PEERS and importlib.util.find_spec("newton") is None:
        print(f"--solver {options.solver} is Newton's, which is not installed: pip install '.[peers]'", file=sys.stderr)
        return 2
    options.out.mkdir(parents=True, exist_ok=True)
    if options.one:
        return one(named(options.one), options)
    shutil.rmtree(options.out / DRESSED, ignore_errors=True)
    begun = time.monotonic()
    done: list[str] = []

    def told(name: str, result: dict[str, Any]) -> None:
        done.append(name)
        said = [b["line"] for b in result.get("broken", ())]
        spent = time.monotonic() - begun
        place = f"[{len(done)}/{len(chosen)}, {spent:.0f} s]"
        print(f"{place} {name}: {'; '.join([verdict_of(result), *said])}", flush=True)

    longest_first = sorted(chosen, key=lambda scene: -scene.seconds * scene.rate)  # else all wait for the last one
    commands = {scene.name: command(scene.name, options) for scene in longest_first}
    found = Tasks(options.out, options.jobs, options.longest).run(commands, told)
    results = [{"name": s.name, "stresses": s.stresses, "broken": [], **found[s.name]} for s in chosen]
    held_to(results, {s.name: s.same_as for s in chosen if s.same_as})
    told_with = about(options, time.monotonic() - begun)
    (options.out / "table.md").write_text(markdown(results, told_with))
    made = options.preset if options.solver == OURS else options.solver
    name = f"{made}, {'GPU' if 'cuda' in options.device else 'CPU'}"
    run = {"name": name, "solver": options.solver, "about": told_with, "results": results}
    (options.out / RUN).write_text(json.dumps(run, indent=1))
    failing = [r["name"] for r in results if not holds(r)]
    print(f"{len(results) - len(failing)} of {len(results)} cases hold; {options.out / 'table.md'}")
    if failing:
        print(f"failing: {' '.join(failing)}")
    return 1 if failing else 0


def parsed(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(prog="python tests/hard_cases", description=__doc__.partition("\n")[0])
    add = parser.add_argument
    add("--scenes", nargs="+", default=[], metavar="NAME", help="cases, or beginnings of their names (all)")
    add("--list", action="store_true", help="name the cases and what each stresses, and run none")
    add("--seconds", type=float, metavar="S", help="simulated time of each case [s] (its own, mostly 5)")
    add("--vertices", type=int, metavar="N", help="about so many cloth vertices (each case's own, mostly 1,000)")
    add("--preset", default="live", choices=("draft", "live", "fit"), help="settings the cases start from (live)")
    add("--device", default="cpu", help="cpu, cuda:0, ... (cpu)")
    others = "by which solver: ours, or of the telling cases xpbd, chebyshev, or Newton's vbd or style3d (ours)"
    add("--solver", default="ours", choices=("ours", "xpbd", "chebyshev", "vbd", "style3d"), help=others)
    add("--telling", action="store_true", help="the ten cases that other solvers can be given, whichever solver it is")
    add("--frames", action="store_true", help="keep what is seen, too, for pictures: NAME.npz beside NAME.json")
    each = "IPC Toolkit is asked about each K-th frame (2), of cloth alone about all"
    add("--every", type=int, default=2, metavar="K", help=each)
    launches = "on a GPU: without graphs, so that every accepted move is judged, not only the carried ones"
    add("--by-launches", action="store_true", help=launches)
    add("--jobs", type=int, default=os.cpu_count() or 1, help="cases at once (as many as there are processors)")
    add("--longest", type=float, default=900.0, metavar="S", help="wall time after which a case has failed [s]")
    add("--out", type=Path, default=ROOT / "build" / "hard")
    add("--document", type=Path, metavar="FILE", help="play nothing; write what the --of folders hold, side by side")
    add("--compare", type=Path, metavar="FOLDER", help="play nothing; solvers of --of beside each other, drawn")
    add("--of", type=Path, nargs="+", default=[], metavar="PLACE", help="where earlier runs wrote to (--out)")
    add("--beside", type=Path, metavar="FILE", help="what --compare wrote (peers.json), as a part of --document")
    add("--one", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if bool(options.document) + bool(options.compare) != bool(options.of):
        parser.error("--of PLACE ... says what is in a page or a comparison: give it with --document or --compare")
    if options.beside and not options.document:
        parser.error("--beside FILE is a part of a page: give --document, too")
    return options


def write_document(options: argparse.Namespace) -> int:
    """Earlier runs beside each other in one page; 1 when a case failed in any of them."""
    from harness.comparison import section, way
    from harness.document import document
    from harness.table import holds

    runs = ended(options.of)
    if runs is None:
        return 2
    page, beside = options.document, options.beside
    others = section(json.loads(beside.read_text()), way(page, beside.parent)) if beside else []
    page.write_text(document(runs, others))
    return 0 if all(holds(r) for run in runs for r in run["results"]) else 1


def write_comparison(options: argparse.Namespace) -> int:
    """The telling cases of earlier runs by several solvers: a file of figures and pictures."""
    from harness.comparison import compare

    runs = ended(options.of)
    if runs is None:
        return 2
    by_solver = {run["solver"]: run for run in runs}
    compare(by_solver, dict(zip(by_solver, options.of)), options.compare)
    return 0


def ended(places: Sequence[Path]) -> list[dict[str, Any]] | None:
    """What the runs left in these folders or files; None, and said, where one has not ended."""
    files = [path / RUN if path.is_dir() else path for path in places]
    missing = [str(file) for file in files if not file.exists()]
    if missing:
        print(f"no run has ended: {', '.join(missing)} is not there", file=sys.stderr)
        return None
    return [json.loads(file.read_text()) for file in files]


def chosen_by(names: Sequence[str], name: str, apart: bool) -> bool:
    """Is the case meant by any of these names or beginnings of names? One apart only by all of its own."""
    return name in names if apart else not names or any(name.startswith(beginning) for beginning in names)


def command(name: str, options: argparse.Namespace) -> list[str]:
    """What runs one case in a process of its own."""
    words = [sys.executable, str(HERE), "--one", name, "--out", str(options.out), "--preset", options.preset]
    words += ["--device", options.device, "--every", str(options.every), "--solver", options.solver]
    words += ["--frames"] if options.frames else []
    words += ["--by-launches"] if options.by_launches else []
    for option in ("seconds", "vertices"):
        value = getattr(options, option)
        words += [] if value is None else [f"--{option}", str(value)]
    return words


def one(scene: Any, options: argparse.Namespace) -> int:
    """Run a case in this process and write its JSON file."""
    import ipctk
    import warp as wp
    from harness.one import run_one
    from harness.scene import Ask

    from tryon_solver.settings import PRESETS

    wp.config.quiet = True
    ipctk.set_num_threads(1)
    seconds = scene.seconds if options.seconds is None else options.seconds
    vertices = options.vertices or scene.vertices
    ask = Ask(vertices, PRESETS[options.preset], options.device, seconds, options.out / DRESSED)
    frames = options.out / f"{scene.name}.npz" if options.frames else None
    told = [lambda text: print(text, flush=True), options.solver, frames, options.by_launches]
    result = run_one(scene, ask, options.every, *told)
    (options.out / f"{scene.name}.json").write_text(json.dumps(result, indent=1))
    return 0


def about(options: argparse.Namespace, seconds: float) -> dict[str, str]:
    """What the table was made with."""
    return {
        "machine": machine_of(options.device),
        "commit": commit_of(ROOT),
        "settings": f"preset {options.preset}, "
        f"{'each case its own time' if options.seconds is None else f'{options.seconds:g} s a case'}, "
        f"{'each case its own size' if options.vertices is None else f'about {options.vertices} vertices a case'}"
        f"{', launch by launch' if options.by_launches else ''}",
        "IPC Toolkit": f"asked about every frame whose number {options.every} divides, the way to it, and the last; "
        "where there is nothing but cloth about all",
        "wall time": f"{seconds / 60:.1f} min, {options.jobs} at once",
    }


if __name__ == "__main__":
    sys.exit(main())
