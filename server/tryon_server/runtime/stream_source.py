"""Follows a stream of poses, on the sender's clock: the body goes a way of legs, each of which leads to a pose that
came.

Where the body is on a leg says both its pose and the time that is told of it, so a frame never claims a later pose than
it shows.

- A leg is gone in the time in which it was tracked. Ways that nobody tracked are gone unhurried: to the first pose of a
  sender, over a gap in the stream, and to the newest pose past all between, which are left out, where the body is more
  than ``LARGEST_LAG`` behind. They are straight, and what was tracked slowly is gone over more quickly.
- To a pose that nobody can have come to in the time, because the tracker has found the wearer again or took one side
  for the other, the root leaps: the solver takes the garment along as if the room had moved (stepping/leap.py). The
  limbs follow at ``LIMBS_TURN``.
- A body that is behind catches up at ``CATCH_UP`` simulated seconds per second at most. A move may be so much longer
  than the solver takes for one, up to ``LONGEST_STEP``, each a single step. So a solver that takes c s for a move of
  c s ends up c s behind the newest pose: while it is farther behind, each move gains c s.
- A solver slower than this, by a factor f, leaves the body f times the seconds behind that the way unhurried takes: at
  most ``NEARBY / APPROACH_SPEED_MAX``, since a wearer farther away is no motion: body and garment are put there as one,
  by whole metres, and only the rest is walked. So it is with who appears far away or is suddenly measured from another
  origin.

No cloth is so pushed with speeds that were never there.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from tryon_server.runtime.sources import (
    LONGEST_MOVE,
    SETTLE_SECONDS,
    Move,
    approach_seconds,
    leap_towards,
    moved,
    unhurried_seconds,
    way,
)
from tryon_solver.body.pose import Pose

LONGEST_STEP = 1 / 15  # [s] of the solver where it keeps up only so; longer ones cost it more than they gain
SHORTEST_MOVE = 1e-3  # [s] over less, a rounding of the positions is a speed; what is left waits for the next pose
STALL_SECONDS = 0.25  # without a pose for this long the stream's body stands still and the cloth settles
CATCH_UP = 2.0  # a body that is behind catches up at no more than this many simulated seconds per second
LARGEST_LAG = 1.0  # [s] behind the newest pose: one farther behind leaves out what it missed
RUN_SPEED_MAX = 12.0  # [m/s] no wearer runs faster: a stream whose root does has begun to measure from elsewhere
TURN_SPEED_MAX = 30.0  # [rad/s] no joint turns faster
LIMBS_TURN = 2.0 * np.pi  # [rad/s] of limbs that were somewhere else: half a second for the farthest way
BURST = 1.0  # [rad] and none farther so fast:
LASTING_TURN_SPEED = 6.0  # [rad/s] what it adds to a burst; poses that were passed over would hide a leap else
SHORTEST_INTERVAL = 0.01  # [s] times of capture may be off by so much, and a speed over less says nothing


@dataclass(frozen=True)
class Leg:
    """A stretch of the way, from where the one before it ends, or from where the body is.

    Attributes:
        seq: number of the stream's pose that it leads to.
        t: when that was captured [s, sender's clock].
        pose: that pose.
        seconds: simulated time in which it is gone [s]; 0 for a leap.
    """

    seq: int
    t: float
    pose: Pose
    seconds: float


def impossible(start: Pose, goal: Pose, seconds: float) -> bool:
    """Whether nobody gets from one pose to the other in that time."""
    distance, turn = way(start, goal)
    longest = max(seconds, SHORTEST_INTERVAL)
    furthest = min(TURN_SPEED_MAX * longest, BURST + LASTING_TURN_SPEED * longest)
    return distance > RUN_SPEED_MAX * longest or turn > furthest


def put_elsewhere(pose: Pose, goal: Pose) -> Pose:
    """The pose with its root where that of the goal is, turned likewise."""
    return Pose(goal.root, np.vstack([goal.rotations[:1], pose.rotations[1:]]))


class StreamSource:
    """Follows the newest poses of a stream. Its clock is the sender's; before the first pose it stands at 0, or at
    ``since`` [s], which was told before."""

    def __init__(self, start: Pose, since: float | None = None) -> None:
        self._pose = start
        self._t = since or 0.0
        self._seq = 0
        self._legs: deque[Leg] = deque()
        self._stream: int | None = None
        self._waited = 0.0  # [s] of wall time without anything to go to
        self._settled = 0.0  # [s] simulated in it
        self._cost = 0.0
        self._leap = np.zeros(3)

    @property
    def t(self) -> float:
        """See ``PoseSource``."""
        return self._t

    def take(self, stream: int, seq: int, t_capture: float, pose: Pose) -> None:
        """A newer pose has arrived: number, capture time [s, sender's clock], later than of the one before; ``stream``
        changes with the sender and its clock."""
        begins, self._stream = stream != self._stream, stream
        lag = t_capture - self._t
        distance = float(np.linalg.norm(np.asarray(pose.root) - np.asarray(self._pose.root)))
        elsewhere = begins or lag > LARGEST_LAG or distance > RUN_SPEED_MAX * lag
        leap = leap_towards(self._pose, pose) if elsewhere else np.zeros(3)
        self._pose, self._leap = moved(self._pose, leap), self._leap + leap
        if begins:
            self._begin(seq, t_capture, pose)
        elif leap.any():
            self._legs.clear()
            self._leap_to(seq, t_capture, pose)
        else:
            self._go_on(seq, t_capture, pose, late=lag > LARGEST_LAG)

    def _begin(self, seq: int, t: float, pose: Pose) -> None:
        """Lead the body to a sender's first pose, from a time before it that may be anything: from where the clock
        stands if that fits, since it may be the same one, else from so long before as it takes."""
        seconds = max(LARGEST_LAG, approach_seconds(self._pose, pose))
        if not t - seconds <= self._t < t:
            self._t = t - seconds
        self._legs = deque([Leg(seq, t, pose, seconds)])

    def _go_on(self, seq: int, t: float, pose: Pose, late: bool) -> None:
        """Add the leg to a pose; a body that is ``late`` first finishes the one it is on and leaves out the others."""
        if late:
            self._legs = deque([self._legs[0]] if self._legs else [])
        t_before, before = self._end()
        seconds = t - t_before
        if impossible(before, pose, seconds):
            self._leap_to(seq, t, pose)
            return
        if late or seconds > STALL_SECONDS:
            seconds = min(seconds, max(LONGEST_MOVE, unhurried_seconds(before, pose)))
        self._legs.append(Leg(seq, t, pose, seconds))

    def _leap_to(self, seq: int, t: float, pose: Pose) -> None:
        """Put the root where it is in a pose that nobody can have come to, and add the leg of the limbs."""
        t_before, before = self._end()
        leapt = put_elsewhere(before, pose)
        self._legs.append(Leg(seq, t_before, leapt, 0.0))
        self._legs.append(Leg(seq, t, pose, max(LONGEST_MOVE, way(leapt, pose)[1] / LIMBS_TURN)))

    def _end(self) -> tuple[float, Pose]:
        """Where the way ends, and when [s]."""
        return (self._legs[-1].t, self._legs[-1].pose) if self._legs else (self._t, self._pose)

    def next(self, elapsed: float, cost: float = 0.0) -> Move | None:
        """See ``PoseSource``."""
        steady, self._cost = min(cost, self._cost), cost  # a single move that took long says nothing of the next one
        ahead = sum(leg.seconds for leg in self._legs)
        if ahead < SHORTEST_MOVE:
            return self._wait(elapsed)
        self._waited = self._settled = 0.0
        longest = LONGEST_MOVE
        if steady < LONGEST_STEP:  # who can't keep up even so had better take short steps, which are good ones
            longest = max(longest, min(CATCH_UP * steady, LONGEST_STEP))
        dt = min(ahead, longest, CATCH_UP * elapsed)
        self._go(dt)
        leap, self._leap = self._leap, np.zeros(3)
        return Move(self._pose, dt, self._t, self._seq, leap, dt if dt > LONGEST_MOVE else 0.0)

    def settle_anew(self) -> None:
        """See ``PoseSource``."""
        self._settled = 0.0

    def _go(self, seconds: float) -> None:
        """Go on along the legs for so long, in simulated time."""
        while self._legs and seconds > 0.0:
            leg = self._legs[0]
            self._seq = leg.seq
            if seconds < leg.seconds:
                share = seconds / leg.seconds
                self._pose = Pose.interpolate(self._pose, leg.pose, share)
                self._t += share * (leg.t - self._t)
                self._legs[0] = replace(leg, seconds=leg.seconds - seconds)
                return
            self._pose, self._t = leg.pose, leg.t
            self._legs.popleft()
            seconds -= leg.seconds

    def _wait(self, elapsed: float) -> Move | None:
        """No newer pose: soon the body stands still, at the time of its pose, and when the cloth hangs still nothing is
        left to do."""
        self._waited += elapsed
        if self._waited < STALL_SECONDS or self._settled >= SETTLE_SECONDS:
            return None
        dt = min(elapsed, LONGEST_MOVE)
        self._settled += dt
        return Move(self._pose, dt, self._t, self._seq)
