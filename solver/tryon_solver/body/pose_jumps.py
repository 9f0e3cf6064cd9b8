"""Poses of a clip that can't follow each other: a calibration pose ahead of the motion, a jump in its midst.

Exporters put the rest pose, all rotations zero, ahead of the motion as its first frame; cgspeed's conversions of CMU's
clips do. Nobody moves from there to the second frame in its time, and no cloth would follow. Ours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tryon_solver.body.bvh import BvhClip
from tryon_solver.body.skeletons import RetargetError, SkeletonParts

SHORTEST = 1e-9  # m, a direction is not read off anything shorter
LONGEST_JUMP, FASTEST_JUMP = 1.0, 30.0  # m from frame to frame and m/s: beyond both nobody moves, a marker was lost
JOINT_SPEED_MAX = 30.0  # m/s about the pelvis: feet that kick and hands that throw come to some 25; as of meshes
JOINT_JUMP = 0.2  # m from frame to frame: less is noise at a high frame rate, and whirls nobody's limbs
ODD_START = 10.0  # m/s that nobody has out of a standstill within a frame ...
ODD_RATIO = 4.0  # ... to lose so much of it in the next one again
ODD_LIMB, ODD_LIMB_SPEED = 0.5, 18.0  # m and m/s, the same in the midst of a motion: less is a blow
ODD_LEAP, ODD_LEAP_SPEED = 0.3, 8.0  # m and m/s of the pelvis, which no muscle gives and takes within a frame
ODD_TURN, ODD_TURN_SPEED = 45.0, 2000.0  # degrees and degrees/s of the trunk: a skater's 1800 take a second to reach
START = 0.25  # s before and after a step that tell how fast it is by itself
STANDSTILL = 1e-4  # m from frame to frame
HELD_MAX = 1.0  # s that a calibration pose is held


@dataclass(frozen=True)
class _Steps:
    """How far from frame to frame, and over two frames at once for what goes there and back."""

    joints: np.ndarray  # (T - 1, parts) m, each part's joint about the pelvis
    joints_over_two: np.ndarray  # (T - 2,) m, the furthest of them
    pelvis: np.ndarray  # (T - 1,) m
    pelvis_over_two: np.ndarray  # (T - 2,) m
    turns: np.ndarray  # (T - 1,) degrees, the trunk
    turns_over_two: np.ndarray  # (T - 2,) degrees
    dt: float  # s

    @property
    def furthest(self) -> np.ndarray:
        """(T - 1,) m: of the joint that goes furthest."""
        return self.joints.max(axis=1, initial=0.0)


def find_start(clip: BvhClip, parts: SkeletonParts) -> tuple[int, str]:
    """The frame, from 0, with which the motion begins, and what is left out before it, for people; 0 and "" if nothing.

    Left out is the first frame, or the first few equal ones, from which a joint jumps into the motion: faster about
    the pelvis than anybody, or at over 10 m/s and four times as fast as any joint in the quarter of a second after; or
    from which the pelvis jumps away, or the trunk turns round, as nobody does.
    """
    steps = _steps(clip, parts)
    last = _first_step(steps)
    if last is None or last * clip.dt > HELD_MAX:
        return 0, ""
    joints, pelvis, turns = (bool(jump[last]) for jump in _jumps(steps, last))
    if not (joints or pelvis or turns):
        return 0, ""
    frames = "its first frame is" if last == 0 else f"its first {last + 1} frames are"
    how = f"from there {_said(clip, parts, steps, last, pelvis and not joints, turns and not joints)}"
    if joints:
        after = float(steps.furthest[last + 1 : last + 1 + _window(clip.dt)].max(initial=0.0)) / clip.dt
        how += f", up to {after:.3g} m/s after it"
    return last + 1, f"{frames} a pose apart, as for calibration: {how}. Left out, it begins with frame {last + 2}"


def refuse_jumps(clip: BvhClip, parts: SkeletonParts, start: int = 0) -> None:
    """A body that is elsewhere in the next frame, or turned round, or a limb, would tear its clothes off.

    A step is a jump where nobody is so fast, or where it is by itself: four times as fast as all others in the quarter
    of a second before and after, alone or with the one that takes it back. So a run, a spin or a cartwheel is none at
    any frame rate. Raises RetargetError naming the first two such frames from `start` on, counted from 1, and the
    joint.
    """
    steps = _steps(clip, parts)
    joints, pelvis, turns = _jumps(steps, _first_step(steps))
    jumps = np.flatnonzero(joints | pelvis | turns)
    jumps = jumps[jumps >= start]
    if not jumps.size:
        return
    first = int(jumps[0])
    what = _said(clip, parts, steps, first, bool(pelvis[first] and not joints[first]), bool(turns[first]))
    raise RetargetError(f"from frame {first + 1} to frame {first + 2} {what}; cut the motion there, or mend the frame")


def _steps(clip: BvhClip, parts: SkeletonParts) -> _Steps:
    positions, _ = clip.world()
    pelvis = positions[:, parts.joints["pelvis"]]
    about = positions[:, list(parts.joints.values())] - pelvis[:, None]
    axes = _trunk_axes({part: positions[:, joint] for part, joint in parts.joints.items()})
    return _Steps(
        joints=np.linalg.norm(about[1:] - about[:-1], axis=2),
        joints_over_two=np.linalg.norm(about[2:] - about[:-2], axis=2).max(axis=1, initial=0.0),
        pelvis=np.linalg.norm(pelvis[1:] - pelvis[:-1], axis=1),
        pelvis_over_two=np.linalg.norm(pelvis[2:] - pelvis[:-2], axis=1),
        turns=_angles(axes[:-1], axes[1:]),
        turns_over_two=_angles(axes[:-2], axes[2:]),
        dt=clip.dt,
    )


def _trunk_axes(at: Mapping[str, np.ndarray]) -> np.ndarray:
    """(T, 3, 3): rows to the left, up and ahead of the trunk, by hips and shoulders (T, 3) m."""
    up = at["left_upper_arm"] + at["right_upper_arm"] - at["left_thigh"] - at["right_thigh"]
    left = at["left_thigh"] - at["right_thigh"] + at["left_upper_arm"] - at["right_upper_arm"]
    up = up / np.maximum(np.linalg.norm(up, axis=1, keepdims=True), SHORTEST)
    left = left - np.einsum("td,td->t", left, up)[:, None] * up
    left = left / np.maximum(np.linalg.norm(left, axis=1, keepdims=True), SHORTEST)
    return np.stack([left, up, np.cross(left, up)], axis=1)


def _angles(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """(T,) degrees between axes (T, 3, 3)."""
    cosines = 0.5 * (np.einsum("tij,tij->t", before, after) - 1.0)
    return np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))


def _window(dt: float) -> int:
    return max(1, round(START / dt))


def _first_step(steps: _Steps) -> int | None:
    """The step with which a clip that may begin with a pose that is held first moves."""
    moving = np.flatnonzero(np.maximum(steps.furthest, steps.pelvis) > STANDSTILL)
    return int(moving[0]) if moving.size else None


def _jumps(steps: _Steps, first: int | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(T - 1,) each: whether a joint jumps about the pelvis, the pelvis does, and the trunk turns round at once.

    `first`: the step out of the pose with which the clip begins.
    """
    furthest, dt = steps.furthest, steps.dt
    joints = (furthest > JOINT_JUMP) & (furthest > JOINT_SPEED_MAX * dt)
    joints |= _lonely(furthest, steps.joints_over_two, dt, ODD_LIMB, ODD_LIMB_SPEED)
    if first is not None:
        joints[first] |= _lonely(furthest, steps.joints_over_two, dt, JOINT_JUMP, ODD_START)[first]
    pelvis = (steps.pelvis > LONGEST_JUMP) & (steps.pelvis > FASTEST_JUMP * dt)
    pelvis |= _lonely(steps.pelvis, steps.pelvis_over_two, dt, ODD_LEAP, ODD_LEAP_SPEED)
    return joints, pelvis, _lonely(steps.turns, steps.turns_over_two, dt, ODD_TURN, ODD_TURN_SPEED)


def _lonely(steps: np.ndarray, over_two: np.ndarray, dt: float, furthest: float, fastest: float) -> np.ndarray:
    """(T - 1,) whether a step is by itself, among those that go further than `furthest` and are faster than `fastest`.

    A frame that is elsewhere alone makes two such steps, there and back, and hardly one over both.
    """
    lonely = np.zeros(len(steps), bool)
    wide = _window(dt)
    large = (steps > furthest) & (steps > fastest * dt)
    for k in np.flatnonzero(large):
        for end in (k + 1, k + 2):
            if not large[k:end].all() or end > len(steps):
                continue
            others = np.concatenate([steps[max(k - wide, 0) : k], steps[end : end + wide], over_two[k : end - 1] / 2])
            if steps[k:end].min() > ODD_RATIO * others.max(initial=0.0):
                lonely[k:end] = True
    return lonely


def _said(clip: BvhClip, parts: SkeletonParts, steps: _Steps, frame: int, pelvis: bool, turn: bool) -> str:
    """What jumps there."""
    if pelvis:
        return f"the pelvis jumps {steps.pelvis[frame]:.3g} m in {clip.dt:.3g} s"
    if turn:
        return f"the trunk turns by {steps.turns[frame]:.0f} degrees in {clip.dt:.3g} s"
    worst = int(steps.joints[frame].argmax())
    name, step = clip.joint_names[list(parts.joints.values())[worst]], float(steps.joints[frame, worst])
    return f"the joint {name!r} jumps {step:.3g} m about the pelvis in {clip.dt:.3g} s, at {step / clip.dt:.3g} m/s"
