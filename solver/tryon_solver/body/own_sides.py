"""Left and right as the body itself has them, where a file's names have them the other way round.

An export that negates an axis leaves a person whose joints named left are on the right. Nothing in the names tells, but
the body does: knees bend ahead and toes point ahead, and left of ahead is left. Sides that contradict both are swapped,
else the person would be turned round, walk backwards and have its feet wrung. Ours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tryon_solver.body.bvh import BvhClip
from tryon_solver.body.skeletons import SIDES, RetargetError, SkeletonParts
from tryon_solver.body.standing_rest import FILE_AXES, looked_at

FACINGS = FILE_AXES  # of a body
FACES = 0.5  # cosine, beyond which somebody faces along an axis
BENT = 0.05  # of a leg's length by which a knee is off the line from hip to ankle at least
BENT_POSES = 5  # so many at least tell
ALIKE = 0.9  # share of the bent knees that bend the same way: they bend one way only
POINTING = 0.5  # cosine, of toes with ahead, beyond which they point


def with_own_sides(clip: BvhClip, parts: SkeletonParts) -> tuple[SkeletonParts, str]:
    """The parts with left and right as the body has them, and what was done, for people; "" where nothing was.

    `clip` stands in its rest pose (`with_standing_rest`).
    """
    knees, toes = _knees(clip, parts), _toes(clip, parts)
    if min(knees, toes) >= 0 or max(knees, toes) > 0:
        return parts, ""
    told = " and ".join(what for what, way in (("its knees bend", knees), ("its toes point", toes)) if way)
    name = clip.joint_names[parts.joints["left_upper_arm"]]
    return _swapped(parts), (
        f"its joints named left, as {name!r}, are on its right, by how {told}: it was mirrored, or they are named the "
        "wrong way round; they move the right side"
    )


def with_told_facing(clip: BvhClip, parts: SkeletonParts, facing: str) -> tuple[SkeletonParts, str]:
    """The same where it is told which axis of the file, one of `FACINGS`, the person faces along in the first frame of
    `clip`, as it is in the file. Raises RetargetError when that is none that the sides can tell."""
    first = replace(clip, positions=clip.positions[:1], rotations=clip.rotations[:1]).world()[0][0]
    ahead = _ahead({name: first[joint] for name, joint in parts.joints.items()})
    along = float(ahead @ np.array(FACINGS[facing]))
    if abs(along) < FACES:
        found = max(FACINGS, key=lambda axis: float(ahead @ np.array(FACINGS[axis])))
        raise RetargetError(
            f"in its first frame it can't face along {facing}, as told: by the names of its joints it faces along "
            f"{found}, or the other way if they are the wrong way round. Say one of these with --motion-facing"
        )
    name = clip.joint_names[parts.joints["left_upper_arm"]]
    if along > 0.0:
        return parts, f"it faces along {facing} in its first frame, as told and by the names of its joints"
    return _swapped(parts), (
        f"its joints named left, as {name!r}, are on its right, as it faces along {facing} in its first frame, as "
        "told: they move the right side"
    )


def _knees(clip: BvhClip, parts: SkeletonParts) -> int:
    """1 where knees bend ahead of a body whose left is where the names say, -1 where they bend back, 0: not told."""
    _, positions = looked_at(clip)
    at = {name: positions[:, joint] for name, joint in parts.joints.items()}
    left = _unit(at["left_thigh"] - at["right_thigh"])
    bends = []
    for side in SIDES:
        hip, knee, ankle = (at[f"{side}_{part}"] for part in ("thigh", "shin", "foot"))
        ahead = np.cross(left, _unit(hip - ankle))
        length = np.linalg.norm(knee - hip, axis=1) + np.linalg.norm(ankle - knee, axis=1)
        bends.append(np.einsum("td,td->t", knee - hip, ahead) / length)
    bent = np.concatenate(bends)
    bent = bent[np.abs(bent) > BENT]
    if len(bent) < BENT_POSES:
        return 0
    share = float(np.mean(bent > 0.0))
    return int(share >= ALIKE) - int(share <= 1.0 - ALIKE)


def _toes(clip: BvhClip, parts: SkeletonParts) -> int:
    """The same of the toes in the rest pose, or of the tips of feet without toes."""
    rest = clip.rest_positions()
    at = {name: rest[joint] for name, joint in parts.joints.items()}
    ahead = _ahead(at)
    ways = []
    for side in SIDES:
        foot = parts.joints[f"{side}_foot"]
        toes = at[f"{side}_toes"] - at[f"{side}_foot"] if f"{side}_toes" in at else clip.end_sites.get(foot)
        ways.append(0.0 if toes is None else float(_unit(toes) @ ahead))
    return int(min(ways) > POINTING) - int(max(ways) < -POINTING)


def _ahead(at: Mapping[str, np.ndarray]) -> np.ndarray:
    """(3,) unit: where a body with these joints (3,) m faces, by its sides."""
    left = at["left_thigh"] - at["right_thigh"] + at["left_upper_arm"] - at["right_upper_arm"]
    up = at["left_upper_arm"] + at["right_upper_arm"] - at["left_foot"] - at["right_foot"]
    return _unit(np.cross(left, up))


def _swapped(parts: SkeletonParts) -> SkeletonParts:
    other = dict(zip(SIDES, reversed(SIDES)))

    def of_other(part: str) -> str:
        side, _, limb = part.partition("_")
        return f"{other[side]}_{limb}" if side in other else part

    joints = {of_other(part): joint for part, joint in parts.joints.items()}
    return replace(parts, joints=joints, clavicles={other[side]: k for side, k in parts.clavicles.items()})


def _unit(x: np.ndarray) -> np.ndarray:
    return x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), 1e-12)
