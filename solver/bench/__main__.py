"""`python solver/bench`: how long a frame takes and where, with what was simulated and whether it was clean.

Every combination of the garments, motions, sizes, presets and numbers of sessions asked for, one after the other, each
session in a process of its own; `results.json` and `table.md` go to --out. `--peers` plays two scenes by our solver and
by others' in the same run, `--roofline` holds the dearest kernels to what the device can do, `--start` times processes
until their first frame. `--document FILE --of PLACE...` measures nothing and puts what earlier runs left side by side,
with plots. Times are wall times of `Simulation.advance` until the device is done, of the frames after a second that
leads into the motion. IPC Toolkit, one of the development's packages, judges between them.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any
from unittest import mock

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT / folder) for folder in ("solver/bench", "solver", "tests/support")]  # this checkout

import option_types as kinds  # noqa: E402
from bench_table import markdown, row  # noqa: E402
from figures import of_all  # noqa: E402
from peer_case import FPS, OTHERS, PEER_SCENES, PRESETS, PeerCase  # noqa: E402
from peer_table import row as peer_row  # noqa: E402
from process_pool import Tasks  # noqa: E402
from provenance import commit_of, machine_of  # noqa: E402
from roofline_table import section as roofs_told  # noqa: E402
from starting_table import row as start_row  # noqa: E402
from worn import JERSEY, Case  # noqa: E402

from tryon_solver.materials.fabric import FABRICS  # noqa: E402


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; 1 when a case failed or a frame was not clean."""
    options = parsed(arguments)
    if options.document:
        return write_document(options)
    options.out.mkdir(parents=True, exist_ok=True)
    if options.one:
        return one(options)
    run: dict[str, Any] = {"about": about(options), "results": [], "peers": [], "roofline": [], "starts": []}
    parts: list[tuple[str, Callable[[argparse.Namespace], Iterator[dict[str, Any]]]]] = [("results", worn_cases)]
    parts += [("peers", peer_cases)] if options.peers is not None else []
    parts += [("roofline", roofline_cases)] if options.roofline else []
    parts += [("starts", starting_cases)] if options.start else []
    for name, measure in parts:
        for result in measure(options):
            run[name].append(result)
            keep(run, options.out)  # after each, for a later one may be broken off
    keep(run, options.out)
    print(options.out / "table.md")
    return int(failing(run))


def keep(run: Mapping[str, Any], out: Path) -> None:
    """Write what was measured so far."""
    (out / "results.json").write_text(json.dumps(run, indent=1) + "\n")
    (out / "table.md").write_text(markdown(run))


def worn_cases(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Every combination that was asked for, measured and told."""
    for garment, motion, vertices, preset, sessions, accuracy, deadline in itertools.product(
        options.garments,
        options.motions,
        options.vertices,
        options.presets,
        options.sessions,
        options.accuracies or [None],
        options.deadlines or [None],
    ):
        alike = options.device, options.fps, sessions, options.fabric
        case = Case(garment, motion, vertices, preset, *alike, accuracy_mm=accuracy, deadline_ms=deadline)
        result = {"name": case.name, **measured_at_once(case, options)}
        print(row(result), flush=True)
        yield result


def peer_cases(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """The scenes by our presets and by the peers that were asked for, one after the other, measured and told."""
    solvers = [*options.presets, *(options.peers or OTHERS)]
    for scene, vertices, solver in itertools.product(options.scenes, options.vertices, solvers):
        case = PeerCase(scene, vertices, solver, options.device, options.seconds)
        missing = case.missing()
        command = ["--task", "peer", "--one", json.dumps(asdict(case)), "--every", str(options.every)]
        found = {"failure": missing} if missing else alone(case.name, command, options)
        result = {"name": case.name, **case.plain(), **found}
        print(peer_row(result), flush=True)
        yield result


def roofline_cases(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """The dearest kernels of each garment, motion, size and preset that was asked for."""
    for case in cases_alone(options):
        found = alone(f"{case.name}-roofline", ["--task", "roofline", "--one", json.dumps(case.plain())], options)
        result = {"name": case.name, **found}
        print("\n".join(roofs_told([result])), flush=True)
        yield result


def cases_alone(options: argparse.Namespace) -> Iterator[Case]:
    """Each garment, motion, size and preset that was asked for, a session by itself."""
    for chosen in itertools.product(options.garments, options.motions, options.vertices, options.presets):
        yield Case(*chosen, options.device, options.fps, fabric=options.fabric)


def starting_cases(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Each garment, motion, size and preset that was asked for, started without kernels in the cache, and then with."""
    for case in cases_alone(options):
        with tempfile.TemporaryDirectory() as cache:
            own = mock.patch.dict(os.environ, WARP_CACHE_PATH=cache, CUDA_CACHE_PATH=f"{cache}/driver")
            for kernels in ("compiled", "from the cache"):
                with own:
                    words = ["--task", "start", "--one", json.dumps(case.plain()), "--begun", str(time.time())]
                    found = alone(f"{case.name}-start", words, options)
                result = {"name": case.name, "kernels": kernels, **found}
                print(start_row(result), flush=True)
                yield result


def alone(name: str, words: Sequence[str], options: argparse.Namespace) -> dict[str, Any]:
    """What a process of that name writes, which runs alone."""
    command = [sys.executable, str(HERE), *words, "--name", name, "--out", str(options.out)]
    return Tasks(options.out, 1).run({name: command}, lambda _name, _result: None)[name]


def failing(run: Mapping[str, Any]) -> bool:
    """Did a case of ours fail, or was a frame of it not clean?"""
    ours = [*run["results"], *(r for r in run["peers"] if r["solver"] in PRESETS)]
    others = *run["roofline"], *run.get("starts", ())  # which older runs do not tell of
    return any("failure" in r or r["unclean"] for r in ours) or any("failure" in r for r in others)


def write_document(options: argparse.Namespace) -> int:
    """Earlier runs beside each other in one page; 1 when a case failed in any of them, 2 when one is not there."""
    import document

    try:
        runs = document.ended(options.of)
    except document.NoRunError as error:
        print(error, file=sys.stderr)
        return 2
    document.write(options.document, runs)
    return int(any(map(failing, runs)))


def measured_at_once(case: Case, options: argparse.Namespace) -> dict[str, Any]:
    """The figures of the case's sessions, each a process of its own."""
    more = ["--out", str(options.out), "--seconds", str(options.seconds), "--every", str(options.every)]
    more += ["--longest", str(options.longest)]
    with tempfile.TemporaryDirectory() as company:
        commands = {
            f"{case.name}.{k}": [
                *(sys.executable, str(HERE), "--one", json.dumps(case.plain()), "--name", f"{case.name}.{k}"),
                *("--number", str(k), "--company", company, *more),
            ]
            for k in range(case.sessions)
        }
        found = Tasks(options.out, case.sessions).run(commands, lambda _name, _result: None)
    return of_all(list(found.values()))


def one(options: argparse.Namespace) -> int:
    """Measure one of a case's sessions, one peer or one case's kernels in this process and write its JSON file."""
    import warp as wp

    wp.config.quiet = True
    asked = json.loads(options.one)
    if options.task == "peer":
        from peers import played

        found = played(PeerCase(**asked), options.every)
    elif options.task == "roofline":
        import roofline

        found = roofline.measured(Case(**asked))
    elif options.task == "start":
        import starting

        found = starting.measured(Case(**asked), options.begun)
    else:
        found = one_session(Case(**asked), options)
    (options.out / f"{options.name}.json").write_text(json.dumps(found))
    return 0


def one_session(case: Case, options: argparse.Namespace) -> dict[str, Any]:
    """Figures of a session, in company of the others."""
    from measure import measured
    from together import Company

    company = Company(options.company, case.sessions, options.number)
    with company.kept():
        return measured(case, options.seconds, options.every, options.longest, company)


def parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(prog="python solver/bench", description=__doc__.partition("\n")[0])
    add = parser.add_argument
    worn = "patterns of the demo; no name: none is worn (tshirt)"
    add("--garments", nargs="*", type=kinds.garment, default=["tshirt"], help=worn)
    add("--motions", nargs="+", type=kinds.motion, default=["walk"], help="motions of the demo, or BVH files (walk)")
    add("--vertices", nargs="+", type=kinds.count, default=[2500], metavar="N", help="of the cloth, about (2500)")
    add("--presets", nargs="+", default=["draft"], choices=PRESETS, help="(draft)")
    add("--sessions", nargs="+", type=kinds.count, default=[1], metavar="N", help="at once, a process each (1)")
    down = "estimated errors that frames are solved down to"
    add("--accuracies", nargs="*", type=kinds.finite, metavar="MM", help=down)
    add("--deadlines", nargs="*", type=kinds.finite, metavar="MS", help="wall time that each frame may take")
    add("--fabric", default=JERSEY, choices=FABRICS, help=f"meshes of over 90,000 need a thinner one ({JERSEY})")
    add("--device", type=kinds.device, default="cpu", help="cpu, cuda:0, ... (cpu)")
    add("--fps", type=kinds.finite, default=30.0, help="frames a simulated second (30)")
    add("--seconds", type=kinds.finite, default=3.0, metavar="S", help="time of the motion that is measured (3)")
    longest = "wall time after which a case is told of by the frames that it has (none)"
    add("--longest", type=kinds.above_zero, default=math.inf, metavar="S", help=longest)
    judged = "IPC Toolkit is asked about each K-th frame, 0: none (10)"
    add("--every", type=kinds.count_or_none, default=10, metavar="K", help=judged)
    others = "two scenes by our presets and by these others (all)"
    add("--peers", nargs="*", choices=OTHERS, metavar="SOLVER", help=f"{others}: {', '.join(OTHERS)}")
    add("--scenes", nargs="+", default=PEER_SCENES, choices=PEER_SCENES, help="of those (both)")
    add("--roofline", action="store_true", help="the dearest kernels against what the device can do at most, too")
    add("--start", action="store_true", help="from a process's start to its first frame, without and with a cache, too")
    add("--out", type=Path, default=ROOT / "build" / "bench")
    add("--document", type=Path, metavar="FILE", help="measure nothing; write what --of holds, with plots")
    add("--of", type=Path, nargs="+", default=[], metavar="PLACE", help="folders earlier runs wrote to, or their JSON")
    of_one = {"--one": str, "--task": str, "--name": str, "--number": int, "--company": Path, "--begun": float}
    for name, kind in of_one.items():
        add(name, type=kind, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if bool(options.document) != bool(options.of):
        parser.error("--document FILE is made --of PLACE ...: give both")
    if round(options.seconds * options.fps) < 1:
        parser.error(f"--seconds {options.seconds:g} at --fps {options.fps:g} is less than a frame: measure longer")
    return options


def about(options: argparse.Namespace) -> dict[str, str]:
    """What the table was made with."""
    ended = f", or as much of it as comes in {options.longest:g} s" if math.isfinite(options.longest) else ""
    ended += f"; each {options.every}. is judged" if options.every else ""
    ended += f"; {FPS:g} a second in the scenes of other solvers" if options.peers is not None else ""
    return {
        "machine": machine_of(options.device),
        "commit": commit_of(ROOT),
        "frames": f"{options.fps:g} a second, {options.seconds:g} s of the motion, which repeats{ended}",
    }


if __name__ == "__main__":
    sys.exit(main())
