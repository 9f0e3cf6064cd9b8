"""The telling cases by several solvers beside each other: the figures that are kept, and the page's part on them."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.document import over_limit, scaled
from harness.judgement import UNASKED
from harness.portraits import VIEWS, portraits

Result = Mapping[str, Any]

TITLES = {
    "ours": "ours",
    "xpbd": "XPBD",
    "chebyshev": "Chebyshev-Jacobi",
    "vbd": "Newton's VBD",
    "style3d": "Newton's Style3D",
}
MEANS = {
    "ours": "preset live",
    "xpbd": "20 sub-steps of one iteration a frame (`baselines/xpbd/`)",
    "chebyshev": "8 sub-steps of 40 iterations a frame (`baselines/chebyshev_jacobi_pd/`)",
    "vbd": "10 sub-steps of 10 iterations a frame, with divide-and-truncate against bodies that stand still "
    "(`tests/hard_cases/harness/by_newton.py` says what it is given)",
    "style3d": "10 sub-steps of 10 iterations a frame, contact of vertices with the body (the same file)",
}
"""Each solver's own settings: its default, or that of its examples."""

KEPT = ("name", "failure", "vertices", "frames", "asked", "unclean", "stretch_max", "strain_limit", "worn")
KEPT += ("trembling", "speed_at_end", "cpu_ms")
FIGURES: tuple[tuple[str, Callable[[Result], float | None], str], ...] = (
    ("Limits broken; ours are held to those of energy, too", lambda r: r.get("limits_broken"), "{:.0f}"),
    ("Frames in which cloth crosses cloth or body, % of those asked", lambda r: share_unclean(r), "{:.0f}"),
    ("Largest stretch, as a share of the fabric's limit", lambda r: over_limit(r, "stretch_max"), "{:.2f}"),
    ("Trembling, mm/s RMS above 8 Hz (limit 1)", lambda r: scaled(r, "trembling", 1e3), "{:.2f}"),
    ("Speed at the end, mm/s RMS", lambda r: scaled(r, "speed_at_end", 1e3), "{:.1f}"),
    ("Processor time of a frame, ms", lambda r: r.get("cpu_ms"), "{:.0f}"),
)
"""Less is better: title, value in a result, form."""

FILE = "peers.json"


def kept_of(result: Result) -> dict[str, Any]:
    """What the file holds of a result. These cases are shortened: that some rest is not asked about breaks nothing."""
    count = sum(broken.get("limit") != UNASKED for broken in result["broken"])
    return {name: result[name] for name in KEPT if name in result} | {"limits_broken": count}


def share_unclean(result: Result) -> float | None:
    """% of the frames that IPC Toolkit was asked about."""
    return 100 * result["unclean"] / result["asked"] if result.get("asked") else None


def compare(runs: Mapping[str, Mapping[str, Any]], folders: Mapping[str, Path], out: Path) -> None:
    """Writes `out`/peers.json and the pictures; `runs` by solver, ours first, are what their `run.json` hold."""
    out.mkdir(parents=True, exist_ok=True)
    kept = [
        {
            "solver": solver,
            "about": run["about"],
            "results": [kept_of(r) for r in run["results"]],
        }
        for solver, run in runs.items()
    ]
    with_frames = {
        case: {solver: folder for solver, folder in folders.items() if (folder / f"{case}.npz").exists()}
        for case in VIEWS
    }
    shown = [portraits(case, of, out) for case, of in with_frames.items() if of]
    (out / FILE).write_text(json.dumps({"runs": kept, "pictures": shown}, indent=1) + "\n")


def section(kept: Mapping[str, Any], pictures: str) -> list[str]:
    """The page's part; `pictures` is the way from the page to the folder of the pictures."""
    runs = kept["runs"]
    solvers = [run["solver"] for run in runs]
    about = runs[0]["about"]
    lines = [
        "## Beside other solvers",
        "",
        "Ten telling cases by other solvers, judged alike but for the energy and the sub-steps, which they can't be "
        "asked. All play them at the same small size, ours too, for XPBD and Chebyshev-Jacobi are numpy and take "
        f"seconds a frame at 1,000 vertices: {about['settings']}. "
        "Garments of so few triangles are coarse, and figures differ from those above. Newton's solvers know no strain "
        "limit. Played and drawn by `make hard-peers`. The least of a row is bold; a dash is where a case was not "
        "played to its end, or had too little time at rest to be asked. Cloth that fell through something crosses "
        "nothing any more: the speed at the end tells.",
        "",
        *(
            f"- **{TITLES[run['solver']]}**: {MEANS[run['solver']]}; {run['about']['machine']}; commit "
            f"{run['about']['commit']}"
            for run in runs
        ),
        "",
    ]
    for title, value_of, form in FIGURES:
        lines += [f"### {title}", "", *table(runs, value_of, form), ""]
    for shown in kept["pictures"]:
        lines += [*gallery(shown, solvers, pictures), ""]
    return lines


def table(runs: Sequence[Mapping[str, Any]], value_of: Callable[[Result], float | None], form: str) -> list[str]:
    """A line a case, a column a solver."""
    by_run = [{r["name"]: r for r in run["results"]} for run in runs]
    lines = ["| case | " + " | ".join(TITLES[run["solver"]] for run in runs) + " |", "|---|" + "---|" * len(runs)]
    for name in by_run[0]:
        said = [cell(results.get(name, {}), value_of, form) for results in by_run]
        figures = [float(text) for text in said if text.replace(".", "").isdigit()]
        least = form.format(min(figures, default=0.0))
        lines.append(f"| {name} | " + " | ".join(f"**{s}**" if s == least else s for s in said) + " |")
    return lines


def cell(result: Result, value_of: Callable[[Result], float | None], form: str) -> str:
    """A figure; a dash where there is none. Of a garment that came off that is said, and it is never the best."""
    if result.get("failure"):
        return "not expressible" if result["failure"].startswith("not expressible") else "FAILED"
    value = value_of(result)
    if value is None:
        return "–"
    return form.format(value) + (" (came off)" if result.get("worn") is False else "")


def gallery(shown: Mapping[str, Any], solvers: Sequence[str], pictures: str) -> list[str]:
    """A case's pictures in a row, with how many triangles cross in each below it."""
    case, crossing = shown["case"], shown["crossed"]
    here = [solver for solver in solvers if solver in crossing]
    images = [f"![{case} by {TITLES[s]}]({pictures}/{case}-{s}.png)" for s in here]
    told = [f"{crossing[s]} triangles cross" if crossing[s] else "nothing crosses" for s in here]
    return [
        f"**{case}** after {shown['seconds']:.2f} s; red: triangles that cross",
        "",
        "| " + " | ".join(TITLES[s] for s in here) + " |",
        "|" + "---|" * len(here),
        "| " + " | ".join(images) + " |",
        "| " + " | ".join(told) + " |",
    ]


def way(page: Path, folder: Path) -> str:
    """From a page to a folder, as links in the page say it."""
    return Path(os.path.relpath(folder, page.parent)).as_posix()
