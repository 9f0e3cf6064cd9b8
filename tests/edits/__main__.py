"""`python tests/edits`: worn garments edited hundreds of times while the body moves, each published frame judged.

A case is a garment in a motion and a seed: its session's worker is asked for one change of the pattern after the other,
its frames are decoded as by a client, and IPC Toolkit is asked about the first five after each change and every tenth
otherwise. Then all is taken back and compared with a garment that was never edited. Writes one JSON file per case and a
table; exits with 1 when a limit was broken or a case failed, naming the case, the change and the frame.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OURS = [
    str(ROOT / folder)
    for folder in (
        "tests/edits/support",
        "tests/support",
        "solver/bench",
        "solver",
        "server",
        "protocol",
        "clients/python",
    )
]
sys.path[:0] = OURS  # this checkout is judged, whatever is installed

from edit_case import GARMENTS, MIXED, EditCase, whole_proof  # noqa: E402
from edit_table import broken, markdown  # noqa: E402
from process_pool import Tasks  # noqa: E402
from provenance import commit_of, machine_of  # noqa: E402

from tryon_solver.redesign.edits import KINDS  # noqa: E402


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns the exit status."""
    options = parsed(arguments)
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    if options.one:
        return one(EditCase(**json.loads(options.one)), out)
    if options.rebuild:
        return rebuild(options, out)
    if options.drag:
        return drag(options, out)
    if options.levels:
        return levels(options, out)
    if options.document is not None:
        return document(options.document, out)
    commands = {
        case.name: [sys.executable, str(HERE), "--out", str(out), "--one", json.dumps(case.plain())]
        for case in cases(options)
    }
    results = Tasks(out, options.jobs).run(commands, told)
    (out / "results.json").write_text(json.dumps(results, indent=1))
    text = markdown(results)
    (out / "table.md").write_text(text)
    print(text)
    failed = [name for name, result in results.items() if broken(result)]
    print(f"{len(results) - len(failed)} of {len(results)} cases hold; {out / 'table.md'}")
    return 1 if failed else 0


def parsed(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(prog="python tests/edits", description=__doc__.partition("\n")[0])
    add = parser.add_argument
    add("--garments", nargs="+", help=f"these alone, of {', '.join(GARMENTS)}; without it the whole proof is played")
    add("--kinds", nargs="+", default=[MIXED], help=f"of edits: {MIXED}, {', '.join(KINDS)}")
    add("--motions", nargs="+", default=["walk"], help="of the demo")
    add("--edits", type=int, default=500, metavar="N", help="that are made in a case (500)")
    add("--each", type=int, default=50, metavar="N", help="the same of the whole proof's other cases (50)")
    add("--size", type=float, default=1.0, help="of the garment, over its own")
    add("--at-once", action="store_true", help="the first edit is asked for before the garment is dressed")
    add("--vertices", type=int, default=2500, metavar="N", help="of the garment's mesh, about")
    add("--fabric", default="cotton_jersey")
    add("--preset", default="draft", help="draft, live, fit")
    add("--device", default="cpu", help="cpu, cuda:0, ...")
    add("--seed", type=int, default=1)
    add("--deterministic", action="store_true", help="runs repeat bit for bit on a GPU, too")
    add("--minutes", type=float, default=0.0, metavar="M", help="after which no edit is begun any more (all are made)")
    add("--rebuild", nargs="*", type=int, metavar="N", help="only time rebuilds of meshes with so many vertices")
    add(
        "--drag",
        nargs="+",
        type=int,
        metavar="N",
        help="only drag a hem of meshes with so many vertices, by 60 edits/s",
    )
    add("--levels", type=int, metavar="N", help="only the memory of a session in which so many edits are made")
    add("--seconds", type=float, default=60.0, metavar="S", help="that is dragged for (60)")
    add("--fps", type=float, default=30.0, help="frames a second that the session publishes at most (30)")
    add("--jobs", type=int, default=1, help="cases at once")
    add("--out", type=Path, default=ROOT / "build" / "edits")
    add("--document", type=Path, metavar="FILE", help="play nothing: the page of what --out holds, and plots")
    add("--one", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.rebuild == []:
        from rebuild_times import VERTICES

        options.rebuild = list(VERTICES)
    return options


def cases(options: argparse.Namespace) -> list[EditCase]:
    """What was asked for."""
    o = options
    same = ("vertices", "fabric", "preset", "device", "seed", "deterministic", "minutes")
    more = {name: getattr(o, name) for name in same}
    if o.garments is None:
        return whole_proof(o.edits, o.each, **more)
    return [
        EditCase(garment, motion, o.edits, kind, o.size, o.at_once, **more)
        for garment in o.garments
        for motion in o.motions
        for kind in o.kinds
    ]


def one(case: EditCase, out: Path) -> int:
    """Play a case in this process and write its JSON file."""
    import ipctk
    import warp as wp
    from run_edits import EditRun

    from tryon_solver.settings import PRESETS

    wp.config.quiet = True
    ipctk.set_num_threads(1)
    PRESETS[case.preset] = replace(PRESETS[case.preset], deterministic=case.deterministic)
    begun = time.monotonic()

    def tell(text: str) -> None:
        print(f"{time.monotonic() - begun:.0f} s: {text}", flush=True)

    def keep(result: dict[str, Any]) -> None:
        minutes = round((time.monotonic() - begun) / 60, 1)
        about = {"commit": commit_of(ROOT), "machine": machine_of(case.device), "minutes": minutes}
        (out / f"{case.name}.json").write_text(json.dumps({**result, "about": about}, indent=1))

    keep(EditRun(case, out / "wardrobe", tell, keep).run())
    return 0


def rebuild(options: argparse.Namespace, out: Path) -> int:
    """Time rebuilds, write the figures and the plots."""
    import warp as wp
    from rebuild_times import SPACINGS, rebuild_times

    wp.config.quiet = True
    rows = []
    for vertices in options.rebuild:
        rows.append(rebuild_times(vertices, SPACINGS, options.preset, options.device, out / "wardrobe"))
        print(json.dumps(rows[-1]), flush=True)
    about = {"commit": commit_of(ROOT), "machine": machine_of(options.device), "preset": options.preset}
    made = {"about": about, "rows": rows}
    (out / "rebuild.json").write_text(json.dumps(made, indent=1))
    return 0


def drag(options: argparse.Namespace, out: Path) -> int:
    """Drag a hem and write how frames came meanwhile; 1 when one crosses."""
    from drag_rate import drag_rate

    rows = []
    for vertices in options.drag:
        rows.append(drag_rate(vertices, options.preset, options.device, options.seconds, out / "wardrobe", options.fps))
        print(json.dumps(rows[-1]), flush=True)
    about = {"commit": commit_of(ROOT), "machine": machine_of(options.device), "preset": options.preset}
    (out / "drag.json").write_text(json.dumps({"about": about, "rows": rows}, indent=1))
    return 1 if any(not row["crossing"].startswith("0 of ") for row in rows) else 0


def levels(options: argparse.Namespace, out: Path) -> int:
    """Write what a session takes while it is edited; 1 when that grows."""
    from memory_levels import memory_levels

    o = options
    row = memory_levels(o.levels, o.vertices, o.preset, o.device, out / "wardrobe", o.seed, told_now)
    about = {"commit": commit_of(ROOT), "machine": machine_of(o.device), "preset": o.preset}
    (out / "levels.json").write_text(json.dumps({"about": about, "row": row}))
    print(row["grown"] or "it comes back to its level")
    return 1 if row["grown"] else 0


def document(page: Path, out: Path) -> int:
    """Write the page of all cases that were played into a folder, and of the rebuilds and drags timed there."""
    import drag_rate
    import memory_levels
    from edit_verdicts import promises
    from rebuild_times import plots, table

    def found(name: str) -> dict[str, Any]:
        return {path.stem: json.loads(path.read_text()) for path in sorted(out.glob(name))}

    results, dragged = found("*-*x*.json"), list(found("drag*.json").values())
    rebuilt, taken = (found(f"{name}.json").get(name) for name in ("rebuild", "levels"))
    text = markdown(results, promises(results, rebuilt, dragged, taken))
    if rebuilt is not None:
        folder = page.parent / page.stem
        folder.mkdir(parents=True, exist_ok=True)
        for name, drawn in plots(rebuilt["rows"]).items():
            (folder / f"{name}.svg").write_text(drawn)
        text += table(rebuilt, page.stem)
    if dragged:
        text += drag_rate.table(dragged)
    if taken is not None:
        text += memory_levels.table(taken)
    page.write_text(text)
    return 1 if any(map(broken, results.values())) else 0


def told_now(text: str) -> None:
    """Tell how far it is."""
    print(text, flush=True)


def told(name: str, result: dict[str, Any]) -> None:
    """Tell of a case that has ended."""
    print(f"{name}: {'; '.join(broken(result)) or 'holds'}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
