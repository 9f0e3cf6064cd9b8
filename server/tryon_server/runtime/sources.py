"""Where poses come from: a recorded motion, a stream, or nowhere. Each says how the body moves next.

A source is asked with the wall time that has passed and answers with a move: the pose to reach and the simulated time
to reach it in. Short moves cost the solver no more than long ones, since it cuts them into steps anyway, and give more
frames: no move is longer than ``LONGEST_MOVE`` but those of a stream on a solver that is slower than real time. There,
what was recorded and what was tracked part ways. A recorded motion plays in slow motion, in steps of the usual length.
A wearer does not wait: a stream's moves become as long as the solver takes for one, each a single step of up to
``LONGEST_STEP``, so that every frame is of the newest pose there was. Neither pushes the cloth with speeds that were
never there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from tryon_server.runtime.drape import Stance
from tryon_solver.body.mesh_sequence import MeshSequence
from tryon_solver.body.motion import Motion, blend_in
from tryon_solver.body.pose import Pose

LONGEST_MOVE = 1 / 30  # [s] one step of the solver at preset draft
LONGEST_STEP = 1 / 15  # [s] of the solver where it keeps up only so; longer ones cost it more than they gain
SHORTEST_MOVE = 1e-3  # [s] over less, a rounding of the positions is a speed; what is left waits for the next pose
LARGEST_DEBT = 0.1  # [s] of wall time that is made up when the solver is quick enough again; more is forgotten
SETTLE_SECONDS = 12.0  # a body that stands still is simulated for this long: a skirt swings for up to ten
STALL_SECONDS = 0.25  # without a pose for this long the stream's body stands still and the cloth settles
CATCH_UP = 2.0  # a stream's body that is behind catches up at no more than this many simulated seconds per second
LARGEST_LAG = 1.0  # [s] a stream's body that is farther behind than this hurries no more but takes its time

APPROACH_SECONDS_MIN = 0.5
APPROACH_SPEED_MAX = 1.0  # [m/s] of the root, on a way that nobody recorded
APPROACH_TURN_MAX = 2.0  # [rad/s] of any joint, on that way
NEARBY = 2.0  # [m] a way that nobody recorded is walked if it is no longer than this
RUN_SPEED_MAX = 12.0  # [m/s] no wearer runs faster: a stream whose root does has begun to measure from elsewhere


@dataclass(frozen=True)
class Move:
    """The body's next move.

    Attributes:
        pose: the pose to reach, or the moment of a body that moves by itself.
        dt: in this simulated time [s], above 0.
        t: time of the pose on the source's own clock [s].
        pose_seq: number of the newest pose of the stream that it obeys; 0 for a motion.
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

    def next(self, elapsed: float, cost: float = 0.0) -> Move | None:
        """The next move, ``elapsed`` s of wall time after the last one, which took the solver ``cost`` s of them; None
        when nothing is to be done."""


def approach_seconds(start: Pose, goal: Pose) -> float:
    """How long the body takes from ``start`` to ``goal`` when nobody recorded the way: unhurried, in seconds."""
    distance = float(np.linalg.norm(np.asarray(goal.root) - np.asarray(start.root)))
    cosines = np.abs(np.sum(np.asarray(start.rotations) * np.asarray(goal.rotations), axis=1))
    turn = 2.0 * math.acos(min(1.0, float(cosines.min())))
    return max(APPROACH_SECONDS_MIN, distance / APPROACH_SPEED_MAX, turn / APPROACH_TURN_MAX)


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
    """Plays a body's own frames to their end and back again: nothing says how their end leads to their beginning."""

    def __init__(self, sequence: MeshSequence) -> None:
        self._sequence = sequence
        self._pace = Pace()
        self._t = 0.0

    def next(self, elapsed: float, cost: float = 0.0) -> Move | None:  # noqa: ARG002
        dt = self._pace.take(elapsed)
        self._t += dt
        duration = self._sequence.duration
        there = duration - abs(self._t % (2.0 * duration) - duration)
        return Move(self._sequence.sample(there), dt, self._t, 0)


class StillSource:
    """The body stands still: no motion was chosen and no pose has arrived yet."""

    def __init__(self, pose: Stance) -> None:
        self._pose = pose
        self._pace = Pace()
        self._stood = 0.0

    def next(self, elapsed: float, cost: float = 0.0) -> Move | None:  # noqa: ARG002
        if self._stood >= SETTLE_SECONDS:
            return None
        dt = self._pace.take(elapsed)
        self._stood += dt
        return Move(self._pose, dt, self._stood, 0)


class MotionSource:
    """Plays a motion in a loop, after leading the body from where it stands into the motion.

    A body that stands far from where the motion begins is put there first. The clock is the motion's own: below 0 on
    the way to the first pose.
    """

    def __init__(self, motion: Motion, start: Pose) -> None:
        self._motion = motion
        self._leap = leap_towards(start, motion.pose(0))
        start = moved(start, self._leap)
        seconds = approach_seconds(start, motion.pose(0))
        self._lead = blend_in(start, motion, seconds)
        self._lead_seconds = seconds
        self._pace = Pace()
        self._t = -seconds

    def next(self, elapsed: float, cost: float = 0.0) -> Move | None:  # noqa: ARG002
        dt = self._pace.take(elapsed)
        self._t += dt
        leap, self._leap = self._leap, np.zeros(3)
        if self._t >= 0:
            return Move(self._motion.sample(self._t, loop=True), dt, self._t, 0, leap)
        return Move(self._lead.sample(self._t + self._lead_seconds), dt, self._t, 0, leap)


class StreamSource:
    """Follows the newest pose of a stream. Its clock is the sender's.

    The body keeps a place on the sender's clock: what it has reached. Each move goes from there towards the newest
    pose: all the way if that is no longer than a move may be, else by the same share of the way as of the time. A
    move may be ``CATCH_UP`` times as long as the solver takes for one, up to ``LONGEST_STEP``. So a solver that takes
    c s for a move of c s ends up c s behind the newest pose: while it is farther behind, each move gains c s.

    A body that is too far behind (at the start, when the simulation stood still, or because the solver is slower than
    real time even so) gets a place so far back that it goes on towards the newest pose unhurried. A wearer who appears
    far away, or is suddenly measured from another origin, is no motion: body and garment are put there as one, by whole
    metres, and only the rest is walked.
    """

    def __init__(self, start: Pose) -> None:
        self._pose = start
        self._stream: int | None = None
        self._newest: tuple[int, float, Pose] | None = None
        self._reached = 0.0
        self._waited = 0.0
        self._cost = 0.0
        self._leap = np.zeros(3)

    def take(self, stream: int, seq: int, t_capture: float, pose: Pose) -> None:
        """A newer pose has arrived: number, capture time [s, sender's clock]; ``stream`` changes with the sender."""
        new_sender = stream != self._stream
        self._stream, self._newest = stream, (seq, t_capture, pose)
        lag = t_capture - self._reached
        distance = float(np.linalg.norm(np.asarray(pose.root) - np.asarray(self._pose.root)))
        elsewhere = new_sender or lag > LARGEST_LAG or distance > RUN_SPEED_MAX * lag
        leap = leap_towards(self._pose, pose) if elsewhere else np.zeros(3)
        self._pose, self._leap = moved(self._pose, leap), self._leap + leap
        if new_sender or leap.any():
            self._reached = t_capture - max(LARGEST_LAG, approach_seconds(self._pose, pose))
        elif lag > LARGEST_LAG:
            self._reached = t_capture - min(lag, approach_seconds(self._pose, pose))

    def next(self, elapsed: float, cost: float = 0.0) -> Move | None:
        steady, self._cost = min(cost, self._cost), cost  # a single move that took long says nothing of the next one
        if self._newest is None:
            return self._wait(elapsed, 0)
        seq, t_newest, goal = self._newest
        gap = t_newest - self._reached
        if gap < SHORTEST_MOVE:
            return self._wait(elapsed, seq)
        self._waited = 0.0
        longest = LONGEST_MOVE
        if steady < LONGEST_STEP:  # who can't keep up even so had better take short steps, which are good ones
            longest = max(longest, min(CATCH_UP * steady, LONGEST_STEP))
        dt = min(gap, longest, CATCH_UP * elapsed)
        self._pose = goal if dt == gap else Pose.interpolate(self._pose, goal, dt / gap)
        self._reached = t_newest if dt == gap else self._reached + dt
        leap, self._leap = self._leap, np.zeros(3)
        return Move(self._pose, dt, self._reached, seq, leap, dt if dt > LONGEST_MOVE else 0.0)

    def _wait(self, elapsed: float, seq: int) -> Move | None:
        """No newer pose: soon the body stands still, and when the cloth hangs still nothing is left to do."""
        self._waited += elapsed
        if not STALL_SECONDS <= self._waited < STALL_SECONDS + SETTLE_SECONDS:
            return None
        dt = min(elapsed, LONGEST_MOVE)
        self._reached += dt
        return Move(self._pose, dt, self._reached, seq)
