"""An outfit that was dressed beside what is worn, brought to where the body is by now, and what is worn to where it
hangs in that: it takes the other's place between two frames, and nobody sees the body go back to the stance in which
garments are put on, or cloth jump. What lies on the other side of another garment than before can't be led there, since
cloth does not pass through cloth: as who dresses takes it off and puts it on again, it is worn no more before the
others are led, and is worn again with the new outfit."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations, pairwise

from tryon_server.runtime.drape import Drape, Stance
from tryon_server.runtime.sources import LONGEST_MOVE, approach_seconds, leap_towards, moved
from tryon_solver.body.mesh_sequence import MeshSequence, Moment
from tryon_solver.body.motion import ease
from tryon_solver.body.pose import Pose

logger = logging.getLogger(__name__)

STRIDE = 0.15  # s that the body would take, unhurried, for what it goes in a move
FEWEST = 4  # moves: the fabric takes on the folds of the new stance on the way
SAME = 1e-6  # times a move, that one may be longer: what is left after it would be no time at all
AT_ONCE = 2  # moves of what was made a few frames ago, between two frames of what is worn


class CatchingUp:
    """The parts of a drape that is unpacked, then those of its way, between which what is worn goes on.

    The way leads from the stance in which it was dressed to the stance of the moment, wherever that goes meanwhile:
    both are blended, and the share of the latter goes from 0 to 1 smoothly. Nobody sees it, so it is gone in strides,
    in which the garment is taken along and feels nothing of the motion: what folds it has in the new stance is found,
    and not how it would have swung on the way. With the next move it takes on the body's speed. From there both go
    along, and what both have is drawn to where the new one has it, which is seen, until that takes the place.

    Attributes:
        is_there: was the drape that the last part gave the one that was unpacked?
    """

    def __init__(
        self,
        unpacking: Iterator[Drape | None],
        stance: Callable[[], Stance],
        worn: Drape,
        again: Sequence[str] = (),
    ) -> None:
        """``stance`` tells where the body of what is ``worn`` is. Those of the names ``again`` are taken off before the
        others are drawn, and worn again at the end."""
        self._unpacking, self._stance, self._worn, self._again = unpacking, stance, worn, again
        self.is_there = False

    def parts(self) -> Iterator[Drape | None]:
        """A drape where what is worn gives way to that, from the next frame on: without some of its garments, and, the
        last part, the new one in the stance of the moment; None after each other part. What is worn has to be advanced
        between them, else they don't end."""
        for drape in self._unpacking:
            if drape is not None:
                yield from self._taking_over(drape)
                return
            yield None

    def _taking_over(self, drape: Drape) -> Iterator[Drape | None]:
        bared = False
        try:
            for left in self._worn.come_to(drape, self._led(drape), self._again):
                bared = bared or left is not None
                yield left
        except Exception:
            if not bared:
                raise
            logger.exception("what is worn could not be led all the way")  # what is off is put on nevertheless
            drape.come_along()
        self.is_there = True
        yield drape

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


def caught_up(made: Drape, worn: Drape, stance: Callable[[], Stance]) -> Iterator[None]:
    """Have what was made a few frames ago come to where the body of what is worn is by now, as if the room moved, in
    parts of AT_ONCE moves, between which what is worn may be advanced by one: what was put on has folds to find, and
    its first moves can take many times as long as others. In each move the body goes as much of the way as that has of
    the time: with all of it in the first, cloth would go on from there at several times the body's speed."""
    moves = 0
    while (left := worn.seconds - made.seconds) > 0.0:
        if moves and moves % AT_ONCE == 0:
            yield None
            left = worn.seconds - made.seconds
        share = LONGEST_MOVE / left if left > LONGEST_MOVE * (1 + SAME) else 1.0
        made.come_along()
        to = _between(made.stance, stance(), share, made.own_motion)
        made.advance(to, worn.seconds if share == 1.0 else made.seconds + share * left)
        moves += 1


def taken_off_for(before: Sequence[str], after: Sequence[str]) -> tuple[str, ...]:
    """Of garments that are worn before and after, both told from the innermost outwards, those that have to pass
    through others: the fewest, and of as few those that come to lie farther out."""
    common = [name for name in before if name in after]
    place = {name: after.index(name) for name in common}

    def ascend(kept: tuple[str, ...]) -> bool:
        return all(place[one] < place[other] for one, other in pairwise(kept))

    for count in range(len(common), 0, -1):
        orders = [kept for kept in combinations(common, count) if ascend(kept)]
        if orders:
            stay = min(orders, key=lambda kept: [place[name] for name in kept])
            return tuple(name for name in common if name not in stay)
    return ()


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
