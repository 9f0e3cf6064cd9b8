"""Poses of a clip that can't follow each other: a calibration pose ahead of the motion, a jump in its midst.

Exporters put the rest pose, all rotations zero, ahead of the motion as its first frame; cgspeed's conversions of CMU's
clips do. Nobody moves from there to the second frame in its time, and no cloth would follow. Ours.
"""

from __future__ import annotations

import numpy as np

from tryon_solver.body.bvh import BvhClip
from tryon_solver.body.skeletons import RetargetError, SkeletonParts

LONGEST_JUMP, FASTEST_JUMP = 1.0, 30.0  # m from frame to frame and m/s: beyond both nobody moves, a marker was lost
JOINT_SPEED_MAX = 30.0  # m/s about the pelvis: feet that kick and hands that throw come to some 25; as of meshes
JOINT_JUMP = 0.2  # m from frame to frame: less is noise at a high frame rate, and whirls nobody's limbs
ODD_START = 10.0  # m/s that nobody has out of a standstill within a frame ...
ODD_RATIO = 4.0  # ... to lose so much of it in the next one again
START = 0.25  # s of the motion after a first pose that tell how fast it begins
STANDSTILL = 1e-4  # m from frame to frame
HELD_MAX = 1.0  # s that a calibration pose is held


def find_start(clip: BvhClip, parts: SkeletonParts) -> tuple[int, str]:
    """The frame, from 0, with which the motion begins, and what is left out before it, for people; 0 and "" if nothing.

    Left out is the first frame, or the first few equal ones, from which a joint jumps into the motion: faster about
    the pelvis than anybody, or at over 10 m/s and four times as fast as any joint in the quarter of a second after; or
    from which the pelvis jumps away.
    """
    steps, moved = _steps(clip, parts)
    moving = np.flatnonzero(np.maximum(steps.max(axis=1, initial=0.0), moved) > STANDSTILL)
    if not moving.size or moving[0] * clip.dt > HELD_MAX:
        return 0, ""
    last = int(moving[0])
    fastest = float(steps[last].max()) / clip.dt
    after = float(steps[last + 1 : last + 1 + max(1, round(START / clip.dt))].max(initial=0.0)) / clip.dt
    joints, pelvis = _jumps(steps[last : last + 1], moved[last : last + 1], clip.dt)
    odd = steps[last].max() > JOINT_JUMP and fastest > max(ODD_START, ODD_RATIO * after)
    if not (odd or joints[0] or pelvis[0]):
        return 0, ""
    frames = "its first frame is" if last == 0 else f"its first {last + 1} frames are"
    if odd or joints[0]:
        how = f"from there {_worst(clip, parts, steps, last)}, up to {after:.3g} m/s after it"
    else:
        how = f"from there the pelvis jumps {moved[last]:.3g} m in {clip.dt:.3g} s"
    return last + 1, f"{frames} a pose apart, as for calibration: {how}. Left out, it begins with frame {last + 2}"


def refuse_jumps(clip: BvhClip, parts: SkeletonParts, start: int = 0) -> None:
    """A body that is elsewhere in the next frame, or a limb, would tear its clothes off, not wear them.

    Raises RetargetError naming the first two such frames from `start` on, counted from 1, and the joint.
    """
    steps, moved = _steps(clip, parts)
    joints, pelvis = _jumps(steps, moved, clip.dt)
    jumps = np.flatnonzero(joints | pelvis)
    jumps = jumps[jumps >= start]
    if not jumps.size:
        return
    first = int(jumps[0])
    what = f"the pelvis jumps {moved[first]:.3g} m in {clip.dt:.3g} s"
    if not pelvis[first]:
        what = _worst(clip, parts, steps, first)
    raise RetargetError(f"from frame {first + 1} to frame {first + 2} {what}; cut the motion there, or mend the frame")


def _steps(clip: BvhClip, parts: SkeletonParts) -> tuple[np.ndarray, np.ndarray]:
    """How far from frame to frame: each part's joint about the pelvis (T - 1, parts) m, and the pelvis (T - 1,) m."""
    positions, _ = clip.world()
    pelvis = positions[:, parts.joints["pelvis"]]
    about = positions[:, list(parts.joints.values())] - pelvis[:, None]
    return np.linalg.norm(np.diff(about, axis=0), axis=2), np.linalg.norm(np.diff(pelvis, axis=0), axis=1)


def _jumps(steps: np.ndarray, moved: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """(T - 1,) each: whether a joint jumps about the pelvis, and whether the pelvis does."""
    furthest = steps.max(axis=1, initial=0.0)
    joints = (furthest > JOINT_JUMP) & (furthest > JOINT_SPEED_MAX * dt)
    return joints, (moved > LONGEST_JUMP) & (moved > FASTEST_JUMP * dt)


def _worst(clip: BvhClip, parts: SkeletonParts, steps: np.ndarray, frame: int) -> str:
    worst = int(steps[frame].argmax())
    name, step = clip.joint_names[list(parts.joints.values())[worst]], float(steps[frame, worst])
    return f"the joint {name!r} jumps {step:.3g} m about the pelvis in {clip.dt:.3g} s, at {step / clip.dt:.3g} m/s"
