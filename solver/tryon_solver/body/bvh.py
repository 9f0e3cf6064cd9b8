"""BVH motion files: any joint names, any channel order.

A joint turns by the product of its rotation channels in the order written, `R = R_1 R_2 R_3` (so "Zrotation Yrotation
Xrotation" means Rz Ry Rx), degrees. Position channels replace the joint's OFFSET, axis by axis. With all channels zero
the skeleton stands in its rest pose, and every joint's rotation is relative to that. BVH has no unit: centimetres
unless told otherwise, and a skeleton that comes out no size of a human is refused rather than guessed at; `find_units`
finds the unit in which its bones are a human's.
Format: M. Meredith and S. Maddock, "Motion capture file formats explained", University of Sheffield, CS-01-11.
"""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.skeletons import SIDES, RetargetError, SkeletonParts, find_parts

CENTIMETRES = 100.0  # units per metre
SMALLEST, LARGEST = 0.5, 3.0  # m, plausible extent of a human skeleton in its rest pose
HUMAN = (1.15, 2.3)  # m, largest extent of a human's joints in a tall pose: height, arm span, arms up
TALL_SHARE = 90.0  # per cent of the poses are no larger than a tall one
ANYBODY = (0.45, 2.0)  # m, from ankle to head along the bones, of people 0.55 to 2.35 m tall: 0.85 of the height
GROWN = (1.0, 1.75)  # m, the same of people 1.2 to 2.05 m tall; no two units fit both
TOLD = (0.25, 3.0)  # m, the same of what is still believed where the unit is told
FRAMES_MEASURED = 100
BONE_OFF = 3.0  # times that a bone is as long by its position channels as by its OFFSET: then these say it
MOST_TURNED = 360e3  # degrees: a thousand turns, of rotations that are written on without being taken back
SHORTEST_FRAME, LONGEST_FRAME = 1e-3, 1.0  # s, from high-speed cameras to key poses
KNOWN_UNITS = (
    (1.0, "metres"),
    (1 / 0.3048, "feet"),
    (10.0, "decimetres"),
    (17.72, "CMU's ASF units"),
    (39.37, "inches"),
    (100.0, "centimetres"),
    (1000.0, "millimetres"),
)
USUAL_UNITS = ("centimetres", "metres", "millimetres")  # of two that fit somebody small or very tall
UNITS = {"m": 1.0, "dm": 10.0, "asf": 17.72, "in": 39.37, "ft": 1 / 0.3048, "cm": 100.0, "mm": 1000.0}
"""Units per metre, by the names that a user tells them by; those of `KNOWN_UNITS`."""
BYTE_ORDER_MARK = "\ufeff"  # what some editors begin UTF-8 with
BRACES = re.compile("([{}])")
AXES = {"X": 0, "Y": 1, "Z": 2}


class BvhError(ValueError):
    """Not a BVH file we can play; the message names the line and the remedy."""

    def __init__(self, message: str, line: int | None = None) -> None:
        super().__init__(message if line is None else f"line {line}: {message}")
        self.line = line


class BvhUnitError(BvhError):
    """The skeleton has no human's size in the unit told, or in any; telling another unit is the remedy."""


@dataclass(frozen=True)
class BvhClip:
    """A motion on its own skeleton, in metres."""

    joint_names: tuple[str, ...]  # (J,), parents first
    parents: np.ndarray  # (J,) int32, -1 for the root
    offsets: np.ndarray  # (J, 3) m, from the parent in the rest pose
    end_sites: dict[int, np.ndarray]  # joint -> (3,) m, the tip of a bone without a child
    positions: np.ndarray  # (T, J, 3) m, each joint relative to its parent; the root's in the world
    rotations: np.ndarray  # (T, J, 4) unit quaternions, each joint relative to its parent
    dt: float  # s
    name: str = "clip"
    skeleton: str = ""  # what was done about bones whose OFFSETs are not their lengths, for people

    @property
    def frame_count(self) -> int:
        return len(self.rotations)

    def since(self, frame: int) -> BvhClip:
        """The clip from a frame on."""
        if frame == 0:
            return self
        return replace(self, positions=self.positions[frame:], rotations=self.rotations[frame:])

    def rest_positions(self) -> np.ndarray:
        """(J, 3) m: the joints in the rest pose, the root at its OFFSET."""
        placed = self.offsets.copy()
        for joint, parent in enumerate(self.parents[1:], start=1):
            placed[joint] += placed[parent]
        return placed

    def world(self) -> tuple[np.ndarray, np.ndarray]:
        """World positions (T, J, 3) m and world rotations (T, J, 4) of every joint in every frame."""
        positions, rotations = self.positions.copy(), self.rotations.copy()
        for joint, parent in enumerate(self.parents[1:], start=1):
            moved = quaternions.rotate(rotations[:, parent], self.positions[:, joint])
            positions[:, joint] = positions[:, parent] + moved
            rotations[:, joint] = quaternions.multiply(rotations[:, parent], self.rotations[:, joint])
        return positions, rotations


class FoundUnits(NamedTuple):
    """Units per metre of a BVH file, their name, and how they were found, for people."""

    per_metre: float
    name: str
    because: str


def find_units(text: str, names: Mapping[str, str] | None = None) -> FoundUnits:
    """The units of a BVH file's text: those in which its bones make a human's height.

    Bones are looked at, not poses, in which a person may crouch, lie, hold the arms up or stand far from a scene's
    root. Of several units that fit it is the one in which the person is grown up, there being one at most; if there is
    none, one of `USUAL_UNITS`, else the one in which the person is largest; the others are told. `names`: as of
    find_parts. Where the joints' names are not understood the largest extent of a tall pose says it.
    Raises BvhUnitError when no unit fits, RetargetError when none fits and the names are not understood.
    """
    clip = _read(text, 1.0, "clip")
    try:
        size = _bone_height(clip, find_parts(clip.joint_names, clip.parents, names))
    except RetargetError:
        fitting = _fitting(_tall_extent(clip), HUMAN)
        if len(fitting) != 1:
            raise
        return FoundUnits(*fitting[0], "in which its tall poses are a human's")
    fitting = sorted(
        _fitting(size, ANYBODY),
        key=lambda unit: (not _within(size / unit[0], GROWN), unit[1] not in USUAL_UNITS, unit[0]),
    )
    if not fitting:
        known = ", ".join(name for _, name in KNOWN_UNITS)
        raise BvhUnitError(
            f"from ankle to head its bones measure {size:.4g} units, which is a human's {ANYBODY[0]} to {ANYBODY[1]} m "
            f"in none of {known}; export it in one of these"
        )
    because = f"in which its bones measure {size / fitting[0][0]:.2f} m from ankle to head"
    also = fitting[1:]
    if fitting[0][1] in USUAL_UNITS and _within(size / fitting[0][0], GROWN):
        also = [unit for unit in also if unit[1] in USUAL_UNITS]  # an infant in feet is not worth a word
    if also:
        others = " or ".join(f"{size / per_metre:.2f} m in {name}" for per_metre, name in also)
        because += f"; it could also be {others}: --motion-units tells"
    return FoundUnits(*fitting[0], because)


def _fitting(size: float, limits: tuple[float, float]) -> list[tuple[float, str]]:
    return [(units, name) for units, name in KNOWN_UNITS if _within(size / units, limits)]


def _within(size: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= size <= limits[1]


def _tall_extent(clip: BvhClip) -> float:
    """The largest extent of the joints in a tall pose."""
    frames = np.unique(np.linspace(0, clip.frame_count - 1, FRAMES_MEASURED).round().astype(int))
    positions, _ = replace(clip, positions=clip.positions[frames], rotations=clip.rotations[frames]).world()
    return float(np.percentile(np.ptp(positions, axis=1).max(axis=1), TALL_SHARE))


def _bone_height(clip: BvhClip, parts: SkeletonParts) -> float:
    """Length along the bones from ankle to hip and from pelvis to head; the offsets that positions replace don't
    count."""
    lengths = np.median(np.linalg.norm(clip.positions, axis=2), axis=0)

    def between(above: str, below: str) -> float:
        joint, length = parts.joints[below], 0.0
        while joint != parts.joints[above]:
            length += float(lengths[joint])
            joint = int(clip.parents[joint])
        return length

    return 0.5 * sum(between(f"{side}_thigh", f"{side}_foot") for side in SIDES) + between("pelvis", "head")


def decode_bvh(content: bytes) -> str:
    """The text of a BVH file: UTF-8, with or without its mark, or plain bytes of any code page, whose letters beyond
    ASCII are replaced. Raises BvhError for UTF-16, which some editors write.
    """
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or b"\0" in content[:4]:
        raise BvhError("it is UTF-16 text, not plain text; save it as UTF-8")
    return content.decode("utf-8", errors="replace")


@dataclass
class _Joint:
    """A joint while its braces are read."""

    name: str
    parent: int
    line: int
    offset: list[float] | None = None
    channels: list[str] = field(default_factory=list)
    end: list[float] | None = None


def parse_bvh(text: str, units_per_metre: float | FoundUnits | None = CENTIMETRES, name: str = "clip") -> BvhClip:
    """Read a BVH file's text. Raises BvhError naming the line and the remedy.

    `units_per_metre`: 100 when the file is in centimetres (the usual), 1 for metres, 39.37 for inches; what
    `find_units` found, which is not doubted; None to have it do so, which may raise RetargetError.
    """
    if units_per_metre is None:
        units_per_metre = find_units(text)
    if isinstance(units_per_metre, FoundUnits):
        return _read(text, units_per_metre.per_metre, name)
    if not (math.isfinite(units_per_metre) and units_per_metre > 0.0):
        raise BvhError(f"units_per_metre is {units_per_metre}; give a positive number, 100 for centimetres")
    clip = _read(text, units_per_metre, name)
    _refuse_implausible_size(clip, units_per_metre)
    return clip


def _read(text: str, units_per_metre: float, name: str) -> BvhClip:
    lines = _numbered(text.removeprefix(BYTE_ORDER_MARK))
    joints = _parse_hierarchy(lines)
    values, dt = _parse_motion(lines, [channel for joint in joints for channel in joint.channels])
    parents = np.array([joint.parent for joint in joints], dtype=np.int32)
    offsets = np.array([joint.offset for joint in joints]) / units_per_metre
    end_sites = {k: np.array(joint.end) / units_per_metre for k, joint in enumerate(joints) if joint.end is not None}

    positions = np.repeat(offsets[None], len(values), axis=0)
    rotations = np.tile(quaternions.IDENTITY, (len(values), len(joints), 1))
    column = 0
    for index, joint in enumerate(joints):
        for channel in joint.channels:
            axis, track = AXES[channel[0]], values[:, column]
            column += 1
            if channel.endswith("position"):
                positions[:, index, axis] = track / units_per_metre
            else:
                turn = quaternions.from_axis_angle(np.eye(3)[axis], np.radians(track))
                rotations[:, index] = quaternions.multiply(rotations[:, index], turn)
    offsets, skeleton = _channel_bones(joints, offsets, positions)
    names = tuple(joint.name for joint in joints)
    return BvhClip(names, parents, offsets, end_sites, positions, rotations, dt, name, skeleton)


def _channel_bones(joints: list[_Joint], offsets: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, str]:
    """The bones (J, 3) m, where OFFSETs are zeros or far from what position channels put in their place, and a note.

    Since each joint's place is relative to its parent, a bone's is the same in every frame, and in the rest pose: the
    median. Where all of them are 0 in every frame, as if they were added to the OFFSETs, these are put into `positions`
    (T, J, 3) m. Raises BvhError where no bone has a length.
    """
    bones = np.median(positions, axis=0)
    told, lengths = np.linalg.norm(offsets, axis=1), np.linalg.norm(bones, axis=1)
    placed = np.array([sum(channel.endswith("position") for channel in joint.channels) == 3 for joint in joints])
    parents = [joint.parent for joint in joints]
    for joint, parent in enumerate(parents):  # those that carry all others hold no bone's length, but where it all is
        if parents.count(parent) > 1:
            break
        placed[joint] = False
    known = placed & (told > 0)
    if known.any() and not positions[:, known].any():
        positions[:, known] = offsets[known]
        said = f"the position channels of {known.sum()} joints are all 0, which would put each on its parent"
        return offsets, f"{said}: their OFFSETs are taken"
    other = placed & (lengths > 0) & ((lengths > BONE_OFF * told) | (told > BONE_OFF * lengths))
    if other.any():
        offsets = np.where(other[:, None], bones, offsets)
    if len(joints) > 1 and not offsets[1:].any():
        raise BvhError("all OFFSETs are 0, so no bone has a length; export the skeleton with them", joints[1].line)
    if not other.any():
        return offsets, ""
    how = "are 0" if not told[other].any() else f"are over {BONE_OFF:g} times off"
    return offsets, f"{other.sum()} of its OFFSETs {how}: these bones are as long as their position channels say"


def _numbered(text: str) -> Iterator[tuple[int, list[str]]]:
    """(line number, words) of every line that is not blank; a brace, blanks around it or not, counts as a line."""
    for number, line in enumerate(text.splitlines(), start=1):
        for part in BRACES.split(line):
            if words := part.split():
                yield number, words


def _parse_hierarchy(lines: Iterator[tuple[int, list[str]]]) -> list[_Joint]:
    """Joints in file order, up to and including the line MOTION."""
    joints: list[_Joint] = []
    open_braces: list[int | None] = []  # the joint of each open brace; None for an End Site
    announced: int | None = None  # joint whose "{" must come next
    in_end_site = False
    first = next(lines, None)
    if first is None or first[1][0].upper() != "HIERARCHY":
        raise BvhError("a BVH file starts with the word HIERARCHY", first[0] if first else 1)
    for number, words in lines:
        keyword = words[0].upper()
        if keyword == "MOTION":
            if open_braces:
                raise BvhError("MOTION begins while a brace is open; close every joint with '}'", number)
            if not joints:
                raise BvhError("MOTION begins before any ROOT joint", number)
            _refuse_incomplete(joints)
            return joints
        if keyword in ("ROOT", "JOINT"):
            inside = open_braces[-1] if open_braces else None
            if (keyword == "ROOT") != (not open_braces) or (keyword == "ROOT" and joints):
                raise BvhError(f"{keyword} stands at the wrong place; one ROOT, every JOINT inside its parent", number)
            if len(words) < 2 or (keyword == "JOINT" and inside is None):
                raise BvhError(f"{keyword} needs a name and must not stand in an End Site", number)
            joint_name = " ".join(words[1:])
            if any(joint.name == joint_name for joint in joints):
                raise BvhError(f"a second joint named {joint_name!r}; names must be unique", number)
            joints.append(_Joint(joint_name, -1 if inside is None else inside, number))
            announced, in_end_site = len(joints) - 1, False
        elif keyword in ("END", "ENDSITE"):
            if not open_braces or open_braces[-1] is None:
                raise BvhError("End Site outside of a joint", number)
            announced, in_end_site = open_braces[-1], True
        elif keyword == "{":
            if announced is None:
                raise BvhError("'{' without a ROOT, JOINT or End Site before it", number)
            open_braces.append(None if in_end_site else announced)
            if in_end_site:
                joints[announced].end = []
            announced = None
        elif keyword == "}":
            if not open_braces:
                raise BvhError("'}' without a matching '{'", number)
            open_braces.pop()
            in_end_site = False
        elif keyword in ("OFFSET", "CHANNELS") and not open_braces:
            raise BvhError(f"{keyword} outside of a joint's braces", number)
        elif keyword == "OFFSET":
            offset = _numbers(words[1:], number, "OFFSET", 3)
            inside = open_braces[-1]
            if inside is not None:
                joints[inside].offset = offset
            else:
                joints[next(j for j in reversed(open_braces) if j is not None)].end = offset
        elif keyword == "CHANNELS" and open_braces[-1] is not None:
            joints[open_braces[-1]].channels = _channels(words[1:], number)
        else:
            raise BvhError(
                f"unexpected {words[0]!r}; expected JOINT, End Site, OFFSET, CHANNELS, a brace or MOTION", number
            )
    raise BvhError("the file ends before the word MOTION; it is cut short")


def _refuse_incomplete(joints: list[_Joint]) -> None:
    for joint in joints:
        if joint.offset is None:
            raise BvhError(f"joint {joint.name!r} has no OFFSET", joint.line)
        if joint.end is not None and not joint.end:
            raise BvhError(f"the End Site of joint {joint.name!r} has no OFFSET", joint.line)


def _channels(words: list[str], line: int) -> list[str]:
    """Channel names as "Xposition" or "Zrotation", whatever the file's capitals."""
    if not words or not words[0].isdigit() or int(words[0]) != len(words) - 1:
        raise BvhError("CHANNELS must give a count and that many names", line)
    names = [word[:1].upper() + word[1:].lower() for word in words[1:]]
    for written, channel in zip(words[1:], names):
        if channel[0] not in AXES or channel[1:] not in ("position", "rotation"):
            raise BvhError(f"unknown channel {written!r}; use Xposition .. Zposition, Xrotation .. Zrotation", line)
    if len(set(names)) != len(names):
        raise BvhError("a channel is listed twice", line)
    return names


def _parse_motion(lines: Iterator[tuple[int, list[str]]], channels: list[str]) -> tuple[np.ndarray, float]:
    """Channel values (T, channels) and the frame time [s]."""
    frames, line = _header(lines, "Frames:")
    if frames < 1 or frames != int(frames):
        raise BvhError(f"'Frames:' says {frames:g}; a motion has at least one whole frame", line)
    dt, line = _header(lines, "Frame Time:")
    if not SHORTEST_FRAME <= dt <= LONGEST_FRAME:
        raise BvhError(
            f"'Frame Time:' says {dt:g} s; a motion has {SHORTEST_FRAME:g} to {LONGEST_FRAME:g} s, 0.016667 for 60 Hz",
            line,
        )
    rows = []
    for k, (number, words) in enumerate(lines):
        row = _numbers(words, number, f"frame {k + 1}", len(channels))
        for column, (value, channel) in enumerate(zip(row, channels, strict=True)):
            if channel.endswith("rotation") and abs(value) > MOST_TURNED:
                raise BvhError(
                    f"value {column + 1} of frame {k + 1} turns a joint by {value:.3g} degrees, more than "
                    f"{MOST_TURNED:.0f}",
                    number,
                )
        rows.append(row)
    if len(rows) != int(frames):
        raise BvhError(
            f"'Frames:' promises {int(frames)} frames, the file holds {len(rows)}: it is cut short or miscounted"
        )
    return np.array(rows).reshape(len(rows), len(channels)), dt


def _header(lines: Iterator[tuple[int, list[str]]], written: str) -> tuple[float, int | None]:
    """The number that a line of the header gives after what is `written` before it, blanks or not, and that line."""
    number, words = next(lines, (None, []))
    before, colon, value = " ".join(words).partition(":")
    if "".join(before.split()).upper() + colon != "".join(written.split()).upper():
        raise BvhError(f"expected '{written}' and a number after MOTION", number)
    return _numbers(value.split(), number, written, 1)[0], number


def _numbers(words: list[str], line: int | None, what: str, count: int) -> list[float]:
    if len(words) != count:
        raise BvhError(f"{what} has {len(words)} values, expected {count}", line)
    numbers = []
    for column, word in enumerate(words, start=1):
        try:
            value = float(word)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise BvhError(f"value {column} of {what} is {word!r}, not a finite number", line)
        numbers.append(value)
    return numbers


def _refuse_implausible_size(clip: BvhClip, units_per_metre: float) -> None:
    """Its bones must make about a human; where its names are not understood the largest extent of the rest pose
    (height, or arm span in a T pose) must."""
    try:
        height, limits = _bone_height(clip, find_parts(clip.joint_names, clip.parents)), TOLD
        usual, tall = ANYBODY, "tall from ankle to head"
    except RetargetError:
        joints = clip.rest_positions()
        tips = [joints[joint] + tip for joint, tip in clip.end_sites.items()]
        height = float(np.ptp(np.concatenate([joints, *(tip[None] for tip in tips)]), axis=0).max())
        limits, usual, tall = (SMALLEST, LARGEST), (1.2, 2.3), "tall"
    if _within(height, limits):
        return
    fitting = [unit for _, unit in _fitting(height * units_per_metre, usual)]
    raise BvhUnitError(
        f"at {units_per_metre:g} units per metre the skeleton {clip.name!r} is {height:.3g} m {tall}, not a human's "
        f"{limits[0]} to {limits[1]} m; it would be one in {' or '.join(fitting) or 'no unit that is usual'}"
    )
