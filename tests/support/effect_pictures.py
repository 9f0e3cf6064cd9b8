"""Pictures of the effects: `python effect_pictures.py --out docs/effects [--only NAME ...] [--document FILE]`.

Each scene of effect_demos.py is played without its effect and with it, and its end is drawn twice, side by side, as an
SVG of its triangles, farthest first. With --document the table of pictures in that file is written anew.
"""

from __future__ import annotations

import argparse
import re
import sys
from html import escape
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT / "solver" / "bench"), str(ROOT / "solver")]

from effect_demos import DEMOS, Demo  # noqa: E402

from tryon_solver.simulation import Simulation  # noqa: E402

BEGIN, END = "<!-- made by effect_pictures.py -->", "<!-- until here: pictures -->"
PIXELS, MARGIN, HEAD = 180, 10, 22  # px: of each half, around it, above it
ELEVATION = 20.0  # degrees above the ground
SHADES = 7
NEARER = 0.02  # m that cloth is put before what it lies on, whose triangles are larger
LIGHT = np.array([-0.4, 0.6, 0.7])


def triangles_of(sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3, 3) m: all triangles of cloth and body; (T,) are they the cloth's?"""
    cloth = sim.cloth_positions().astype(np.float64)[sim.scene.garment.faces]
    if sim.scene.body is None:
        return cloth, np.ones(len(cloth), bool)
    body = sim.body_positions().astype(np.float64)[sim.scene.body.faces]
    return np.vstack([cloth, body]), np.arange(len(cloth) + len(body)) < len(cloth)


def axes(azimuth: float) -> np.ndarray:
    """(3, 3): to the right, up, and to the eye."""
    a, e = np.radians([azimuth, ELEVATION])
    eye = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
    right = np.array([np.cos(a), 0.0, -np.sin(a)])
    return np.array([right, np.cross(eye, right), eye])


def paths(triangles: np.ndarray, of_cloth: np.ndarray, left: float, scale: float, middle: np.ndarray) -> list[str]:
    """The triangles (T, 3, 3) in the picture's axes, as SVG, farthest first."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    shade = np.round(np.abs(normal @ (LIGHT / np.linalg.norm(LIGHT))) * (SHADES - 1)).astype(int)
    drawn = []
    for t in np.argsort(triangles[:, :, 2].mean(axis=1) + NEARER * of_cloth):
        if not of_cloth[t] and normal[t, 2] < 0:
            continue  # a body's back is never seen
        at = (triangles[t, :, :2] - middle) * [scale, -scale] + [left + PIXELS / 2, HEAD + PIXELS / 2]
        (a, b), (c, d), (e, f) = np.round(at, 1)
        drawn.append(f'<path class="{"cb"[not of_cloth[t]]}{shade[t]}" d="M{a:g} {b:g}L{c:g} {d:g}L{e:g} {f:g}z"/>')
    return drawn


def picture(demo: Demo) -> str:
    """The SVG file of a scene."""
    halves = [triangles_of(demo.played(with_it)) for with_it in (False, True)]
    seen = [(triangles @ axes(demo.azimuth).T, of_cloth) for triangles, of_cloth in halves]
    points = np.vstack([triangles.reshape(-1, 3)[:, :2] for triangles, _ in seen])
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    scale = (PIXELS - 2 * MARGIN) / np.ptp(points, axis=0).max()
    width, height = 2 * PIXELS, HEAD + PIXELS
    title = f"{demo.name}: {demo.shows}"
    drawn = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        f'role="img" aria-label="{escape(title, quote=True)}">',
        f"<style>{style()}</style>",
        f'<rect class="ground" width="{width}" height="{height}"/>',
    ]
    for k, (triangles, of_cloth) in enumerate(seen):
        said = ("without", "with")[k]
        drawn.append(f'<text x="{PIXELS * (k + 0.5):g}" y="15" text-anchor="middle">{said}</text>')
        drawn += paths(triangles, of_cloth, k * PIXELS, scale, middle)
    return "\n".join([*drawn, "</svg>"]) + "\n"


def style() -> str:
    """Cloth in blue and bodies in grey, on a light page and on a dark one."""

    def mixed(dark: tuple[int, ...], bright: tuple[int, ...], k: int) -> str:
        share = k / (SHADES - 1)
        return "#" + "".join(f"{round(a + share * (b - a)):02x}" for a, b in zip(dark, bright))

    cloth = "".join(f".c{k}{{fill:{mixed((26, 74, 136), (140, 190, 246), k)}}}" for k in range(SHADES))
    body = "".join(f".b{k}{{fill:{mixed((120, 118, 112), (216, 214, 208), k)}}}" for k in range(SHADES))
    return (
        f"text{{font:12px system-ui,sans-serif;fill:#3a3a38}}.ground{{fill:#fff}}path{{stroke:#1a3a66;"
        f"stroke-width:.25;stroke-linejoin:round}}{cloth}{body}"
        "@media(prefers-color-scheme:dark){text{fill:#c9c9c4}.ground{fill:#161615}}"
    )


def file_of(demo: Demo) -> str:
    """The picture's file name."""
    return re.sub(r"\W+", "_", demo.name.lower()) + ".svg"


def table(folder: str) -> str:
    """In Markdown, two to a row."""
    cells = [f"**{demo.name}**: {demo.shows}<br>![{demo.name}]({folder}/{file_of(demo)})" for demo in DEMOS]
    cells += [""] * (len(cells) % 2)
    rows = [f"| {a} | {b} |" for a, b in zip(cells[::2], cells[1::2])]
    return "\n".join([BEGIN, "", "| | |", "|---|---|", *rows, "", END])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder that the pictures are put into")
    parser.add_argument("--only", nargs="+", help="these alone, by name")
    parser.add_argument("--document", type=Path, help="a file beside that folder whose table is written anew")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    for demo in DEMOS:
        if not asked.only or demo.name in asked.only:
            (asked.out / file_of(demo)).write_text(picture(demo))
            print(demo.name, flush=True)
    if asked.document is not None:
        head, _, rest = asked.document.read_text().partition(BEGIN)
        asked.document.write_text(head + table(asked.out.name) + rest.partition(END)[2])


if __name__ == "__main__":
    main()
