"""Motions: those that come with the server, by name, and any BVH file."""

from __future__ import annotations

import math
from pathlib import Path

from tryon_server.findings import MotionFacts
from tryon_server.problems import ProblemError, problem_error
from tryon_server.runtime.interface import MotionEntry
from tryon_server.sessions.commands import MotionFile, MotionReading
from tryon_solver.body.bvh import KNOWN_UNITS, UNITS, BvhClip, BvhError, BvhUnitError, decode_bvh, find_units, parse_bvh
from tryon_solver.body.feet import floor
from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import Motion, MotionError
from tryon_solver.body.own_sides import with_own_sides, with_told_facing
from tryon_solver.body.pose_jumps import find_start
from tryon_solver.body.retarget import retarget
from tryon_solver.body.root_unit import with_root_unit
from tryon_solver.body.skeletons import RetargetError, SkeletonParts, UnnamedError, find_parts
from tryon_solver.body.standing_rest import lying_or_standing, tilt, upward_axis, with_standing_rest
from tryon_solver.body.stillness import stillness
from tryon_solver.files.foreign import LOOKED_AT, no_motion

MOTION_FOLDER = Path(__file__).parent.parent / "demo" / "motions"
AGAIN = "Export the motion again, or choose another"
TILTED = "legs and trunk lean from {up} by {degrees:.0f} degrees as one: it was tilted in its export, and is played so"
CLOSED = (0.01, 3.0)  # m and degrees by which a motion that is repeated may miss its start without a word
NAMED_MAX = 8  # joints without a use that are told by name
UNIT_WORDS = {unit: word for unit, units in UNITS.items() for known, word in KNOWN_UNITS if known == units}


def list_motions(folder: Path = MOTION_FOLDER) -> tuple[MotionEntry, ...]:
    """Every motion that comes with the server, the walk first: it is what the demo opens with."""
    paths = sorted(folder.glob("*.bvh"), key=lambda path: (path.stem != "walk", path.stem))
    return tuple(MotionEntry(path.stem, _duration(path)) for path in paths)


def load_motion(name: str, body: BodyModel, file: MotionFile | None = None) -> Motion:
    """The motion of this name, or in this BVH file, for this body. Raises ProblemError."""
    if file is None:
        return read_motion(name, body)[0]
    try:
        content = Path(file.path).read_bytes()
    except OSError as error:
        raise problem_error(
            "motion.lost", f"the file of the motion {name!r} is no longer there", "Upload it again", place="motion"
        ) from error
    return read_clip(content, name, body, file.reading)[0]


def read_motion(
    name: str,
    body: BodyModel,
    reading: MotionReading = MotionReading(),  # noqa: B008
) -> tuple[Motion, MotionFacts]:
    """The motion of this name, or in this BVH file, for this body; and what was found out about the file.

    Raises:
        ProblemError: there is none, or it is no motion for this body.
    """
    path = MOTION_FOLDER / f"{name}.bvh"
    if not path.is_file():
        path = Path(name)
    try:
        content = path.read_bytes()
    except OSError as error:
        known = ", ".join(entry.stem for entry in sorted(MOTION_FOLDER.glob("*.bvh")))
        raise problem_error(
            "motion.unknown", f"there is no motion {name!r}", f"Give a BVH file or one of: {known}", place="motion"
        ) from error
    return read_clip(content, path.name, body, reading)


def read_clip(
    content: bytes,
    name: str,
    body: BodyModel,
    reading: MotionReading = MotionReading(),  # noqa: B008
) -> tuple[Motion, MotionFacts]:
    """The motion that a BVH file holds, and what was found out about it.

    Args:
        content: what the file holds.
        name: what to call it.
        body: who is to move.
        reading: what is told about it.

    Raises:
        ProblemError: it is no motion for this body; its place is the line, where one is at fault.
    """
    foreign = no_motion(content[:LOOKED_AT], name)
    if foreign is not None:
        raise _unfit(name, foreign[0], "motion", foreign[1])
    try:
        text = decode_bvh(content)
        units, facing, up = reading.units, reading.facing, reading.up
        if units is None:
            found = find_units(text, reading.joints)
            clip, word, how = parse_bvh(text, found, Path(name).stem), found.name, found.because
        else:
            clip, word, how = parse_bvh(text, UNITS[units], Path(name).stem), UNIT_WORDS[units], "as told"
        parts = find_parts(clip.joint_names, clip.parents, reading.joints)
        clip, root = with_root_unit(clip, parts, up)
        start, left_out = find_start(clip, parts)
        standing, rest = with_standing_rest(clip, parts, up, start)
        own, sides = with_told_facing(clip, parts, facing) if facing else with_own_sides(standing, parts)
        motion = retarget(clip, body, names=reading.joints, facing=facing, up=up)
        begun = clip.since(start)
        mended = (clip.skeleton, root, left_out, rest, sides, stillness(begun, parts), floor(body, motion)[1])
        said = (*mended, _joints_told(reading))
        return motion, _facts(begun, own, word, f"units: {word}, {how}", said, up)
    except BvhError as error:
        message = str(error)
        place = "motion" if error.line is None else f"line {error.line}"
        remedy = AGAIN if error.line is None else "Mend the line, or export the motion again"
        if isinstance(error, BvhUnitError):
            remedy = f"Say its unit with --motion-units ({', '.join(UNITS)})"
            told = reading.units is not None
            remedy += ", or leave it out to have it found" if told else ", or mend the file and try again"
        raise _unfit(name, message.removeprefix(f"{place}: "), place, remedy) from error
    except UnnamedError as error:
        asked = " ".join(f"--motion-joint {part}=NAME" for part in error.parts or ("PART",))
        remedy = f"Say which joints of the file these are with {asked}, or rename them in the file"
        raise _unfit(name, str(error), "motion", remedy) from error
    except (RetargetError, MotionError) as error:
        raise _unfit(name, str(error), "motion", AGAIN) from error


def closing_note(motion: Motion) -> str:
    """What there is to say of a motion that is repeated and does not end as it began, for people; "" where it does."""
    metres, turn = motion.closing_error()
    degrees = math.degrees(turn)
    if motion.duration == 0 or (metres < CLOSED[0] and degrees < CLOSED[1]):
        return ""
    far = f"{metres:.2f} m" if metres >= 1 else f"{100 * metres:.0f} cm"
    way, turns = motion.fades()
    return (
        f"where it repeats, its end is {far} and, at one joint, {degrees:.0f} degrees from its start: the way "
        f"is spread over its last {way:.2f} s, the turns over its last {turns:.2f} s"
    )


def _joints_told(reading: MotionReading) -> str:
    told = ", ".join(f"{part} is {joint}" for part, joint in (reading.joints or {}).items())
    return f"joints, as told: {told}" if told else ""


def _facts(
    clip: BvhClip, parts: SkeletonParts, word: str, units: str, mended: tuple[str, ...], up_told: str | None
) -> MotionFacts:
    names = clip.joint_names
    mapped = {part: names[joint] for part, joint in parts.joints.items()}
    mapped |= {f"{side}_clavicle": names[joint] for side, joint in parts.clavicles.items()}
    for chain, joints in (("spine", parts.spine), ("neck", parts.neck)):
        mapped |= {f"{chain}_{k + 1}": names[joint] for k, joint in enumerate(joints)}
    used = set(mapped.values())
    unused = tuple(name for name in names if name not in used)
    seconds = (clip.frame_count - 1) * clip.dt
    up, told_by = upward_axis(clip, parts, up_told)
    tilted = tilt(clip, parts, up_told)
    listed = ", ".join(unused[:NAMED_MAX]) + (f" and {len(unused) - NAMED_MAX} more" if unused[NAMED_MAX:] else "")
    said = [
        units,
        f"up: {up}, {told_by}",
        *filter(None, [lying_or_standing(clip, parts, up_told)]),
        *([TILTED.format(up=up, degrees=tilted)] if tilted else []),
        f"{clip.frame_count} frames, {1 / clip.dt:.4g} a second, {seconds:.2f} s",
        f"{len(used)} of its {len(names)} joints move the body{f', not {listed}' if unused else ''}",
        *filter(None, mended),
    ]
    return MotionFacts(
        seconds=seconds,
        fps=1 / clip.dt,
        frame_count=clip.frame_count,
        units=word,
        up=up,
        joints_mapped=mapped,
        joints_unused=unused,
        notes=tuple(said),
    )


def _unfit(name: str, why: str, place: str, remedy: str) -> ProblemError:
    return problem_error("motion.invalid", f"{name} can't be played: {why}", remedy, place=place, status=422)


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
