"""docs/fabrics.md: what each fabric is made to, how it hangs, and how it looks."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Mapping, Sequence
from math import cos, pi, sin
from pathlib import Path
from typing import Any

from cusick import ACROSS, COARSE, DRAFT, FINE, LIVE, MESHES, Mesh, mean_and_spread
from discretisation_disc import DISC

from tryon_solver.materials.fabric import FABRICS, Fabric

COLUMNS, CELL, ROW = 5, 152, 268  # of the picture: cells across, px of one, and of a row of them
SCALE = 0.44  # px a mm
STYLE = (
    "text{font:13px sans-serif;fill:#222}.light{fill:#666;font-size:12px}.cloth{fill:#7f9dbd;stroke:#2b4a6b}"
    ".stand{fill:#bbb}.flat{fill:none;stroke:#999;stroke-dasharray:3 3}"
    "@media(prefers-color-scheme:dark){text{fill:#ddd}.light{fill:#aaa}.stand{fill:#666}}"
)

HEAD = f"""# Fabrics

Each fabric's drape coefficient, measured as on a Cusick drapemeter (Cusick 1968; BS 5058): a disc of 300 mm on a
pedestal of 180 mm, at rest; (shadow - pedestal)/(disc - pedestal). 0 % hangs straight down, 100 % stays flat. The
plate that holds a real disc down is left out: friction does. A disc may fold in several ways, and a drapemeter's is
laid on several times, face up and face down: ours is let fall from {LIVE.starts} starts, its mesh turned against the
warp and rippled otherwise in each (`STARTS` in `tests/fabrics/support/cusick.py`). **Ours** is the mean and the
standard deviation over these, with the mesh that a session at `live` has, edges of {LIVE.edge:g} mm. Beside it the
first start with {FINE.edge:g} mm, and behind it, in brackets, that start with {LIVE.edge:g} mm; and all starts with the
mesh and preset of a session at `draft`, {DRAFT.edge:g} mm. A disc counts as at rest when it is slower than 1 mm/s RMS,
else after 4 s (*: of these some). `make fabrics-page` measures what is not in `docs/fabrics/runs` yet and writes this
page.
"""

SOURCES = """
## What was published

| fabrics | drape coefficient | where |
| --- | --- | --- |
| single jersey | 18 to 31 % (discs of 25 cm) | knitted cottons of 97 to 209 g/m², as collected from the literature |
| woven silk | 20 to 40 % | Matsudaira and Yang 2003, Textile Research Journal 73(3) |
| five-thread satin | 43 to 70 % | Analysis of a fabric drape profile, Fibres and Textiles 1/2018 |
| plain cotton | 48 to 72 % by its picks; 68 % | the same; Gan, Ly and Steven 1991, J. Textile Institute 82(1) |
| twill 2/2 of 248 g/m² | 85 % | Fibres and Textiles 1/2018 |
| wool suitings | 40 to 70 % | studies of worsteds, as collected from the literature |
| heavy cotton twill | 70 to 90 % | twill 3/1 of 249 g/m²: 80 %, Fibres and Textiles 1/2018; denim as the class above |

These were read from collections of the papers' figures, not from the papers themselves. No coefficient was found for
viscose jersey, linen, taffeta and canvas by name: their ranges are estimates, put where the class and weight of the
cloth lie among those above.

## What is estimated

Densities are those of shop fabrics of that name. Stretch and shear stiffnesses are of the order that garments are
simulated with, no laboratory's measurement. Bending stiffness goes by the drape: of five fabrics it was chosen by hand,
of two it gave what was published as it stood, and of three it was chosen so:

    python tests/fabrics --choose docs/fabrics/chosen.json

A fabric whose mean lies in its range keeps what it has. For another, secants over the stiffness' logarithm aim at the
middle of the range, and the first trial that lies within the range by two of its spreads is taken
(`tests/fabrics/support/choose_bending.py`). All other numbers stay.

{trials}

It need not be what a pure bending tester reads: real cloth is held up by its inner friction as well (Kawabata's 2HB),
which this model does not have, so that a stiffness which gives the right drape stands for both. Of limp cloth the
coefficient hardly tells it: cotton jersey with 1.8, 0.95 and 0.38 µN m gave 29, 27 and 25 % with the mesh of `live`,
where its weight, its shear and the size of the triangles say how it folds.

{coarse}

**Order.** Where the published ranges of two fabrics do not overlap, ours are in the same order with each of the
meshes, which is tested. At `live`: {outside}

**Thickness** is that of a contact, and not below 0.4 mm: charmeuse, satin, taffeta and poplin of a shop have 0.15 to
0.3 mm. A gap is d - xi in float32, with coordinates of a few metres, so that 0.4 mm is what leaves a safe margin over
their rounding. It hardly counts for the drape: 0.3, 0.6 and 1.2 mm change the coefficient of one and the same twill by
0.1 % ([accuracy.md](accuracy.md)). What it does change is how thick a pile of folds lies.
"""

LOOKS = """
## How they look

![A dress in each fabric](fabrics/side_by_side.jpg)

The page in Chromium, each dress simulated in its fabric on the body as it stands, beside it its skirt from nearby
(`python tests/clients/support/fabric_pictures.py`). Colour, normals and roughness are maps of one tile of the weave
(`server/tryon_server/looks`), in metres of the pattern; a `.glb` carries the same.

"""


Runs = Mapping[tuple[str, Mesh], Mapping[str, Any]]


def write(page: Path, runs: Path) -> int:
    """Write the page and its picture of the runs in a folder, and of the trials in chosen.json beside it; the exit
    status."""
    measured = kept_in(runs)
    missing = [f"{name}, {mesh}" for name in FABRICS for mesh in MESHES if (name, mesh) not in measured]
    if missing:
        print(f"not measured yet: {'; '.join(missing)}; python tests/fabrics does")
        return 1
    order = sorted(FABRICS, key=lambda name: mean_and_spread(measured[name, LIVE]))
    picture = page.with_suffix("") / "drape.svg"
    picture.parent.mkdir(exist_ok=True)
    picture.write_text(drawn([measured[name, LIVE] for name in order]))
    table = "\n".join(row(FABRICS[name], measured) for name in order)
    trials = trials_table(json.loads((runs.parent / "chosen.json").read_text()))
    said = SOURCES.format(trials=trials, coarse=coarse(measured), outside=outside(measured, LIVE))
    title = "![Each disc's shadow, and from the side](fabrics/drape.svg)\n"
    page.write_text(f"{HEAD}\n{COLUMN_NAMES}\n{table}\n\n{title}{said}{LOOKS}{look_table(order)}\n")
    return 0


COLUMN_NAMES = (
    "| fabric | g/m² | thickness [mm] | bending [µN m] | published [%] | ours [%] "
    f"| with {FINE.edge:g} mm | at `draft` | folds |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def kept_in(folder: Path) -> Runs:
    """The runs that are kept, by fabric and mesh."""
    by_name = {(mesh.edge, mesh.preset): mesh for mesh in MESHES}
    runs = [json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))]
    return {(run["fabric"], by_name[run["edge"], run["preset"]]): run for run in runs}


def row(fabric: Fabric, measured: Runs) -> str:
    """Of the table."""
    live, fine, draft = (measured[fabric.name, mesh] for mesh in (LIVE, FINE, DRAFT))
    cells = [
        called(fabric.name),
        f"{1000 * fabric.areal_density:.0f}",
        f"{1000 * fabric.thickness:.1f}",
        f"{1e6 * fabric.k_bend:g}",
        "–" if fabric.drape is None else of_range(fabric.drape),
        f"**{of_starts(live)}**",
        f"{100 * fine['coefficient'][0]:.1f} ({100 * live['coefficient'][0]:.1f})",
        of_starts(draft),
        " ".join(map(str, live["folds"])),
    ]
    return f"| {' | '.join(cells)} |"


def of_starts(run: Mapping[str, Any]) -> str:
    """Mean and spread, in per cent."""
    mean, spread = mean_and_spread(run)
    return f"{100 * mean:.1f} ± {100 * spread:.1f}{'' if all(run['at_rest']) else '*'}"


def of_range(drape: tuple[float, float]) -> str:
    """In per cent."""
    return f"{100 * drape[0]:.0f} to {100 * drape[1]:.0f}"


def trials_table(chosen: Mapping[str, Sequence[Mapping[str, float]]]) -> str:
    """The trials of each fabric whose stiffness was chosen by script, the last the one that is taken."""
    lines = ["| fabric | published [%] | trials: bending [µN m], drape [%] |", "| --- | --- | --- |"]
    for name, trials in chosen.items():
        drape = FABRICS[name].drape
        assert drape is not None
        said = [f"{1e6 * t['k_bend']:g}: {100 * t['mean']:.1f} ± {100 * t['spread']:.1f}" for t in trials]
        lines.append(f"| {called(name)} | {of_range(drape)} | {'; '.join(said)} |")
    return "\n".join(lines)


def coarse(measured: Runs) -> str:
    """Sentences on what coarser meshes make of it."""
    off = [measured[name, FINE]["coefficient"][0] - measured[name, LIVE]["coefficient"][0] for name in FABRICS]
    more = {
        name: mean_and_spread(measured[name, DRAFT])[0] - mean_and_spread(measured[name, LIVE])[0] for name in FABRICS
    }
    most = max(more, key=lambda name: more[name])
    budgets = [mean_and_spread(measured[name, COARSE])[0] - mean_and_spread(measured[name, DRAFT])[0] for name in more]
    told = (
        f"**What the mesh adds.** From {LIVE.edge:g} to {FINE.edge:g} mm the first start's coefficient changes by "
        f"{100 * min(off):+.1f} to {100 * max(off):+.1f} points. {DRAFT.edge:g} mm can not follow the folds of limp "
        f"cloth, which hangs stiffer: by {100 * more[most]:.1f} points for {called(most)}, and by "
        f"{100 * min(more.values()):+.1f} or more for all. It is the mesh and not the preset's few iterations: with "
        f"the steps and budgets of `live` the same mesh changes the mean by {100 * min(budgets):+.1f} to "
        f"{100 * max(budgets):+.1f} points. At `draft`: {outside(measured, DRAFT)}"
    )
    return textwrap.fill(told, 118, break_on_hyphens=False)


def outside(measured: Runs, mesh: Mesh) -> str:
    """A sentence on the fabrics whose mean is not as published."""
    said = []
    for name, fabric in FABRICS.items():
        mean, _ = mean_and_spread(measured[name, mesh])
        if fabric.drape is not None and not fabric.drape[0] <= mean <= fabric.drape[1]:
            said.append(f"{called(name)} ({100 * mean:.0f} for {of_range(fabric.drape)} %)")
    return f"out of their ranges are {', '.join(said)}." if said else "all means lie in their ranges."


def look_table(order: Sequence[str]) -> str:
    """Weave and threads of each fabric."""
    lines = ["| fabric | weave | threads a cm | source of its numbers |", "| --- | --- | --- | --- |"]
    for name in order:
        look = FABRICS[name].look
        threads = " × ".join(f"{0.01 / pitch:.0f}" for pitch in look.pitch)
        lines.append(f"| {called(name)} | {look.weave} | {threads} | {FABRICS[name].source} |")
    return "\n".join(lines)


def called(name: str) -> str:
    """As people write it."""
    return name.replace("_", " ")


def drawn(runs: Sequence[Mapping[str, Any]]) -> str:
    """An SVG: of each run the shadow from above, with disc and pedestal, and below it the cloth from the side."""
    rows = -(-len(runs) // COLUMNS)
    width, height = COLUMNS * CELL, rows * ROW
    cells = "".join(
        f'<g transform="translate({CELL * (k % COLUMNS)},{ROW * (k // COLUMNS)})">{cell(run)}</g>'
        for k, run in enumerate(runs)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
        f"<style>{STYLE}</style>{cells}</svg>\n"
    )


def cell(run: Mapping[str, Any]) -> str:
    """One fabric of the picture."""
    middle, above, side = CELL / 2, 88.0, 176.0
    outer, inner = 1e3 * SCALE * DISC.radius, 1e3 * SCALE * DISC.pedestal
    count = len(run["outline"])
    angles = [2 * pi * (k + 0.5) / count for k in range(count)]
    around = [(middle + SCALE * r * cos(a), above + SCALE * r * sin(a)) for r, a in zip(run["outline"], angles)]
    across = [middle + SCALE * 1e3 * ((k + 0.5) * ACROSS - DISC.radius) for k in range(len(run["hem"]))]
    hanging = [(x, side - SCALE * y) for x, y in zip(across, run["hem"]) if y < -1]
    seen = [(hanging[0][0], side), *hanging, (hanging[-1][0], side)]
    return (
        f'<circle class="flat" cx="{middle}" cy="{above}" r="{outer:.1f}"/>'
        f'<polygon class="cloth" points="{points(around)}"/>'
        f'<circle class="flat" cx="{middle}" cy="{above}" r="{inner:.1f}"/>'
        f'<rect class="stand" x="{middle - inner:.1f}" y="{side}" width="{2 * inner:.1f}" height="46"/>'
        f'<polygon class="cloth" points="{points(seen)}"/>'
        f'<text x="{middle}" y="16" text-anchor="middle">{called(run["fabric"])}</text>'
        f'<text class="light" x="{middle}" y="244" text-anchor="middle">{100 * run["coefficient"][0]:.0f} %, '
        f"{run['folds'][0]} folds</text>"
    )


def points(places: Sequence[tuple[float, float]]) -> str:
    """Of a polygon."""
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
