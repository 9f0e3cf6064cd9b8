"""What the body does in a case: it is led into a motion, plays it, slows down, and stands still."""

from __future__ import annotations

from dataclasses import dataclass

from case import Case

from tryon_solver.body.motion import Motion, blend_in
from tryon_solver.body.pose import Pose


@dataclass(frozen=True)
class Timeline:
    """Frames 1/fps apart; frame 0 is the garment as it was dressed. Times in s from there."""

    lead: Motion
    motion: Motion
    fps: float
    moving: float  # s of the motion
    stopping: float  # s at the end of those in which its clock slows down evenly to a stand; 0 stops it dead
    standing: float  # s of standing still in its last pose
    looped: bool = True

    @staticmethod
    def build(start: Pose, motion: Motion, case: Case) -> Timeline:
        """From `start` into `motion` within the case's `lead` s; the motion once, whole, if the case names no time."""
        lead, looped = blend_in(start, motion, case.lead), case.seconds > 0
        moving = case.seconds if looped else motion.duration + 0.5 * case.stopping
        return Timeline(lead, motion, case.fps, moving, case.stopping, case.standing, looped)

    @property
    def frame_count(self) -> int:
        """Frames after frame 0."""
        return round((self.lead.duration + self.moving + self.standing) * self.fps)

    @property
    def first_moving(self) -> int:
        """The first frame that is wholly in the motion."""
        return round(self.lead.duration * self.fps)

    @property
    def last_moving(self) -> int:
        """The frame in which the body stops."""
        return round((self.lead.duration + self.moving) * self.fps)

    def pose(self, frame: int) -> Pose:
        """The body's pose in a frame."""
        t = min(frame, self.last_moving) / self.fps
        if t < self.lead.duration:
            return self.lead.sample(t)
        return self.motion.sample(self.clock(t - self.lead.duration), loop=self.looped)

    def clock(self, t: float) -> float:
        """The motion's own time [s], t after its beginning."""
        begun = self.moving - self.stopping
        if t <= begun or not self.stopping:
            return t
        share = min((t - begun) / self.stopping, 1.0)
        return begun + self.stopping * (share - 0.5 * share * share)
