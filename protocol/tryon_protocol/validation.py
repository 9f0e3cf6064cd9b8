"""What a well-formed message must also satisfy before the simulation may see it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from .errors import ProtocolError
from .messages import POSE_CONVENTION, POSE_FRAME, PoseMessage

MAX_ROOT_DISTANCE = 1.0e5
"""m. The grid of int32 units of 1/16 mm spans 134 km; a root farther than this from the session's origin is refused."""
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
            "unsupported_frame", "invalid_pose".
    """
    _known("unknown_subject", "$.subject", pose.subject, subjects)
    _known("unsupported_convention", "$.convention", pose.convention, [POSE_CONVENTION])
    _known("unsupported_frame", "$.frame", pose.frame, [POSE_FRAME])
    if not np.isfinite(pose.t):
        raise _invalid("$.t", f"The capture time is {pose.t}.", "Send seconds of a steady clock.")
    root = np.array(pose.root, dtype=np.float64)
    for axis, value in enumerate(root):
        if not abs(value) <= MAX_ROOT_DISTANCE:
            raise _invalid(
                f"$.root[{axis}]",
                f"The root of the body ({joint_names[0]}) is at {value} m.",
                f"Send a finite position within {MAX_ROOT_DISTANCE:g} m of the session's origin.",
            )
    expected, count = len(joint_names), len(pose.rotations)
    if count != expected:
        what = f"joint {joint_names[count]!r} is the first one missing" if count < expected else "some are too many"
        raise _invalid(
            "$.rotations",
            f"The pose has {count} rotations, the body has {expected} joints; {what}.",
            "Send one quaternion per joint, in the order of the topology's joint_names.",
        )
    rotations = np.array(pose.rotations, dtype=np.float64).reshape(expected, 4)
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.sqrt((rotations * rotations).sum(axis=1))
    wrong = np.flatnonzero(~(np.abs(lengths - 1.0) <= UNIT_TOLERANCE))
    if wrong.size:
        joint = int(wrong[0])
        raise _invalid(
            f"$.rotations[{joint}]",
            f"The rotation of joint {joint_names[joint]!r} is {rotations[joint].tolist()}, not a unit quaternion.",
            "Send finite x, y, z, w of length 1; [0, 0, 0, 1] is the rest pose. Send no pose while tracking is lost.",
        )
    return root, rotations / lengths[:, None]


def _known(code: str, place: str, value: str, known: Sequence[str]) -> None:
    if value not in known:
        raise ProtocolError(code, place, f"{value!r} is not known here.", f"Send one of: {', '.join(known)}.")


def _invalid(place: str, message: str, remedy: str) -> ProtocolError:
    return ProtocolError("invalid_pose", place, message, remedy)
