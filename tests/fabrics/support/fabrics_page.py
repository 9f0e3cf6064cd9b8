"""docs/fabrics.md: what each fabric is made to, how it hangs, and how it looks."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Mapping, Sequence
from math import cos, pi, sin
from pathlib import Path
from typing import Any

from cusick import ACROSS, COARSE, EDGE
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
plate that holds a real disc down is left out: friction does. `make fabrics-page` measures what is not in
`docs/fabrics/runs` yet and writes this page; the mesh has edges of {EDGE:g} mm, beside it one of {COARSE:g} mm, both at
60 steps a second, `live`, until the cloth is slower than 1 mm/s RMS, or for 4 s (*: it was not yet slower then).
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

Densities are those of shop fabrics of that name. Of the first five, stiffnesses are as they were before any drape was
measured: of the order that garments are simulated with, no laboratory's measurement. Bending stiffness of the others
was chosen by trial so that the drape comes out in the range. It is not what a pure bending tester reads: real cloth is
held up by its inner friction as well (Kawabata's 2HB), which this model does not have, so that a stiffness which gives
the right drape stands for both.

**Order.** Where the published ranges of two fabrics do not overlap, ours are in the same order, which is tested.
{outside}

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


def write(page: Path, runs: Path) -> int:
    """Write the page and its picture of the runs in a folder; the exit status."""
    measured = {(run["fabric"], run["edge"]): run for run in map(read, sorted(runs.glob("*.json")))}
    missing = [name for name in FABRICS if (name, EDGE) not in measured or (name, COARSE) not in measured]
    if missing:
        print(f"not measured yet: {', '.join(missing)}; python tests/fabrics does")
        return 1
    fine = {name: measured[name, EDGE] for name in FABRICS}
    order = sorted(FABRICS, key=lambda name: fine[name]["coefficient"])
    picture = page.with_suffix("") / "drape.svg"
    picture.parent.mkdir(exist_ok=True)
    picture.write_text(drawn([fine[name] for name in order]))
    table = "\n".join(row(FABRICS[name], fine[name], measured[name, COARSE]) for name in order)
    said = SOURCES.format(outside=outside(fine))
    title = "![Each disc's shadow, and from the side](fabrics/drape.svg)\n"
    page.write_text(f"{HEAD}\n{COLUMN_NAMES}\n{table}\n\n{title}{said}{LOOKS}{look_table(order)}\n")
    return 0


COLUMN_NAMES = (
    "| fabric | g/m² | thickness [mm] | bending [µN m] | published [%] | ours [%] | with the coarser mesh | folds |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- |"
)


def read(path: Path) -> dict[str, Any]:
    """A kept run."""
    return json.loads(path.read_text())


def row(fabric: Fabric, fine: Mapping[str, Any], coarse: Mapping[str, Any]) -> str:
    """Of the table."""
    published = "–" if fabric.drape is None else f"{100 * fabric.drape[0]:.0f} to {100 * fabric.drape[1]:.0f}"
    cells = [
        called(fabric.name),
        f"{1000 * fabric.areal_density:.0f}",
        f"{1000 * fabric.thickness:.1f}",
        f"{1e6 * fabric.k_bend:g}",
        published,
        f"**{100 * fine['coefficient']:.1f}**{'' if fine['at_rest'] else '*'}",
        f"{100 * coarse['coefficient']:.1f}",
        str(fine["folds"]),
    ]
    return f"| {' | '.join(cells)} |"


def outside(fine: Mapping[str, Mapping[str, Any]]) -> str:
    """A sentence on the fabrics that hang otherwise than published."""
    said = []
    for name, run in fine.items():
        drape = FABRICS[name].drape
        if drape is not None and not drape[0] <= run["coefficient"] <= drape[1]:
            published = f"{100 * drape[0]:.0f} to {100 * drape[1]:.0f} %"
            said.append(f"{called(name)} ({100 * run['coefficient']:.0f} for {published})")
    if not said:
        return "All lie in their ranges."
    told = f"Out of their ranges are {', '.join(said)}; the first five fabrics were left as they were."
    return textwrap.fill(told, 118)


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
        f'<text class="light" x="{middle}" y="244" text-anchor="middle">{100 * run["coefficient"]:.0f} %, '
        f"{run['folds']} folds</text>"
    )


def points(places: Sequence[tuple[float, float]]) -> str:
    """Of a polygon."""
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
