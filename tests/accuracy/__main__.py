"""`python tests/accuracy`: what accuracy costs in time, measured, and the page that is made of it.

Three measurements, each a command of its own. Errors of single steps from the states of a float64 Newton IPC
reference: at every preset, with `--sweep` at `live` with one thing changed at a time, and of other solvers. Times of
steps at a garment's scale (`--times`). Measures that a tailor knows, by mesh, step and contact sizes (`--tailor`).

Each family of settings of each case is a process of its own and writes a file of lines (support/recorded.py): a run
that is cut off goes on where it was when it is started again. The reference's steps are kept in .cache. Exits with 1
when what is promised does not hold.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OURS = (
    "tests/accuracy/support",
    "tests/precision",
    "tests/hard_cases",
    "tests/proof/support",
    "tests/support",
    "solver/bench",
    "solver",
)
sys.path[:0] = [str(ROOT / folder) for folder in OURS]  # this checkout is judged, whatever is installed

from accuracy_case import AccuracyCase, scenes  # noqa: E402
from families import FAMILIES, FREE_RUNNING, ON_DEVICE, SWEPT  # noqa: E402
from process_pool import Tasks  # noqa: E402
from provenance import commit_of, machine_of  # noqa: E402

STEPS = (30, 60)  # 1/s: those of `draft` and of `live`
PLAIN = ("presets", "trajectory", "baselines", "inertia")
FIRST_OF_ALL = "presets"  # the family that the reference is made with; the others look its steps up


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns the exit status."""
    options = parsed(arguments)
    options.out = options.out.resolve()
    if options.one:
        return one(options)
    if options.document is None:
        (options.out / "tasks").mkdir(parents=True, exist_ok=True)
        for stage in stages(options):
            Tasks(options.out / "tasks", options.jobs).run(stage, told)
    from accuracy_page import write_page

    return write_page(options.document or options.out / "accuracy.md", options.out)


def parsed(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(prog="python tests/accuracy", description=__doc__.partition("\n")[0])
    add = parser.add_argument
    add("--scenes", nargs="+", help=f"these alone: {'; '.join(case.scene for case in scenes(1.0))}")
    add("--rates", nargs="+", type=int, default=list(STEPS), metavar="R", help="steps a second (30 60)")
    add("--states", type=int, default=50, metavar="N", help="of the reference in a case (50), or timed steps")
    add("--every", type=int, default=5, metavar="N", help="families but the presets take each N-th state (5)")
    add("--until", type=int, metavar="N", help="leave states after the N-th to another run: the reference takes long")
    add("--vertices", type=int, default=600, metavar="N", help="of the garment's mesh, about (600)")
    add("--device", default="cpu", help="of our solver's steps; the reference is on the CPU (cpu)")
    add("--sweep", action="store_true", help="`live` with one thing changed at a time, too")
    add("--peers", action="store_true", help="NVIDIA's Newton, too: pip install '.[peers]'")
    add("--families", nargs="+", choices=list(FAMILIES), help="these and no other")
    add("--times", action="store_true", help="times of steps, and no errors")
    add("--tailor", nargs="*", metavar="NAME", help="drape, bending length, hem, wrinkles: those named so, or all")
    add("--jobs", type=int, default=1, help="processes at once")
    add("--out", type=Path, default=ROOT / "build" / "accuracy")
    add("--document", type=Path, metavar="FILE", help="measure nothing: the page of what --out holds, with its plots")
    add("--one", help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


def stages(options: argparse.Namespace) -> Iterable[dict[str, list[str]]]:
    """Commands by name, in groups of which each waits for the one before."""
    if options.tailor is not None:
        from discretisation import MEASUREMENTS

        wanted = [n for n in MEASUREMENTS if not options.tailor or any(word in n for word in options.tailor)]
        yield {name: command(options, {"tailor": name}) for name in wanted}
        return
    families = chosen_families(options)
    cases = [
        case
        for rate in options.rates
        for case in scenes(1 / rate, vertices=options.vertices, states=options.states)
        if not options.scenes or case.scene in options.scenes
    ]
    if options.times:
        asked = {"times": [f for f in families if f not in (*FREE_RUNNING, "precision")]}
        yield {f"{case.name}-times": command(options, {**asked, "case": case.plain()}) for case in cases}
        return
    for group in ([f for f in families if f == FIRST_OF_ALL], [f for f in families if f != FIRST_OF_ALL]):
        yield {
            f"{case.name}-{family}": command(options, {"family": family, "case": case.plain()})
            for family in group
            for case in cases
        }


def chosen_families(options: argparse.Namespace) -> list[str]:
    """By name; on a GPU those that run there."""
    if options.families:
        return list(options.families)
    asked = [*PLAIN, *(SWEPT if options.sweep else ()), *(("peers",) if options.peers else ())]
    return asked if options.device == "cpu" else [family for family in asked if family in ON_DEVICE]


def command(options: argparse.Namespace, what: dict[str, Any]) -> list[str]:
    """To measure one thing in a process of its own."""
    same = ["--out", str(options.out), "--device", options.device, "--every", str(options.every)]
    same += [] if options.until is None else ["--until", str(options.until)]
    return [sys.executable, str(HERE), *same, "--one", json.dumps(what)]


def told(name: str, found: dict[str, Any]) -> None:
    """Tell of a process that has ended."""
    print(f"{name}: {found.get('failure', 'done')}", flush=True)


def one(options: argparse.Namespace) -> int:
    """Measure one thing in this process, and write its file of lines."""
    import warp as wp
    from one_step_errors import measure_errors, measure_trajectories
    from recorded import Writer
    from step_times import measure_times

    wp.config.quiet = True
    begun, what, device = time.monotonic(), json.loads(options.one), options.device
    about = {"commit": commit_of(ROOT), "machine": machine_of(device)}

    def tell(text: str) -> None:
        print(f"{time.monotonic() - begun:.0f} s: {text}", flush=True)

    if "tailor" in what:
        from discretisation import MEASUREMENTS

        writer = Writer(options.out / f"tailor-{what['tailor']}.jsonl", {"about": about, "tailor": what["tailor"]})
        if not writer.rows:
            writer.add([MEASUREMENTS[what["tailor"]]()])
        return done(options, what["tailor"])
    case = AccuracyCase(**what["case"])
    family = what.get("family", "times")
    methods = {n: m for f in what.get("times", [family]) for n, m in FAMILIES[f](case).items()}
    head = {
        "about": about,
        "case": case.plain(),
        "family": family,
        "device": device,
        "methods": {name: method.plain() for name, method in methods.items()},
    }
    writer = Writer(options.out / f"{case.name}-{family}-{device.replace(':', '')}.jsonl", head)
    if family == "times":
        measure_times(case, methods, device, writer, tell)
    elif family in FREE_RUNNING:
        measure_trajectories(case, methods, device, writer, tell)
    else:
        first = family == FIRST_OF_ALL
        measure_errors(case, methods, device, writer, tell, 1 if first else options.every, first, options.until)
    return done(options, f"{case.name}-{family}")


def done(options: argparse.Namespace, name: str) -> int:
    """Say so to the process that waits."""
    folder = options.out / "tasks"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.json").write_text("{}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
