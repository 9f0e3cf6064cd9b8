"""What a well-formed message must also satisfy before the simulation may see it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .conventions import CONVENTIONS
from .errors import ProtocolError
from .messages import (
    POSE_CLOCKS,
    POSE_CONVENTION,
    POSE_FRAME,
    POSE_SMOOTHINGS,
    PoseMessage,
    Quaternion,
    SkeletonMessage,
    Vector,
)

MAX_ROOT_DISTANCE = 1.0e5
"""m. The grid of int32 units of 1/16 mm spans 134 km; a root farther than this from the session's origin is refused."""
CONFIDENT = 0.5
"""A joint of a tracker whose confidence is below this counts as not seen."""
UNIT_TOLERANCE = 0.01
"""A quaternion whose length differs from 1 by more than this is refused; a smaller difference is normalised away."""


def validate_pose(
    pose: PoseMessage, joint_names: Sequence[str], subjects: Sequence[str]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Check a pose against the session it was sent to.

    Args:
        pose: the message.
        joint_names: names of the J joints of the session's body.
        subjects: bodies of the session, as in `welcome.subjects`.

    Returns:
        root (3,) float64 m and rotations (J,4) float64 unit quaternions x, y, z, w.

    Raises:
        ProtocolError: naming the joint and the remedy. Codes "unknown_subject", "unsupported_convention",
            "unsupported_frame", "unsupported_clock", "invalid_pose".
    """
    _known("unsupported_convention", "$.convention", pose.convention, [POSE_CONVENTION])
    _check_common(pose, subjects, (POSE_FRAME,))
    return _root(pose, joint_names[0]), _rotations(pose.rotations, joint_names, "rotations")


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A sound `skeleton` message; None for what it does not tell.

    Attributes:
        convention: a key of `CONVENTIONS`.
        joint_names: [K] in the order of the poses' arrays.
        parents: [K] or None.
        rest_positions: (K,3) m or None.
        rest_rotations: (K,4) unit quaternions x, y, z, w, or None.
    """

    convention: str
    joint_names: tuple[str, ...]
    parents: tuple[int, ...] | None
    rest_positions: npt.NDArray[np.float64] | None
    rest_rotations: npt.NDArray[np.float64] | None


@dataclass(frozen=True, eq=False)
class TrackedPose:
    """A sound pose of a tracker; None for the arrays that its convention does not have.

    Attributes:
        root: (3,) m or None.
        positions: (K,3) m or None.
        rotations: (K,4) unit quaternions x, y, z, w, or None.
        tracked: (K,) bool; the numbers of a joint that is not tracked are zero (the identity) and mean nothing.
    """

    root: npt.NDArray[np.float64] | None
    positions: npt.NDArray[np.float64] | None
    rotations: npt.NDArray[np.float64] | None
    tracked: npt.NDArray[np.bool_]


def validate_skeleton(message: SkeletonMessage, subjects: Sequence[str]) -> Skeleton:
    """Check what a tracker says of its joints.

    Raises:
        ProtocolError: naming the joint or field and the remedy. Codes "unknown_subject", "unsupported_convention",
            "invalid_skeleton".
    """
    _known("unknown_subject", "$.subject", message.subject, subjects)
    _known("unsupported_convention", "$.convention", message.convention, tuple(CONVENTIONS))
    convention, names = CONVENTIONS[message.convention], message.joint_names
    seen: set[str] = set()
    for k, name in enumerate(names):
        if name in seen or (convention.known and name not in convention.known):
            what = "stands twice" if name in seen else f"is none of {message.convention!r}"
            raise _crooked(f"$.joint_names[{k}]", f"The joint {name!r} {what}.", "Send each joint once, by its name.")
        seen.add(name)
    missing = [name for name in convention.required if name not in seen]
    if missing:
        raise _crooked("$.joint_names", f"The joint {missing[0]!r} is missing.", f"Send all of: {', '.join(missing)}.")
    if len(names) < convention.fewest:
        what = f"A human of {message.convention!r} has {convention.fewest} joints or more, not {len(names)}."
        raise _crooked("$.joint_names", what, "Send pelvis, head, and three joints of each arm and leg.")
    for field in ("parents", "rest_positions", "rest_rotations"):
        count = len(getattr(message, field))
        needed = convention.needs_rest and field != "rest_rotations"
        if (count or needed) and count != len(names):
            what = f"{count} entries, joint_names has {len(names)}"
            raise _crooked(f"$.{field}", f"It has {what}.", "Send one entry per joint, in the same order.")
    for k, parent in enumerate(message.parents):
        if parent >= len(names) or (parent < 0) != (k == 0):
            raise _crooked(
                f"$.parents[{k}]",
                f"The parent of {names[k]!r} is {parent}.",
                "Send -1 for joint 0, else a joint's place.",
            )
    _refuse_loops(message.parents, names)
    every = np.ones(len(names), dtype=bool)
    return Skeleton(
        message.convention,
        names,
        message.parents or None,
        _positions(message.rest_positions, names, every, "rest_positions") if message.rest_positions else None,
        _rotations(message.rest_rotations, names, "rest_rotations") if message.rest_rotations else None,
    )


def _refuse_loops(parents: Sequence[int], names: Sequence[str]) -> None:
    """Every joint must descend from joint 0."""
    sound = {-1}
    for k in range(len(parents)):
        path, at = [], k
        while at not in sound and at not in path:
            path.append(at)
            at = parents[at]
        if at not in sound:
            raise _crooked(
                f"$.parents[{k}]", f"{names[k]!r} is its own ancestor.", "Send a tree that grows from joint 0."
            )
        sound.update(path)


def validate_tracked_pose(pose: PoseMessage, skeleton: Skeleton, subjects: Sequence[str]) -> TrackedPose:
    """Check a tracker's pose against the skeleton that was sent before it.

    Raises:
        ProtocolError: naming the joint or field and the remedy. Codes "unknown_subject", "unsupported_frame",
            "unsupported_clock", "invalid_pose".
    """
    convention, names = CONVENTIONS[skeleton.convention], skeleton.joint_names
    _check_common(pose, subjects, convention.frames)
    _match("confidence", len(pose.confidence), names, allow_none=True)
    tracked = np.ones(len(names), dtype=bool)
    if pose.confidence:
        tracked = np.array(pose.confidence) >= CONFIDENT
    positions = rotations = root = None
    if convention.positions:
        _match("positions", len(pose.positions), names)
        positions = _positions(pose.positions, names, tracked, "positions")
    else:
        root = _root(pose, names[0])
    if convention.rotations:
        _match("rotations", len(pose.rotations), names)
        rotations = _rotations(pose.rotations, names, "rotations", tracked)
    return TrackedPose(root, positions, rotations, tracked)


def _check_common(pose: PoseMessage, subjects: Sequence[str], frames: Sequence[str]) -> None:
    _known("unknown_subject", "$.subject", pose.subject, subjects)
    _known("unsupported_frame", "$.frame", pose.frame, frames)
    _known("unsupported_clock", "$.clock", pose.clock, POSE_CLOCKS)
    if pose.smoothing is not None:
        _known("invalid_pose", "$.smoothing", pose.smoothing, POSE_SMOOTHINGS)
    if not np.isfinite(pose.t):
        raise _invalid("$.t", f"The capture time is {pose.t}.", "Send seconds of a steady clock.")


def _root(pose: PoseMessage, name: str) -> npt.NDArray[np.float64]:
    if pose.root is None:
        raise _invalid("$.root", f"The place of joint {name!r} is missing.", "Send its position in metres.")
    root = np.array(pose.root, dtype=np.float64)
    for axis, value in enumerate(root):
        if not abs(value) <= MAX_ROOT_DISTANCE:
            raise _invalid(
                f"$.root[{axis}]",
                f"The root of the body ({name}) is at {value} m.",
                f"Send a finite position within {MAX_ROOT_DISTANCE:g} m of the session's origin.",
            )
    return root


def _positions(
    values: Sequence[Vector], names: Sequence[str], tracked: npt.NDArray[np.bool_], field: str
) -> npt.NDArray[np.float64]:
    """(K,3) m; what is not tracked is zero."""
    places = np.array(values, dtype=np.float64).reshape(len(names), 3)
    places[~tracked] = 0.0
    wrong = np.flatnonzero(~(np.abs(places) <= MAX_ROOT_DISTANCE).all(axis=1))
    if wrong.size:
        joint = int(wrong[0])
        raise _invalid(
            f"$.{field}[{joint}]",
            f"The joint {names[joint]!r} is at {places[joint].tolist()}.",
            f"Send finite metres within {MAX_ROOT_DISTANCE:g} m of the origin, or confidence 0 while it is not seen.",
        )
    return places


def _rotations(
    values: Sequence[Quaternion], names: Sequence[str], field: str, tracked: npt.NDArray[np.bool_] | None = None
) -> npt.NDArray[np.float64]:
    """(K,4) unit quaternions; what is not tracked is the identity."""
    _match(field, len(values), names)
    rotations = np.array(values, dtype=np.float64).reshape(len(names), 4)
    if tracked is not None:
        rotations[~tracked] = (0.0, 0.0, 0.0, 1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.sqrt((rotations * rotations).sum(axis=1))
    wrong = np.flatnonzero(~(np.abs(lengths - 1.0) <= UNIT_TOLERANCE))
    if wrong.size:
        joint = int(wrong[0])
        raise _invalid(
            f"$.{field}[{joint}]",
            f"The rotation of joint {names[joint]!r} is {rotations[joint].tolist()}, not a unit quaternion.",
            "Send finite x, y, z, w of length 1; [0, 0, 0, 1] is the rest pose. Send no pose while tracking is lost.",
        )
    return rotations / lengths[:, None]


def _match(field: str, count: int, names: Sequence[str], allow_none: bool = False) -> None:
    expected = len(names)
    if count == expected or (allow_none and count == 0):
        return
    what = f"joint {names[count]!r} is the first one missing" if count < expected else "some are too many"
    raise _invalid(
        f"$.{field}",
        f"There are {count} {field} for {expected} joints; {what}.",
        "Send one entry per joint, in the order of the topology's or the skeleton's joint_names.",
    )


def _crooked(place: str, message: str, remedy: str) -> ProtocolError:
    return ProtocolError("invalid_skeleton", place, message, remedy)


def _known(code: str, place: str, value: str, known: Sequence[str]) -> None:
    if value not in known:
        raise ProtocolError(code, place, f"{value!r} is not known here.", f"Send one of: {', '.join(known)}.")


def _invalid(place: str, message: str, remedy: str) -> ProtocolError:
    return ProtocolError("invalid_pose", place, message, remedy)
