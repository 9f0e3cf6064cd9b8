"""Telling cases as several solvers left them, one picture each, all of a case at the same time and from the same place.

The frame is that in which, of all solvers together, the most triangles cross, of every STRIDE-th one and the last.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from harness.crossed import Crossings
from harness.frames import Frames
from harness.picture import Camera, Surface, drawn, write_png

VIEWS: dict[str, tuple[float, float]] = {
    "needle": (30, 12),
    "knife_edge": (40, 18),
    "ten_layers_dropped": (30, 28),
    "arms_pressed_in": (30, 8),
    "deep_squat": (35, 8),
}
"""Cases that are shown, and from where: degrees right of +z, and above the ground."""

STRIDE = 10  # frames
PIXELS = 280
PAPER = 6  # pixels above and below
MARGIN = 1.12  # of what has to be in the picture
FURTHEST = 1.5  # so much further than ours another solver's cloth is shown: what has fallen off is out of the picture
FRONT, BACK, CROSSED, BODY = (0.32, 0.55, 0.82), (0.96, 0.76, 0.42), (0.86, 0.08, 0.10), (0.80, 0.80, 0.80)


def portraits(case: str, runs: Mapping[str, Path], out: Path) -> dict[str, Any]:
    """Draws the case of each run's folder into `out`/CASE-RUN.png; what the page says of them.

    The first run is the one that is framed. A run whose frames end before that has no picture.
    """
    frames = {name: Frames.load(folder / f"{case}.npz") for name, folder in runs.items()}
    k, crossing = telling_frame(frames)
    shown = {name: frames[name] for name in crossing}
    camera = framed(case, [kept.cloth[k] for kept in shown.values()])
    images = {name: picture(kept, k, crossing[name], camera) for name, kept in shown.items()}
    rows = used([*images.values()])
    for name, image in images.items():
        write_png(out / f"{case}-{name}.png", image[rows])
    counts = {name: int(mask.sum()) for name, mask in crossing.items()}
    return {"case": case, "seconds": k * next(iter(frames.values())).dt, "crossed": counts}


def telling_frame(frames: Mapping[str, Frames]) -> tuple[int, dict[str, np.ndarray]]:
    """The number of the frame that is shown, and which triangles cross in it (F,); the last where none does."""
    prepared = {name: Crossings(kept.faces, kept.body_faces, len(kept.cloth[0])) for name, kept in frames.items()}
    last = max(len(kept.cloth) for kept in frames.values()) - 1
    asked = [*range(last, 0, -STRIDE)]
    found = [
        {name: prepared[name].among(f.cloth[k], f.surface[k]) for name, f in frames.items() if k < len(f.cloth)}
        for k in asked
    ]
    worst = int(np.argmax([sum(int(mask.sum()) for mask in masks.values()) for masks in found]))
    return asked[worst], found[worst]


def framed(case: str, cloths: list[np.ndarray]) -> Camera:
    """All cloths in the picture, as far as they are not much further away than the first."""
    first = cloths[0].astype(np.float64)
    centre = 0.5 * (first.min(0) + first.max(0))
    around = Camera(*VIEWS[case], centre, 1.0)
    own = np.abs((first - centre) @ around.axes()[:2].T).max()
    all_ = np.vstack([cloth[np.isfinite(cloth).all(1)] for cloth in cloths]).astype(np.float64)
    most = np.abs((all_ - centre) @ around.axes()[:2].T).max()
    return Camera(*VIEWS[case], centre, MARGIN * min(most, FURTHEST * own))


def used(images: list[np.ndarray]) -> slice:
    """Rows in which there is something in any of the pictures, and a little paper around them."""
    inked = np.flatnonzero(np.any([(image < 255).any((1, 2)) for image in images], axis=0))
    return slice(max(0, inked[0] - PAPER), inked[-1] + 1 + PAPER)


def picture(kept: Frames, k: int, crossing: np.ndarray, camera: Camera) -> np.ndarray:
    """(PIXELS, PIXELS, 3) uint8 of frame k: the front and the back of the cloth, what crosses, and the body."""
    front, back = (np.where(crossing[:, None], CROSSED, colour) for colour in (FRONT, BACK))
    grey = np.tile(BODY, (len(kept.body_faces), 1))
    body = Surface(kept.surface[k], kept.body_faces, grey, grey, lines=False)
    return drawn([body, Surface(kept.cloth[k], kept.faces, front, back)], camera, PIXELS)
