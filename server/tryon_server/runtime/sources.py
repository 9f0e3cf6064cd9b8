"""Where poses come from: a recorded motion or nowhere, here, or a stream (stream_source.py). Each says how the body
moves next.

A source is asked with the wall time that has passed and answers with a move: the pose to reach and the simulated time
to reach it in. Short moves cost the solver no more than long ones, since it cuts them into steps anyway, and give more
frames: no move is longer than ``LONGEST_MOVE`` but those of a stream on a solver that is slower than real time. There,
what was recorded and what was tracked part ways. A recorded motion plays in slow motion, in steps of the usual length.
A wearer does not wait.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from tryon_server.runtime.drape import Stance
from tryon_solver.body.lead_back import LeadBack
from tryon_solver.body.mesh_sequence import MeshSequence
from tryon_solver.body.motion import Motion, blend_in
from tryon_solver.body.pose import Pose

LONGEST_MOVE = 1 / 30  # [s] one step of the solver at preset draft
LARGEST_DEBT = 0.1  # [s] of wall time that is made up when the solver is quick enough again; more is forgotten
SETTLE_SECONDS = 12.0  # simulated, for which a body that stands still is: a skirt swings for up to ten

APPROACH_SECONDS_MIN = 0.5
APPROACH_SPEED_MAX = 1.0  # [m/s] of the root, on a way that nobody recorded
APPROACH_TURN_MAX = 2.0  # [rad/s] of any joint, on that way
NEARBY = 2.0  # [m] a way that nobody recorded is walked if it is no longer than this


@dataclass(frozen=True)
class Move:
    """The body's next move.

    Attributes:
        pose: the pose to reach, or the moment of a body that moves by itself.
        dt: in this simulated time [s], above 0.
        t: time of the pose on the source's own clock [s].
        pose_seq: number of the stream's pose that it leads to, or is at; 0 for a motion.
        leap: before this move body and garment are put elsewhere as one, by (3,) whole metres.
        longest_step: steps of the solver may be so long [s], if its settings have them shorter.
    """

    pose: Stance
    dt: float
    t: float
    pose_seq: int
    leap: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    longest_step: float = 0.0


class PoseSource(Protocol):
    """Something that moves the body."""

    @property
    def t(self) -> float:
        """Where its own clock is [s]: the time of the last move, or, before the first, of where that begins."""

    def next(self, elapsed: float, cost: float = 0.0) -> Move | None:
        """The next move, ``elapsed`` s of wall time after the last one, which took the solver ``cost`` s of them; None
        when nothing is to be done."""

    def settle_anew(self) -> None:
        """The garment was changed, or what acts on it: a body that stands still is simulated for as long as if it had
        just come to."""


def way(start: Pose, goal: Pose) -> tuple[float, float]:
    """How far the root goes [m], and how far the joint turns that turns most [rad]."""
    distance = float(np.linalg.norm(np.asarray(goal.root) - np.asarray(start.root)))
    cosines = np.abs(np.sum(np.asarray(start.rotations) * np.asarray(goal.rotations), axis=1))
    return distance, 2.0 * math.acos(min(1.0, float(cosines.min())))


def unhurried_seconds(start: Pose, goal: Pose) -> float:
    """How long the body takes from ``start`` to ``goal`` at the speeds of a way that nobody recorded [s]."""
    distance, turn = way(start, goal)
    return max(distance / APPROACH_SPEED_MAX, turn / APPROACH_TURN_MAX)


def approach_seconds(start: Pose, goal: Pose) -> float:
    """How long the body takes from a standstill at ``start`` to ``goal`` when nobody recorded the way [s]."""
    return max(APPROACH_SECONDS_MIN, unhurried_seconds(start, goal))


def leap_towards(start: Pose, goal: Pose) -> npt.NDArray[np.float64]:
    """(3,) whole metres by which a body at ``start`` is put elsewhere rather than walk to ``goal``; 0 if it is near."""
    way = np.asarray(goal.root, dtype=np.float64) - np.asarray(start.root)
    return np.round(way) if float(np.linalg.norm(way)) > NEARBY else np.zeros(3)


def moved(pose: Pose, by: npt.NDArray[np.float64]) -> Pose:
    """The pose somewhere else, ``by`` (3,) m away."""
    return Pose(np.asarray(pose.root) + by, pose.rotations)


class Pace:
    """Hands out wall time as simulated time, in moves, and remembers a little of what it could not hand out."""

    def __init__(self) -> None:
        self._owed = 0.0

    def take(self, elapsed: float) -> float:
        """Simulated time of the next move [s], ``elapsed`` s of wall time after the last one."""
        self._owed = min(self._owed + elapsed, LARGEST_DEBT)
        dt = min(self._owed, LONGEST_MOVE)
        self._owed -= dt
        return dt


class SequenceSource:
    """Plays a body's own frames to their end and back again: nothing says how their end leads to their beginning.

    A body that was dressed later in them, at ``start`` s, is led to the first one before. The clock is the frames',
    below 0 on that way; where ``since`` [s] was told before, it goes on from there.
    """

    def __init__(self, sequence: MeshSequence, start: float = 0.0, since: float | None = None) -> None:
        self._sequence = sequence
        self._lead = LeadBack(sequence, start)
        self._pace = Pace()
        self._t = -self._lead.duration
        self._ahead = _ahead(self._t, since)

    @property
    def t(self) -> float:
        return self._ahead + self._t

    def settle_anew(self) -> None:
        """It moves on anyway."""

    def next(self, elapsed: float, cost: float = 0.0) -> Move | None:  # noqa: ARG002
        dt = self._pace.take(elapsed)
        self._t += dt
        if self._t < 0.0:
            return Move(self._lead.sample(self._t + self._lead.duration), dt, self.t, 0)
        duration = self._sequence.duration
        there = duration - abs(self._t % (2.0 * duration) - duration)
        return Move(self._sequence.sample(there), dt, self.t, 0)


class StillSource:
    """The body stands still, for so many simulated seconds: no motion was chosen and no pose has arrived yet, or nobody
    watches it move. Its clock goes on from ``since`` [s], or stands there with that of a motion that is held."""

    def __init__(
        self, pose: Stance, seconds: float = SETTLE_SECONDS, since: float | None = None, held: bool = False
    ) -> None:
        self._pose, self._seconds, self._since, self._held = pose, seconds, since or 0.0, held
        self._pace = Pace()
        self._stood = 0.0
        self._settled_at = seconds

    @property
    def t(self) -> float:
        return self._since if self._held else self._since + self._stood

    def settle_anew(self) -> None:
        self._settled_at = self._stood + self._seconds

    def next(self, elapsed: float, cost: float = 0.0) -> Move | None:  # noqa: ARG002
        if self._stood >= self._settled_at:
            return None
        dt = self._pace.take(elapsed)
        self._stood += dt
        return Move(self._pose, dt, self.t, 0)


class MotionSource:
    """Plays a motion in a loop, after leading the body from where it stands into the motion.

    A body that stands far from where the motion begins is put there first. The clock is the motion's own, below 0 on
    the way to the first pose; where ``since`` [s] was told before, it goes on from there.
    """

    def __init__(self, motion: Motion, start: Pose, since: float | None = None) -> None:
        self._motion = motion
        self._leap = leap_towards(start, motion.pose(0))
        start = moved(start, self._leap)
        seconds = approach_seconds(start, motion.pose(0))
        self._lead = blend_in(start, motion, seconds)
        self._lead_seconds = seconds
        self._pace = Pace()
        self._t = -seconds
        self._ahead = _ahead(self._t, since)

    @property
    def t(self) -> float:
        return self._ahead + self._t

    def settle_anew(self) -> None:
        """It moves on anyway."""

    def next(self, elapsed: float, cost: float = 0.0) -> Move | None:  # noqa: ARG002
        dt = self._pace.take(elapsed)
        self._t += dt
        leap, self._leap = self._leap, np.zeros(3)
        if self._t >= 0:
            return Move(self._motion.sample(self._t, loop=True), dt, self.t, 0, leap)
        return Move(self._lead.sample(self._t + self._lead_seconds), dt, self.t, 0, leap)


def _ahead(t: float, since: float | None) -> float:
    """By how much what is told is ahead of a clock that begins at t [s], so that it does not go back."""
    return 0.0 if since is None else since - t
