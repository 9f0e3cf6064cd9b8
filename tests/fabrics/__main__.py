"""`python tests/fabrics`: the drape coefficient of each fabric, and a page of them.

Each fabric's disc is draped over Cusick's pedestal with two meshes; a JSON file is kept for each, and one that is there
already is not measured again. `--document` writes the page of those that are there.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("tests/fabrics/support", "tests/accuracy/support", "tests/support", "solver", "server", "protocol")
sys.path[:0] = [str(ROOT / folder) for folder in FOLDERS]  # this checkout is judged, whatever is installed

from cusick import COARSE, EDGE, draped  # noqa: E402

from tryon_solver.materials.fabric import FABRICS  # noqa: E402


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python tests/fabrics", description=__doc__)
    add = parser.add_argument
    add("--fabrics", nargs="+", choices=FABRICS, default=list(FABRICS), metavar="NAME", help="which (default all)")
    add("--out", type=Path, default=ROOT / "build" / "fabrics", help="where runs are kept (default build/fabrics)")
    add("--document", type=Path, help="write the page of the runs that are there instead, with its picture")
    options = parser.parse_args(arguments)
    if options.document is not None:
        from fabrics_page import write

        return write(options.document, options.out)
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.fabrics:
        for edge in (COARSE, EDGE):
            path = options.out / f"{name}-{edge:g}mm.json"
            if not path.exists():
                run = draped(FABRICS[name], edge)
                path.write_text(json.dumps(run))
                print(f"{name}, {edge:g} mm: {100 * run['coefficient']:.1f} %, {run['folds']} folds", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
