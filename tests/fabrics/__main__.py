"""`python tests/fabrics`: the drape coefficient of each fabric, and a page of them.

Each fabric's disc is draped over Cusick's pedestal from several starts with each of the meshes; a JSON file is kept for
each, and one that is there already is not measured again. `--choose` finds the bending stiffness with which fabrics
drape as was published, and keeps the trials. `--document` writes the page of what is there.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("tests/fabrics/support", "tests/accuracy/support", "tests/support", "solver", "server", "protocol")
sys.path[:0] = [str(ROOT / folder) for folder in FOLDERS]  # this checkout is judged, whatever is installed

from choose_bending import choose  # noqa: E402
from cusick import MESHES, draped_often, mean_and_spread  # noqa: E402

from tryon_solver.materials.fabric import FABRICS  # noqa: E402


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python tests/fabrics", description=__doc__)
    add = parser.add_argument
    add("--fabrics", nargs="+", choices=FABRICS, default=list(FABRICS), metavar="NAME", help="which (default all)")
    add("--meshes", nargs="+", choices=list(map(str, MESHES)), default=list(map(str, MESHES)), help="which of them")
    add("--out", type=Path, default=ROOT / "build" / "fabrics", help="where runs are kept (default build/fabrics)")
    add("--choose", type=Path, metavar="FILE", help="choose the fabrics' bending stiffness; trials are kept in FILE")
    add("--document", type=Path, help="write the page of the runs that are there instead, with its picture")
    options = parser.parse_args(arguments)
    if options.document is not None:
        from fabrics_page import write

        return write(options.document, options.out)
    if options.choose is not None:
        return chosen(options.fabrics, options.choose)
    options.out.mkdir(parents=True, exist_ok=True)
    for mesh in (mesh for mesh in MESHES if str(mesh) in options.meshes):
        for name in options.fabrics:
            path = options.out / f"{name}-{mesh}.json"
            if not path.exists():
                run = draped_often(FABRICS[name], mesh)
                path.write_text(json.dumps(run))
                mean, spread = mean_and_spread(run)
                print(f"{name}, {mesh}: {100 * mean:.1f} ± {100 * spread:.1f} %, folds {run['folds']}", flush=True)
    return 0


def chosen(names: list[str], path: Path) -> int:
    """Choose the stiffness of these fabrics, and put the trials into a file with what else it has."""
    kept = json.loads(path.read_text()) if path.exists() else {}
    for name in names:
        kept[name] = choose(FABRICS[name])
        path.write_text(json.dumps(kept, indent=1) + "\n")
        for trial in kept[name]:
            print(f"{name}: {trial['k_bend']:.2g} N m, {trial['mean']:.3f} ± {trial['spread']:.3f}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
