"""Whether a tracker's numbers can be a person's, in metres: not pixels, centimetres or a tracker that sees nobody.

One limb that is wrong is a tracker's noise, and only its direction is used; when most of them are, the pose is none.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tryon_protocol import ProtocolError, Skeleton, TrackedPose

LENGTH_FACTOR = 2.0  # a bone that is so many times too long or too short is not of this person
STATURES = (1.0, 2.2)  # m, of people who stand alone and those who hardly fit a door
ROOT_STATURES_MAX = 10.0  # the root of nobody who stands on the session's floor is so many statures above or below it
SMPL_STATURE = 1.7  # m, of who sends no rest pose
REST_SHARE = 0.05  # of the stature: a shorter bone of a rest pose says nothing
# Bones by their ends, as shares of the stature: Winter, Biomechanics and Motor Control of Human Movement, figure 4.1.
UPPER_ARM, FOREARM, THIGH, SHIN = 0.186, 0.146, 0.245, 0.246
Bones = dict[tuple[str, str], tuple[float, float]]


def _limbs(arm: tuple[str, str, str], leg: tuple[str, str, str]) -> Bones:
    bones: Bones = {}
    for side in ("left", "right"):
        for (a, b, c), (upper, lower) in ((arm, (UPPER_ARM, FOREARM)), (leg, (THIGH, SHIN))):
            bones[a.format(side), b.format(side)] = (upper, upper)
            bones[b.format(side), c.format(side)] = (lower, lower)
    return bones


BONES: dict[str, Bones] = {
    "webxr": _limbs(
        ("{}-arm-upper", "{}-arm-lower", "{}-hand-wrist"), ("{}-upper-leg", "{}-lower-leg", "{}-foot-ankle")
    ),
    "mediapipe": _limbs(("{}_shoulder", "{}_elbow", "{}_wrist"), ("{}_hip", "{}_knee", "{}_ankle")),
}  # not of "head-hands": controllers may lie on a table


class Measures:
    """What lengths the poses of a skeleton must have: its own, or those of people where it tells none."""

    def __init__(self, skeleton: Skeleton) -> None:
        self._names = names = skeleton.joint_names
        bones = BONES.get(skeleton.convention, {})
        present = [pair for pair in bones if pair[0] in names and pair[1] in names]
        self._ends = np.array([[names.index(a), names.index(b)] for a, b in present], dtype=int).reshape(-1, 2)
        shares = np.array([bones[pair] for pair in present]).reshape(-1, 2)
        self._shortest, self._longest = shares[:, 0] * STATURES[0], shares[:, 1] * STATURES[1]
        rest = skeleton.rest_positions
        if rest is not None:
            own = self._lengths(rest)
            told = own > REST_SHARE * STATURES[0]
            self._shortest, self._longest = (np.where(told, own, of) for of in (self._shortest, self._longest))
        self._stature = SMPL_STATURE if rest is None else float(np.ptp(rest[:, 1]))

    def check(self, pose: TrackedPose) -> None:
        """Raises ProtocolError naming a joint when most of a pose's limbs, or its root's height, are no person's."""
        if pose.positions is not None:
            self._check_limbs(pose.positions, pose.tracked)
        if pose.root is not None and abs(pose.root[1]) > ROOT_STATURES_MAX * self._stature > 0.0:
            raise _unusable(
                "$.root[1]",
                f"The joint {self._names[0]!r} is {pose.root[1]:.4g} m above the floor, more than "
                f"{ROOT_STATURES_MAX:g} times as high as the skeleton is tall ({self._stature:.3g} m).",
            )

    def _check_limbs(self, positions: npt.NDArray[np.float64], tracked: npt.NDArray[np.bool_]) -> None:
        seen = tracked[self._ends].all(axis=1)
        lengths = self._lengths(positions)
        wrong = seen & ((lengths * LENGTH_FACTOR < self._shortest) | (lengths > self._longest * LENGTH_FACTOR))
        if 2 * np.count_nonzero(wrong) <= np.count_nonzero(seen):
            return
        bone = int(np.flatnonzero(wrong)[0])
        start, end = self._ends[bone]
        low, high = self._shortest[bone], self._longest[bone]
        raise _unusable(
            f"$.positions[{end}]",
            f"The joint {self._names[end]!r} is {lengths[bone]:.3g} m from {self._names[start]!r}, where "
            f"{low:.2g} m to {high:.2g} m are expected, and most limbs are as wrong.",
        )

    def _lengths(self, positions: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return np.asarray(np.linalg.norm(positions[self._ends[:, 1]] - positions[self._ends[:, 0]], axis=1))


def _unusable(place: str, message: str) -> ProtocolError:
    remedy = "Send metres, not centimetres or pixels; send no pose, or confidence 0, while the tracker sees nobody."
    return ProtocolError("invalid_pose", place, message, remedy)
