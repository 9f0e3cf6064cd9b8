"""Motions: those that come with the server, by name, and any BVH file."""

from __future__ import annotations

from pathlib import Path

from tryon_server.problems import ProblemError, problem_error
from tryon_server.runtime.interface import MotionEntry
from tryon_solver.body.bvh import BvhError, parse_bvh
from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import Motion, MotionError
from tryon_solver.body.retarget import retarget
from tryon_solver.body.skeletons import RetargetError

MOTION_FOLDER = Path(__file__).parent.parent / "demo" / "motions"


def list_motions(folder: Path = MOTION_FOLDER) -> tuple[MotionEntry, ...]:
    """Every motion that comes with the server, the walk first: it is what the demo opens with."""
    paths = sorted(folder.glob("*.bvh"), key=lambda path: (path.stem != "walk", path.stem))
    return tuple(MotionEntry(path.stem, _duration(path)) for path in paths)


def load_motion(name: str, body: BodyModel) -> Motion:
    """The motion of this name, or in this BVH file, for this body.

    Raises:
        ProblemError: there is none, or it is no motion for this body.
    """
    path = MOTION_FOLDER / f"{name}.bvh"
    if not path.is_file():
        path = Path(name)
    try:
        clip = parse_bvh(path.read_text(encoding="utf-8", errors="replace"), name=path.stem)
        return retarget(clip, body)
    except OSError as error:
        known = ", ".join(entry.stem for entry in sorted(MOTION_FOLDER.glob("*.bvh")))
        raise problem_error(
            "motion.unknown", f"there is no motion {name!r}", f"Give a BVH file or one of: {known}", place="motion"
        ) from error
    except (BvhError, RetargetError, MotionError) as error:
        raise _unfit(path, str(error)) from error


def _unfit(path: Path, why: str) -> ProblemError:
    return problem_error(
        "motion.invalid", f"{path} can't be played: {why}", "Export the motion again, or choose another", place="motion"
    )


def _duration(path: Path) -> float:
    """Length of a BVH file [s], read from its MOTION lines."""
    frames, frame_time = 0, 0.0
    with path.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            if line.startswith("Frames:"):
                frames = int(line.split()[1])
            elif line.startswith("Frame Time:"):
                frame_time = float(line.split()[2])
                break
    return max(0, frames - 1) * frame_time
