"""Motions: those that come with the server, by name, and any BVH file."""

from __future__ import annotations

from pathlib import Path

from tryon_server.problems import ProblemError, problem_error
from tryon_server.runtime.interface import MotionEntry
from tryon_solver.body.bvh import BvhError, find_units, parse_bvh
from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import Motion, MotionError
from tryon_solver.body.retarget import retarget
from tryon_solver.body.skeletons import RetargetError, find_parts
from tryon_solver.body.standing_rest import with_standing_rest

MOTION_FOLDER = Path(__file__).parent.parent / "demo" / "motions"


def list_motions(folder: Path = MOTION_FOLDER) -> tuple[MotionEntry, ...]:
    """Every motion that comes with the server, the walk first: it is what the demo opens with."""
    paths = sorted(folder.glob("*.bvh"), key=lambda path: (path.stem != "walk", path.stem))
    return tuple(MotionEntry(path.stem, _duration(path)) for path in paths)


def load_motion(name: str, body: BodyModel) -> Motion:
    """The motion of this name, or in this BVH file, for this body. Raises ProblemError."""
    return read_motion(name, body)[0]


def read_motion(name: str, body: BodyModel) -> tuple[Motion, tuple[str, ...]]:
    """The motion of this name, or in this BVH file, for this body; and what had to be found out about the file.

    Raises:
        ProblemError: there is none, or it is no motion for this body.
    """
    path = MOTION_FOLDER / f"{name}.bvh"
    if not path.is_file():
        path = Path(name)
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
        units, unit = find_units(text)
        clip = parse_bvh(text, units, path.stem)
        _, rest = with_standing_rest(clip, find_parts(clip.joint_names, clip.parents))
        notes = (f"units: {unit}, in which its poses are a human's", *([rest] if rest else []))
        return retarget(clip, body), notes
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
