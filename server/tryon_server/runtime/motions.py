"""The motions that come with the server."""

from __future__ import annotations

from pathlib import Path

from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import Motion

from tryon_server.runtime.interface import MotionEntry

MOTION_FOLDER = Path(__file__).parent.parent / "demo" / "motions"


def list_motions(folder: Path = MOTION_FOLDER) -> tuple[MotionEntry, ...]:
    """Every motion there is, the walk first: it is what the demo opens with."""
    entries = [MotionEntry(path.stem, Motion.load(path).duration) for path in sorted(folder.glob("*.npz"))]
    return tuple(sorted(entries, key=lambda entry: entry.name != "walk"))


def load_motion(name: str, body: BodyModel) -> Motion:
    """The motion of this name for this body. Raises KeyError when there is none."""
    return Motion.load(MOTION_FOLDER / f"{name}.npz")
