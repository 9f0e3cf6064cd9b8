"""Motions: poses over time, sampled at any time, looped without a jump, entered softly from another pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.pose import Pose

SHORTEST_FADE = 0.4  # s, a loop's closing error is spread over at least this much of its end
FADE_SPEED = 0.75  # m/s, the root's over so much that it moves no faster on average, unless the clip is too short
FADE_TURN = np.radians(120.0)  # rad/s, the joints' likewise
VELOCITY_ONSET = 0.3  # s before a motion begins during which a blend takes up the motion's velocity, or shorter:
ONSET_TURN = 1.5  # rad, by which no joint is turned back for that; at more a limb would whirl to get up its speed
ONSET_STEP = 0.5  # m, nor the root moved back; both leave whoever turns below 18 rad/s and runs below 6 m/s as they are
ONSET_SHARE = 0.2731  # of the velocity times the onset that a blend is moved back by at most: max (1 - x) ease(x)


class MotionError(ValueError):
    """A motion that cannot be played; the message says why."""


@dataclass(frozen=True)
class Motion:
    """Poses at equal times. Frame k is at k dt; the duration is that of the last frame."""

    roots: np.ndarray  # (T, 3) float64 m, world position of the root joint
    rotations: np.ndarray  # (T, J, 4) float64 unit quaternions x y z w, local, relative to the rest pose
    dt: float  # s
    name: str = "motion"

    def __post_init__(self) -> None:
        if self.roots.ndim != 2 or self.roots.shape[1] != 3 or not len(self.roots):
            raise MotionError(f"motion {self.name!r}: roots must be (frames, 3) with a frame, got {self.roots.shape}")
        if self.rotations.ndim != 3 or self.rotations.shape[::2] != (len(self.roots), 4):
            raise MotionError(
                f"motion {self.name!r}: rotations must be (frames, joints, 4) with {len(self.roots)} frames, "
                f"got {self.rotations.shape}"
            )
        if not (np.isfinite(self.roots).all() and np.isfinite(self.rotations).all() and 0.0 < self.dt < np.inf):
            raise MotionError(f"motion {self.name!r} holds a value that is not finite, or its dt is not positive")

    @property
    def frame_count(self) -> int:
        return len(self.roots)

    @property
    def duration(self) -> float:
        """Time of the last frame [s]; the first is at 0."""
        return (self.frame_count - 1) * self.dt

    def pose(self, frame: int) -> Pose:
        """The pose of one frame; -1 is the last."""
        return Pose(self.roots[frame], self.rotations[frame])

    def sample(self, t: float, loop: bool = False) -> Pose:
        """The pose at time t [s].

        Without `loop` the first pose holds before 0 and the last one after `duration`. With `loop` the motion repeats
        with the period `duration`: the difference between its last and its first pose is spread, as smooth fades, over
        its end, so that the loop closes; a motion that already ends as it began is played as it is.
        """
        if not np.isfinite(t):
            raise MotionError(f"motion {self.name!r} asked for the time {t}")
        if self.duration == 0.0:
            return self.pose(0)
        t = t % self.duration if loop else min(max(t, 0.0), self.duration)
        frame = min(int(t / self.dt), self.frame_count - 2)
        pose = Pose.interpolate(self.pose(frame), self.pose(frame + 1), t / self.dt - frame)
        return self._closed(pose, t) if loop else pose

    def fades(self) -> tuple[float, float]:
        """Times [s] at the end of a loop over which its closing error is spread, the root's and the joints'.

        Each at most the whole duration. They are two, since a way that takes long to go back leaves every pose as it
        was, while joints that turned all that time would be bent in the middle of the motion as nobody bends them.
        """
        step, turn = self.closing_error()
        root, joints = (max(SHORTEST_FADE, time) for time in (step / FADE_SPEED, turn / FADE_TURN))
        return min(self.duration, root), min(self.duration, joints)

    def closing_error(self) -> tuple[float, float]:
        """How far the root is from where it began when the motion ends [m], and the joint furthest turned [rad]."""
        turns = quaternions.angle_of(self._closing_turns())
        return float(np.linalg.norm(self.roots[0] - self.roots[-1])), float(turns.max())

    def _closing_turns(self) -> np.ndarray:
        return quaternions.multiply(quaternions.conjugate(self.rotations[-1]), self.rotations[0])

    def _closed(self, pose: Pose, t: float) -> Pose:
        root_share, turn_share = (float(ease((t - (self.duration - fade)) / fade)) for fade in self.fades())
        if root_share == 0.0 and turn_share == 0.0:
            return pose
        identity = np.broadcast_to(quaternions.IDENTITY, pose.rotations.shape)
        turns = quaternions.slerp(identity, self._closing_turns(), turn_share)
        root = pose.root + root_share * (self.roots[0] - self.roots[-1])
        return Pose(root, quaternions.multiply(pose.rotations, turns))


def blend_in(pose_from: Pose, motion: Motion, seconds: float) -> Motion:
    """A motion of `seconds` from `pose_from` at rest to the first pose of `motion`, with the velocity it begins with.

    Used to lead a body from the pose in which its garment was dressed into a motion: play the result, then `motion`.
    Positions and joint rotations ease from one pose to the other; over the last 0.3 s the velocity of `motion`'s first
    frames fades in, so that nothing jerks at the seam; over less where that would turn a joint or move the root far
    back. Frames are `motion.dt` apart, or a little less so that they divide `seconds`.
    """
    if not (np.isfinite(seconds) and seconds > 0.0):
        raise MotionError(f"a blend takes a positive time in seconds, got {seconds}")
    steps = max(1, int(np.ceil(seconds / motion.dt - 1e-9)))
    times = np.linspace(0.0, seconds, steps + 1)
    target = motion.pose(0)
    following = motion.sample(min(motion.dt, motion.duration))
    root_velocity = (following.root - target.root) / motion.dt
    step = quaternions.multiply(quaternions.conjugate(target.rotations), following.rotations)
    turn_speed = quaternions.angle_of(step) / motion.dt
    step = np.where(step[:, 3:] < 0.0, -step, step)
    length = np.linalg.norm(step[:, :3], axis=1, keepdims=True)
    axes = np.where(length > 1e-12, step[:, :3] / np.where(length > 1e-12, length, 1.0), [1.0, 0.0, 0.0])

    onset = min(
        VELOCITY_ONSET,
        seconds,
        ONSET_TURN / max(ONSET_SHARE * float(turn_speed.max()), 1e-9),
        ONSET_STEP / max(ONSET_SHARE * float(np.linalg.norm(root_velocity)), 1e-9),
    )
    roots, rotations = [], []
    for t in times:
        pose = Pose.interpolate(pose_from, target, float(ease(t / seconds)))
        lead = (t - seconds) * ease((t - seconds + onset) / onset)  # 0 at the end, there with slope 1
        turns = quaternions.from_axis_angle(axes, turn_speed * lead)
        roots.append(pose.root + root_velocity * lead)
        rotations.append(quaternions.multiply(pose.rotations, turns))
    return Motion(np.array(roots), np.array(rotations), seconds / steps, f"into {motion.name}")


def ease(x: np.ndarray | float) -> np.ndarray:
    """0 before 0, 1 after 1, with two vanishing derivatives at both ends: 6 x^5 - 15 x^4 + 10 x^3."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * x * (x * (6.0 * x - 15.0) + 10.0)
