"""A root whose positions are in another unit than the bones: found by the steps that its feet take.

A foot that carries stays where it is, so the pelvis goes as far as that foot goes back under it. With p the pelvis and
f the lower foot about it, p' = -f' while it stands: least squares over the clip say how many times as far the root
would have to go, s = sum(-df dp) / sum(dp dp). People who walk, run, jump, squat and turn have s from 0.45 to 1.05; a
root in metres over bones in centimetres has a hundred times that. Ours.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tryon_solver.body.bvh import BvhClip
from tryon_solver.body.skeletons import SkeletonParts
from tryon_solver.body.standing_rest import FILE_AXES, upward_axis

STRIDE = 0.05  # s over which steps are compared: noise of one frame is none
STRIDES_MIN = 20
STEP = 2e-3  # m, root mean square of the carrying foot's way in a stride: less tells nothing
ALIKE = 0.7  # correlation of both; of people who run it is 0.76
OFF = 5.0  # times too far or too little, beyond which it is another unit: above inches to centimetres
FITS = (0.45, 1.3)  # share of a power of ten, or of what it would be, that is taken for it
LARGEST_POWER = 3


def with_root_unit(clip: BvhClip, parts: SkeletonParts, up_told: str | None = None) -> tuple[BvhClip, str]:
    """The clip with its root's positions in the unit of its bones, and what was done or is suspected, for people.

    Mended is what is off by a power of ten, as metres, centimetres and millimetres are; anything else is told alone;
    "" where root and feet agree or nothing tells. `up_told`: as of standing_rest.with_standing_rest.
    """
    off = _off(clip, parts, up_told)
    if off is None or 1 / OFF < off < OFF:
        return clip, ""
    power = int(np.round(np.log10(off)))
    factor = 10.0**power
    times, way = (f"{factor:g}", "little") if power > 0 else (f"{1 / factor:g}", "far")
    if not (FITS[0] < off / factor < FITS[1] and 0 < abs(power) <= LARGEST_POWER):
        times = f"{max(off, 1 / off):.3g}"
        return clip, f"its root goes about {times} times too {way} for its feet's steps: its unit may be another"
    path = [joint for joint in _path(clip, parts) if np.ptp(clip.positions[:, joint], axis=0).any()]
    positions = clip.positions.copy()
    positions[:, path] *= factor
    told = f"its root went {times} times too {way} for its feet's steps, as if in another unit than its bones"
    done = f"its positions were {'multiplied' if power > 0 else 'divided'} by {times}"
    return replace(clip, positions=positions), f"{told}: {done}"


def _off(clip: BvhClip, parts: SkeletonParts, up_told: str | None) -> float | None:
    """How many times as far the root would have to go; None where nothing tells."""
    stride = max(1, round(STRIDE / clip.dt))
    if clip.frame_count < stride + STRIDES_MIN:
        return None
    up = np.array(FILE_AXES[upward_axis(clip, parts, up_told)[0].lower()])
    positions, _ = clip.world()
    pelvis = positions[:, parts.joints["pelvis"]]
    feet = positions[:, [parts.joints["left_foot"], parts.joints["right_foot"]]] - pelvis[:, None]
    lower = (feet @ up).argmin(axis=1)
    frames = np.flatnonzero(lower[:-stride] == lower[stride:])
    back = feet[frames, lower[frames]] - feet[frames + stride, lower[frames]]
    went = pelvis[frames + stride] - pelvis[frames]
    if len(frames) < STRIDES_MIN or np.sqrt((back**2).sum(axis=1).mean()) < STEP or not went.any():
        return None
    together = float((back * went).sum())
    if together < ALIKE * float(np.sqrt((back**2).sum() * (went**2).sum())):
        return None
    return together / float((went**2).sum())


def _path(clip: BvhClip, parts: SkeletonParts) -> list[int]:
    """The pelvis and what carries it."""
    path = [parts.joints["pelvis"]]
    while clip.parents[path[-1]] >= 0:
        path.append(int(clip.parents[path[-1]]))
    return path
