"""What a tracker doesn't see, put where an upright person has it: inverse kinematics of trunk, arms and legs.

A person who is known by head and hands alone stands upright under the head, turned as the head is, on the floor y = 0.
Elbows hang down and a little out, knees point ahead.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.tracking.observation import SIDES, Observation

EYES_FROM_HEAD = np.array([0.0, 0.06, 0.1])  # m, from our head joint to the middle between the eyes
HANGING = np.array([0.32, -1.0, 0.05])  # direction of the upper arm of a hand that is not seen, to the left
ELBOW = np.array([0.35, -1.0, -0.4])  # direction in which a left elbow lies from the line between shoulder and wrist
KNEE = np.array([0.1, 0.0, 1.0])
MIRROR = np.array([-1.0, 1.0, 1.0])
UP = np.array([0.0, 1.0, 0.0])


def complete(seen: Observation, rest: Mapping[str, np.ndarray]) -> None:
    """Add the points and turns that `seen` lacks; `rest`: our joints at rest (3,) m each."""
    if "eyes" in seen.points:
        _trunk_below_head(seen, rest)
    facing = _facing(seen)
    for side in SIDES:
        if f"{side}_hand" not in seen.points or f"{side}_forearm" not in seen.points:
            _arm(seen, rest, side, facing)
        if f"{side}_foot" not in seen.points or f"{side}_shin" not in seen.points:
            _leg(seen, rest, side, facing)


def heading(turn: np.ndarray) -> np.ndarray:
    """(4,): the turn about the vertical of someone whose head is turned by `turn`, also while looking up or down."""
    matrix = quaternions.to_matrix(turn)
    ahead, up = matrix[:, 2], matrix[:, 1]
    level = ahead - ahead[1] * up  # looking down, the top of the head points ahead
    return quaternions.from_axis_angle(UP, float(np.arctan2(level[0], level[2])))


def middle_joint(start: np.ndarray, end: np.ndarray, lengths: tuple[float, float], towards: np.ndarray) -> np.ndarray:
    """(3,) m: elbow or knee of a limb of two bones from `start` to `end`, on the side `towards` (law of cosines).

    A limb that is too short is straight.
    """
    way = end - start
    reach = max(float(np.linalg.norm(way)), 1e-6)
    ahead = way / reach
    upper, lower = lengths
    along = (upper * upper - lower * lower + reach * reach) / (2.0 * reach)
    along = min(max(along, -upper), upper)
    side = towards - ahead * (ahead @ towards)
    side = side / max(float(np.linalg.norm(side)), 1e-9)
    return start + ahead * along + side * np.sqrt(upper * upper - along * along)


def _trunk_below_head(seen: Observation, rest: Mapping[str, np.ndarray]) -> None:
    head = seen.turns["head"]
    yaw = heading(head)
    eyes = rest["head"] + EYES_FROM_HEAD
    neck = seen.points.pop("eyes") + quaternions.rotate(head, rest["neck_1"] - eyes)
    for part in ("pelvis", "left_thigh", "right_thigh", "left_upper_arm", "right_upper_arm"):
        seen.points[part] = neck + quaternions.rotate(yaw, rest[part] - rest["neck_1"])
    seen.turns |= {"pelvis": yaw, "chest": yaw}


def _facing(seen: Observation) -> np.ndarray:
    """(4,): heading of the hips."""
    if "pelvis" in seen.turns:
        return heading(seen.turns["pelvis"])
    a, b = ("left_thigh", "right_thigh") if "left_thigh" in seen.points else ("left_upper_arm", "right_upper_arm")
    left = seen.points[a] - seen.points[b]
    return quaternions.from_axis_angle(UP, float(np.arctan2(-left[2], left[0])))


def _lengths(rest: Mapping[str, np.ndarray], parts: tuple[str, str, str]) -> tuple[float, float]:
    upper, lower, end = (rest[part] for part in parts)
    return float(np.linalg.norm(lower - upper)), float(np.linalg.norm(end - lower))


def _arm(seen: Observation, rest: Mapping[str, np.ndarray], side: str, facing: np.ndarray) -> None:
    upper, fore, hand = f"{side}_upper_arm", f"{side}_forearm", f"{side}_hand"
    mirror = MIRROR if side == "right" else np.ones(3)
    lengths = _lengths(rest, (upper, fore, hand))
    shoulder = seen.points[upper]
    if hand in seen.points:
        elbow = quaternions.rotate(facing, ELBOW * mirror)
        seen.points[fore] = middle_joint(shoulder, seen.points[hand], lengths, elbow)
        return
    down = quaternions.rotate(facing, HANGING * mirror / np.linalg.norm(HANGING))
    seen.points[fore] = shoulder + lengths[0] * down
    seen.points[hand] = seen.points[fore] + lengths[1] * down


def _leg(seen: Observation, rest: Mapping[str, np.ndarray], side: str, facing: np.ndarray) -> None:
    thigh, shin, foot = f"{side}_thigh", f"{side}_shin", f"{side}_foot"
    if thigh not in seen.points:
        seen.points[thigh] = _hip(seen, rest, side, facing)
    hip = seen.points[thigh]
    ankle = hip + quaternions.rotate(facing, rest[foot] - rest[thigh])
    ankle[1] = rest[foot][1]
    knee = quaternions.rotate(facing, KNEE * (MIRROR if side == "right" else np.ones(3)))
    seen.points[shin] = middle_joint(hip, ankle, _lengths(rest, (thigh, shin, foot)), knee)
    seen.points[foot] = ankle
    seen.points[f"{side}_toes"] = ankle + quaternions.rotate(facing, rest[f"{side}_toes"] - rest[foot])


def _hip(seen: Observation, rest: Mapping[str, np.ndarray], side: str, facing: np.ndarray) -> np.ndarray:
    """(3,) m: a hip that is not seen, from the pelvis or from below the shoulders."""
    if "pelvis" in seen.points:
        return seen.points["pelvis"] + quaternions.rotate(facing, rest[f"{side}_thigh"] - rest["pelvis"])
    shoulder = f"{side}_upper_arm"
    return seen.points[shoulder] + quaternions.rotate(facing, rest[f"{side}_thigh"] - rest[shoulder])
