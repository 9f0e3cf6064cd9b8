"""An outfit that was dressed beside what is worn, brought to where the body is by now, and what is worn to where it
hangs in that: it takes the other's place between two frames, and nobody sees the body go back to the stance in which
garments are put on, or cloth jump."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from tryon_server.runtime.drape import Drape, Stance
from tryon_server.runtime.sources import LONGEST_MOVE, approach_seconds, leap_towards, moved
from tryon_solver.body.mesh_sequence import MeshSequence, Moment
from tryon_solver.body.motion import ease
from tryon_solver.body.pose import Pose

STRIDE = 0.15  # s that the body would take, unhurried, for what it goes in a move
FEWEST = 4  # moves: the fabric takes on the folds of the new stance on the way


class CatchingUp:
    """The parts of a drape that is unpacked, then those of its way, between which what is worn goes on.

    The way leads from the stance in which it was dressed to the stance of the moment, wherever that goes meanwhile:
    both are blended, and the share of the latter goes from 0 to 1 smoothly. Nobody sees it, so it is gone in strides,
    in which the garment is taken along and feels nothing of the motion: what folds it has in the new stance is found,
    and not how it would have swung on the way. With the next move it takes on the body's speed. From there both go
    along, and what both have is drawn to where the new one has it, which is seen, until that takes the place.
    """

    def __init__(self, unpacking: Iterator[Drape | None], stance: Callable[[], Stance], worn: Drape) -> None:
        """``stance`` tells where the body of what is ``worn`` is."""
        self._unpacking, self._stance, self._worn = unpacking, stance, worn

    def parts(self) -> Iterator[Drape | None]:
        """None after each part but the last, which gives the drape in the stance of the moment. What is worn has to be
        advanced between them, else they don't end."""
        for drape in self._unpacking:
            if drape is not None:
                yield from self._worn.come_to(drape, self._led(drape))
                yield drape
                return
            yield None

    def _led(self, drape: Drape) -> Iterator[None]:
        start, goal = drape.pose, self._stance()
        moves = max(FEWEST, math.ceil(_shortest(start, goal) / STRIDE))
        for k in range(1, moves + 1):
            if k > 1:
                yield None
                goal = self._stance()
            if isinstance(start, Pose) and isinstance(goal, Pose):
                leap = leap_towards(start, goal)
                drape.leap(leap)
                start = moved(start, leap)
            drape.come_along()
            stance = _between(start, goal, float(ease(k / moves)), drape.own_motion)
            drape.advance(stance, drape.seconds + LONGEST_MOVE)
        drape.come_along()


def _shortest(start: Stance, goal: Stance) -> float:
    """How long the body takes to get there [s], going at a constant speed."""
    if isinstance(start, Pose) and isinstance(goal, Pose):
        return approach_seconds(moved(start, leap_towards(start, goal)), goal)
    return abs(goal.time - start.time) if isinstance(start, Moment) and isinstance(goal, Moment) else 0.0


def _between(start: Stance, goal: Stance, share: float, own: MeshSequence | None) -> Stance:
    """The stance at this share of the way; of a body that moves by itself through its own frames."""
    if share >= 1.0:
        return goal
    if isinstance(start, Pose) and isinstance(goal, Pose):
        return Pose.interpolate(start, goal, share)
    assert own is not None
    assert isinstance(start, Moment)
    assert isinstance(goal, Moment)
    return own.sample(start.time + share * (goal.time - start.time))
