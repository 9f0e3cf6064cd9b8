"""What three garments over each other cost against one of them, and whether anything passes through anything.

    python tests/outfits --vertices 3000                                        # the CPU, preset draft
    python tests/outfits --vertices 10000 --device cuda:0 --preset live --out build/outfits/h200.json
    python tests/outfits --document docs/effects.md --of docs/effects/runs/outfits-*.json

The demo's skirt, T-shirt and overshirt are put on one over the other, the T-shirt alone likewise, and both are led into
each motion, from the same start. IPC Toolkit is asked of every frame whether any two surfaces cross, of all pairs of
what is worn, each garment with itself and the body. Exits with 1 where any do.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OURS = ("tests/outfits/support", "tests/support", "solver")
sys.path[:0] = [str(ROOT / folder) for folder in OURS]  # this checkout is judged, whatever is installed

from outfits_page import line, write  # noqa: E402
from provenance import commit_of, machine_of  # noqa: E402


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns the exit status."""
    asked = parsed(arguments)
    if asked.document is not None:
        return write(asked.document, [json.loads(path.read_text()) for path in asked.of])
    import warp as wp
    from outfits_played import OUTFIT, edge_for, played, put_on

    wp.config.quiet = True
    edge = edge_for(asked.vertices)
    about = {"commit": commit_of(ROOT), "machine": machine_of(asked.device), "preset": asked.preset, "fps": asked.fps}
    run: dict[str, object] = {"about": about, "edge": edge, "runs": []}
    crossing = 0
    for names in (["tshirt"], list(OUTFIT)):
        worn = put_on(names, edge, asked.preset, asked.device)
        for motion in asked.motions:
            figures = played(worn, motion, asked.frames, asked.fps)
            crossing += len(figures["crossing"])
            run["runs"] = [*run["runs"], figures]  # type: ignore[misc]
            print(line(figures), flush=True)
            asked.out.parent.mkdir(parents=True, exist_ok=True)
            asked.out.write_text(json.dumps(run, indent=1) + "\n")
    print(f"written: {asked.out}")
    return 1 if crossing else 0


def parsed(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(
        prog="python tests/outfits", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--vertices", type=int, default=3000, metavar="N", help="of a garment, about (%(default)s)")
    add("--motions", nargs="+", default=["walk", "squat"], help="walk squat")
    add("--frames", type=int, default=90, help="of each motion, which the first second leads into (%(default)s)")
    add("--fps", type=float, default=30.0, help="frames a second (%(default)s)")
    add("--preset", default="draft", choices=["draft", "live", "fit"], help="%(default)s")
    add("--device", default="cpu", help="cpu, cuda:0, ...")
    add("--out", type=Path, default=ROOT / "build" / "outfits" / "run.json", metavar="FILE", help="JSON")
    add("--document", type=Path, metavar="FILE", help="play nothing: write the tables of the runs --of into this page")
    add("--of", nargs="+", type=Path, default=[], metavar="FILE", help="JSON of runs, for --document")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
