"""`python tests/proof`: the demo's garments in its motions, each published frame decoded and judged.

Runs every combination of the garments, motions, presets, meshes and devices asked for, each in a process of its own,
and writes one JSON file per case and a table. Exits with 1 when a limit was broken or a case failed, naming the case,
the frame and the limit. With --strangers also clips and patterns of your own, with --whole everything that the project
has to show: `make proof`.

Each case is dressed, led into its motion, stopped, and left standing. Its states go through the server's publishing
code and the client's decoder in the same process; warp, numpy, scipy, trimesh, ipctk, fast-simplification, msgpack,
msgspec, zstandard and the default body are all that is needed. With --server, the frames are those that a real server
sends over its websocket.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import os
import resource
import sys
import time
from collections.abc import Sequence
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OURS = [
    str(ROOT / folder)
    for folder in ("tests/proof/support", "tests/support", "solver", "server", "protocol", "clients/python")
]
sys.path[:0] = OURS  # this checkout is judged, whatever is installed

from case import GARMENTS, MOTIONS, Case, LiveCase, case_of, is_of_meshes  # noqa: E402
from errand import (  # noqa: E402
    Errand,
    long_determinism,
    momentum_symmetries_and_closed_forms,
    reference_scenes,
)
from pool import Job, Pool  # noqa: E402
from provenance import commit_of  # noqa: E402
from table import markdown  # noqa: E402

ONCE = 0.0  # s, as Case has it: a clip is played once, whole
PATTERN_FILE = "_specification.json"
FITTING = 0.0  # size, as Case has it: the one that fits


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns the exit status."""
    options = parsed(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    if options.one:
        return one(case_of(json.loads(options.one)), options.out, options.keep)
    begun = time.monotonic()
    pool = Pool(options.out, options.jobs, ("--keep",) * options.keep)
    with server(options) as address:
        jobs: list[Job] = list(live_cases(options, address) if address is not None else cases(options))
        if options.whole:
            jobs = [*errands(options), *jobs, *mesh_cases(options)]
        results = pool.run(jobs)
    text = markdown(results, about(options, time.monotonic() - begun))
    (options.out / "table.md").write_text(text)
    print(text)
    failed = [r for r in results if r.get("failure") or r.get("broken")]
    print(f"{len(results) - len(failed)} of {len(results)} cases kept every limit; {options.out / 'table.md'}")
    if options.whole and not options.strangers:
        print("No clips and patterns of others were judged: --strangers FOLDER names a folder with yours")
    return 1 if failed else 0


def parsed(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(prog="python tests/proof", description=__doc__.partition("\n")[0])
    add = parser.add_argument
    add("--garments", nargs="+", default=list(GARMENTS), help="patterns of the demo, or files")
    add("--motions", nargs="+", default=list(MOTIONS), help="motions of the demo, or BVH files")
    add("--presets", nargs="+", help="draft, live, fit (live; with --server draft)")
    add("--vertices", type=int, default=2000, metavar="N", help="of a garment's mesh, about (2000); not with --server")
    add("--edges", nargs="+", type=float, default=[0.0], metavar="M", help="edge lengths [m] instead")
    add("--devices", nargs="+", default=["cpu"], help="cpu, cuda:0, ...")
    strangers = "also the T-shirt in every BVH file there, once, and every pattern in walk and squat"
    add("--strangers", type=Path, metavar="FOLDER", help=strangers)
    add("--only-strangers", action="store_true", help="these alone")
    whole = "also meshes of a script, contact against a reference, momentum, symmetries, closed forms, equal bytes"
    add("--whole", action="store_true", help=whole)
    add("--fabric", default="cotton_jersey")
    add("--fps", type=float, default=60.0)
    add("--lead", type=float, default=1.0, metavar="S", help="time in which the body is led into the motion [s]")
    add("--seconds", type=float, default=3.0, metavar="S", help="time of the motion, which repeats [s]; 0: once, whole")
    add("--strange-seconds", type=float, default=1.5, metavar="S", help="the same of walk and squat in their patterns")
    add("--stopping", type=float, default=0.5, metavar="S", help="time at its end in which it slows to a stand [s]")
    add("--standing", type=float, default=2.0, metavar="S", help="time for which the body then stands still [s]")
    add("--every", type=int, default=2, metavar="K", help="IPC Toolkit is asked every K frames")
    own = "solver settings unlike the preset's, and values of effects: Friction.presliding=5e-5"
    add("--set", nargs="*", type=setting, default=[], metavar="NAME=VALUE", help=own)
    add("--server", metavar="URL", help="record from this server instead; `own` starts one")
    add("--frames", type=int, default=300, help="frames to record from a server")
    add("--jobs", type=int, help="cases at once (as many as there are processors; with --server 1)")
    add("--out", type=Path, default=ROOT / "build" / "proof")
    add("--keep", action="store_true", help="also write the decoded frames of each case (.npz)")
    add("--one", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.only_strangers and options.strangers is None:
        parser.error("--only-strangers needs --strangers FOLDER, the folder that holds them")
    options.presets = options.presets or ["draft" if options.server else "live"]
    options.jobs = options.jobs or (1 if options.server else os.cpu_count() or 1)
    return options


def setting(text: str) -> tuple[str, float | int | str]:
    """NAME=VALUE, the value a number where it is one."""
    name, _, value = text.partition("=")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value


def cases(options: argparse.Namespace) -> list[Case]:
    """Every combination, to be simulated in process, and the strangers' files."""
    o = options

    def every(garments: Sequence[str], motions: Sequence[str], seconds: float, size: float = 1.0) -> list[Case]:
        more = (o.fps, o.lead, seconds, o.stopping, o.standing, o.every, tuple(o.set), o.vertices, size)
        return [
            Case(garment, motion, o.fabric, preset, device, edge, *more)
            for motion, garment, preset, edge, device in itertools.product(
                motions, garments, o.presets, o.edges, o.devices
            )
        ]

    found = [] if o.only_strangers else every(o.garments, o.motions, o.seconds)
    if o.strangers:
        clips, patterns = (sorted(str(p.resolve()) for p in o.strangers.rglob(f"*{e}")) for e in (".bvh", PATTERN_FILE))
        found += every(["tshirt"], clips, ONCE) + every(patterns, ["walk", "squat"], o.strange_seconds, FITTING)
        if not clips and not patterns:
            raise SystemExit(f"{o.strangers} holds neither .bvh nor {PATTERN_FILE} files")
    return found


def errands(options: argparse.Namespace) -> list[Errand]:
    """What else there is to show: the longest first, so that they end with the cases."""
    return [*reference_scenes(options.out.resolve()), momentum_symmetries_and_closed_forms(), long_determinism()]


def mesh_cases(options: argparse.Namespace) -> list[Case]:
    """Meshes on moving meshes, which the project's script writes as strangers' exporters would."""
    from mesh_case import BODIES, GARMENTS, write_strangers

    folder, o = options.out.resolve() / "brought", options
    write_strangers(folder)
    return [
        Case(str(folder / garment), str(folder / body), o.fabric, o.presets[0], o.devices[0], 0.0, o.fps)
        for garment, body in zip(GARMENTS, BODIES)
    ]


def live_cases(options: argparse.Namespace, address: str) -> list[LiveCase]:
    """Every combination, to be recorded from a server."""
    return [
        LiveCase(garment, motion, options.fabric, preset, address, options.frames, options.every)
        for garment, motion, preset in itertools.product(options.garments, options.motions, options.presets)
    ]


def server(options: argparse.Namespace) -> contextlib.AbstractContextManager[str | None]:
    """The address of the server that was asked for; None where cases are simulated in process."""
    if options.server != "own":
        return contextlib.nullcontext(options.server)
    from own_server import own_server

    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(OURS)}
    return own_server(options.devices[0], environment, options.out / "server.log")


def one(case: Case | LiveCase, out: Path, keep: bool) -> int:
    """Run a case in this process and write its JSON file."""
    import ipctk
    import warp as wp

    wp.config.quiet = True
    ipctk.set_num_threads(1)

    def tell(text: str) -> None:
        print(text, flush=True)

    frames = out / f"{case.name}.npz" if keep else None
    if isinstance(case, LiveCase):
        from live_case import run_live_case

        result = run_live_case(case, tell, frames)
    elif is_of_meshes(case):
        from mesh_case import run_mesh_case

        result = run_mesh_case(case, tell)
    else:
        from run_case import run_case

        result = run_case(case, out / "wardrobe", tell, frames)
    result["core_s"] = time.process_time()
    (out / f"{case.name}.json").write_text(json.dumps(result, indent=1))
    return 0


def about(options: argparse.Namespace, seconds: float) -> dict[str, str]:
    """What the table was made with."""
    from tryon_server.runtime.devices import list_devices

    edges = ", ".join(f"edges {1e3 * edge:g} mm" if edge else f"{options.vertices} vertices" for edge in options.edges)
    changes = "".join(f", {name} {value}" for name, value in options.set)
    moving = f"{options.seconds:g} s of motion" if options.seconds else "each motion once"
    simulated = (
        f"fabric {options.fabric}, {edges}, {options.fps:g} fps, {options.lead:g} s lead-in, "
        f"{moving}, slowing to a stand over the last {options.stopping:g} s, "
        f"{options.standing:g} s standing{changes}"
    )
    recorded = f"fabric {options.fabric}, {options.frames} frames over the websocket of {options.server}"
    return {
        "machine": "; ".join(device.description for device in list_devices()),
        "commit": commit_of(ROOT),
        "settings": recorded if options.server else simulated,
        "intersections": f"asked of IPC Toolkit in every frame whose number {options.every} divides, and in the last",
        "wall time": f"{seconds / 60:.1f} min, {options.jobs} at once; {core_seconds() / 60:.1f} min of processor time",
    }


def core_seconds() -> float:
    """Processor time [s] of all cases and errands that have ended."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


if __name__ == "__main__":
    sys.exit(main())
