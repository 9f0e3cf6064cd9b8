"""Whether a tracker's numbers can be a person's, in metres: not pixels, centimetres or a tracker that sees nobody; and
whether they are of the place that their frame is of.

One limb that is wrong is a tracker's noise, and only its direction is used; when most of them are, the pose is none.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tryon_protocol import POSE_FRAME, ProtocolError, Skeleton, TrackedPose
from tryon_protocol.conventions import IMAGE_FRAME

LENGTH_FACTOR = 2.0  # a bone that is so many times too long or too short is not of this person
STATURES = (1.0, 2.2)  # m, of people who stand alone and those who hardly fit a door
ROOT_STATURES_MAX = 10.0  # the root of nobody who stands on the session's floor is so many statures above or below it
SMPL_STATURE = 1.7  # m, of who sends no rest pose
ANYBODY = (0.5, 3.0)  # m, how tall a rest pose may say that its person is: from under a child of 0.7 m to over a giant
GROWN = (1.0, 2.6)  # m, of whom a unit is told that was not meant
UNITS = {"centimetres": 100.0, "inches": 39.37, "feet": 1.0 / 0.3048, "decimetres": 10.0, "millimetres": 1000.0}
HIPS_OFF = 0.25  # m, from the middle of the hips to the origin of world landmarks, where it lies but for noise
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
    "smpl": _limbs(("{}_shoulder", "{}_elbow", "{}_wrist"), ("{}_hip", "{}_knee", "{}_ankle")),
}  # not of "head-hands": controllers may lie on a table


class Measures:
    """What lengths the poses of a skeleton must have: its own, or those of people where it tells none.

    Raises ProtocolError naming the unit when the lengths that it tells are nobody's in metres.
    """

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
            if told.any():
                _refuse_nobody(float(np.median(own[told] / shares[told, 0])))
            elif skeleton.convention == "bvh":
                _refuse_nobody(float(np.ptp(rest, axis=0).max()))
            self._shortest, self._longest = (np.where(told, own, of) for of in (self._shortest, self._longest))
        alone = skeleton.convention == "head-hands"
        self._viewer = names.index("viewer") if alone else None  # it has no limb that would tell its unit
        self._stature = SMPL_STATURE if rest is None or alone else float(np.ptp(rest[:, 1]))

    def check(self, pose: TrackedPose, frame: str = POSE_FRAME) -> None:
        """Raises ProtocolError naming a joint when most of a pose's limbs, or its root's height, are no person's, or
        the hips are not where its frame has them."""
        if pose.positions is not None:
            if frame == IMAGE_FRAME:
                self._refuse_picture(pose.positions, pose.tracked)
            self._check_limbs(pose.positions, pose.tracked)
        if pose.root is not None:
            self._check_height("$.root[1]", 0, pose.root)
        if pose.positions is not None and self._viewer is not None:
            self._check_height(f"$.positions[{self._viewer}]", self._viewer, pose.positions[self._viewer])

    def _check_height(self, place: str, joint: int, at: npt.NDArray[np.float64]) -> None:
        if abs(at[1]) > ROOT_STATURES_MAX * self._stature > 0.0:
            raise _unusable(
                place,
                f"The joint {self._names[joint]!r} is {at[1]:.4g} m above the floor, more than "
                f"{ROOT_STATURES_MAX:g} times as high as the skeleton is tall ({self._stature:.3g} m).",
            )

    def _refuse_picture(self, positions: npt.NDArray[np.float64], tracked: npt.NDArray[np.bool_]) -> None:
        """Raises ProtocolError for landmarks of a picture, whose origin is its corner, in place of world landmarks."""
        hips = [self._names.index(f"{side}_hip") for side in ("left", "right")]
        middle = positions[hips].mean(axis=0)
        if tracked[hips].all() and np.linalg.norm(middle) > HIPS_OFF:
            raise ProtocolError(
                "invalid_pose",
                f"$.positions[{hips[0]}]",
                f"The middle of the hips is at {np.round(middle, 2).tolist()}; in {IMAGE_FRAME!r} it is the origin.",
                "Send pose_world_landmarks [m], not pose_landmarks, which are of the picture; or places in the room, Y "
                f"up, with the frame {POSE_FRAME!r}.",
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


def _refuse_nobody(size: float) -> None:
    """Raises ProtocolError for a rest pose of somebody of this size [m]; 0: it tells nothing."""
    if size == 0.0 or ANYBODY[0] <= size <= ANYBODY[1]:
        return
    fitting = {name: size / per_metre for name, per_metre in UNITS.items() if GROWN[0] <= size / per_metre <= GROWN[1]}
    what, remedy = f"The rest pose is of somebody {size:.3g} m tall.", "Send metres."
    if fitting:
        unit = min(fitting, key=lambda name: abs(np.log(fitting[name] / SMPL_STATURE)))
        remedy = (
            f"Send metres: in {unit} it is somebody {fitting[unit]:.2f} m tall; divide these and the poses' places by "
            f"{UNITS[unit]:.4g}."
        )
    raise ProtocolError("invalid_skeleton", "$.rest_positions", what, remedy)


def _unusable(place: str, message: str) -> ProtocolError:
    remedy = "Send metres, not centimetres or pixels; send no pose, or confidence 0, while the tracker sees nobody."
    return ProtocolError("invalid_pose", place, message, remedy)
