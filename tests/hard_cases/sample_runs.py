"""What a run leaves, made up: results, and frames of a square over a ball."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from harness.frames import Frames
from small_scenes import icosphere, sheet


def result(name: str, **figures: Any) -> dict[str, Any]:
    """Of a case that holds, with some figures changed."""
    measured = {"vertices": 100, "frames": 10, "asked": 5, "moves": 20, "unclean": 0, "not_free": 0, "void": 0}
    more = {"worn": None, "strain_limit": 1.1, "broken": [], "stresses": f"what {name} stresses", "failure": ""}
    return {"name": name, **measured, **more, **figures}


def over_ball(height: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A square at this height over the middle of a ball of 8 cm: positions and faces of both."""
    garment, x = sheet(9, 9, 0.2, 0.2)
    return x + [0, height, 0], garment.faces, *icosphere(0.08, 2)


def kept(folder: Path, heights: list[float]) -> Path:
    """The square at these heights, frame by frame, in the folder's file of a needle."""
    x, faces, ball, ball_faces = over_ball(0.0)
    frames = Frames(faces, ball_faces, 0.5)
    for height in heights:
        frames.note(x + [0, height, 0], ball)
    folder.mkdir()
    frames.save(folder / "needle.npz")
    return folder
