"""Motions in which hardly a joint turns: angles written in radians, or nothing that moves at all. Ours."""

from __future__ import annotations

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.bvh import BvhClip
from tryon_solver.body.skeletons import SkeletonParts

LEAST_TURN = 2.0 * np.pi  # degrees: a whole turn in radians; who does anything turns some joint by more
SWAY = 0.3  # m that who stands on the spot goes at most
UNMOVED = 1e-6  # m and rad


def stillness(clip: BvhClip, parts: SkeletonParts) -> str:
    """What there is to say, for people, of a clip in which no joint turns, or hardly; else "".

    The pelvis and what carries it are left out: who goes in circles turns these without end.
    """
    if clip.frame_count < 2:
        return ""
    carries = parts.joints["pelvis"]
    inner = np.ones(len(clip.joint_names), dtype=bool)
    while carries >= 0:
        inner[carries], carries = False, int(clip.parents[carries])
    pelvis = clip.world()[0][:, parts.joints["pelvis"]]
    way = float(np.linalg.norm(np.ptp(pelvis, axis=0)))
    turns = quaternions.angle_of(quaternions.multiply(quaternions.conjugate(clip.rotations[:1]), clip.rotations))
    turn, stretch = float(turns[:, inner].max()), float(np.ptp(clip.positions[:, inner], axis=0).max())
    if max(turn, stretch) < UNMOVED:
        still = max(way, float(turns.max())) < UNMOVED
        return f"nothing moves: its {clip.frame_count} frames are all alike" if still else "nothing moves but its root"
    degrees = float(np.degrees(turn))
    if degrees >= LEAST_TURN or turn < UNMOVED:
        return ""
    although = f" although the body moves by {way:.2f} m" if way > SWAY else ""
    return f"no joint turns by more than {degrees:.2g} degrees{although}: are its angles in radians? BVH has degrees"
