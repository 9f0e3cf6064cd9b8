"""How far the correction's loop has come: kept and judged on the device, read by the host when the loop ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import warp as wp

from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.linalg.device_loop import KeptLoop

wp.set_module_options({"enable_backward": False})

OVERSHOT = wp.constant(2.0)  # so many times as long as the step before it
ASTRAY = wp.constant(4.0)  # so many times as far from balance as an iteration before
TRUSTED = 5.0  # m/s: what a direction may be longer than twice the way to the trial
TRUSTED_AGAIN = 1.0  # m/s, of a correction that is done again
HARDLY_NEARER = wp.constant(0.1)  # more than this share as far from balance as at first

# Places in `state`. Each of the first four is a condition of the loop, 0 or 1.
GOING_ON = wp.constant(0)  # another iteration
NO_DIRECTION = wp.constant(1)  # the direction is still to be found
FREE_TO_MOVE = wp.constant(2)  # the direction can be taken now
LOOKING = wp.constant(3)  # pairs and Hessian are to be made anew
LEFT = wp.constant(4)  # iterations left
SEARCHES = wp.constant(5)  # further searches left
LEAVING = wp.constant(6)  # vertices that the direction takes out of the region
FOUND = wp.constant(7)  # iterations whose direction was found
WANTS_SEARCH = wp.constant(8)
WANTS_ROOM = wp.constant(9)
LEAST_YET = wp.constant(10)  # 1 if the iteration began nearer to balance than all before it; the first never
BUDGET = wp.constant(11)  # iterations that an extension adds
EXTENSIONS = wp.constant(12)  # left
STRAYED = wp.constant(13)  # 1 if the budget's last iteration begins in the middle of something
PLACES = 14

# Places in `lengths` [m], from the fourth on [J]: <g, D^-1 g>, how far from balance.
LENGTH = wp.constant(0)  # of the direction's longest vector
MOVED = wp.constant(1)  # largest move of a vertex in this iteration
BEFORE = wp.constant(2)  # that of the one before
LEAST = wp.constant(3)  # of all iterations where they began, but the first
FIRST = wp.constant(4)  # the larger of the first two
BEGAN = wp.constant(5)  # of the first
LAST = wp.constant(6)  # of the last
TRIAL = wp.constant(7)  # way to the trial, of the vertex that goes farthest [m]
LENGTHS = 8


@wp.kernel
def begin_kernel(
    at_most: int,
    extensions: int,
    searches: int,
    state: wp.array(dtype=wp.int32),
    lengths: wp.array(dtype=wp.float32),
):
    for k in range(PLACES):
        state[k] = 0
    state[GOING_ON] = wp.where(at_most > 0, 1, 0)
    state[NO_DIRECTION] = 1
    state[LEFT] = at_most
    state[BUDGET] = at_most
    state[EXTENSIONS] = extensions
    state[SEARCHES] = searches
    lengths[MOVED] = 0.0
    lengths[BEFORE] = wp.inf
    lengths[LEAST] = wp.inf
    lengths[FIRST] = 0.0
    lengths[BEGAN] = 0.0
    lengths[LAST] = 0.0


@wp.kernel
def judge_direction_kernel(
    imbalance: wp.array(dtype=wp.float32),
    unsettled: float,
    dt: wp.array(dtype=wp.float32),
    state: wp.array(dtype=wp.int32),
    lengths: wp.array(dtype=wp.float32),
):
    lengths[LAST] = imbalance[0]
    if state[FOUND] == 0:
        lengths[BEGAN] = imbalance[0]
    if state[FOUND] < 2:
        lengths[FIRST] = wp.max(lengths[FIRST], imbalance[0])
    state[LEAST_YET] = 0
    if state[FOUND] > 0 and imbalance[0] < lengths[LEAST]:
        lengths[LEAST] = imbalance[0]
        state[LEAST_YET] = 1
    state[NO_DIRECTION] = 0
    state[FOUND] = state[FOUND] + 1
    state[LEFT] = state[LEFT] - 1
    if state[LEFT] == 0:
        astray = imbalance[0] > ASTRAY * lengths[LEAST]
        hardly_nearer = imbalance[0] > HARDLY_NEARER * lengths[FIRST]
        stuck = state[FOUND] > 2 and lengths[LENGTH] > unsettled * dt[0] and hardly_nearer
        state[STRAYED] = wp.where(astray or stuck, 1, 0)
        if state[STRAYED] == 1 and state[EXTENSIONS] > 0:
            state[STRAYED] = 0
            state[EXTENSIONS] = state[EXTENSIONS] - 1
            state[LEFT] = state[BUDGET]
    if state[LEFT] == 0 and lengths[LENGTH] > OVERSHOT * lengths[BEFORE]:
        state[GOING_ON] = 0


@wp.kernel
def decide_kernel(state: wp.array(dtype=wp.int32)):
    state[FREE_TO_MOVE] = state[GOING_ON]
    if state[GOING_ON] == 1 and state[LEAVING] > 0 and state[SEARCHES] > 0:
        state[FREE_TO_MOVE] = 0
        state[GOING_ON] = 0
        state[WANTS_SEARCH] = 1


@wp.kernel
def judge_move_kernel(
    shortest: float,
    dt: wp.array(dtype=wp.float32),
    state: wp.array(dtype=wp.int32),
    lengths: wp.array(dtype=wp.float32),
):
    lengths[BEFORE] = lengths[MOVED]
    state[NO_DIRECTION] = 1
    if state[LEFT] == 0 or lengths[MOVED] < shortest * dt[0]:
        state[GOING_ON] = 0
    state[LOOKING] = state[GOING_ON]


@wp.kernel
def stop_when_full_kernel(counters: wp.array(dtype=wp.int32), room: int, state: wp.array(dtype=wp.int32)):
    if counters[0] > room:
        state[GOING_ON] = 0
        state[WANTS_ROOM] = 1


@wp.kernel
def resume_kernel(searches: int, state: wp.array(dtype=wp.int32)):
    state[GOING_ON] = 1
    state[WANTS_SEARCH] = 0
    state[WANTS_ROOM] = 0
    state[SEARCHES] = state[SEARCHES] - searches


class Budget:
    """How many Newton iterations a correction has, and conjugate gradients each; its loop is one graph on a GPU.

    A direction is cut to what moves at `trusted` m/s beside twice the way to the trial: longer ones are absurd, and
    searching along them takes minutes.
    """

    def __init__(self, iterations: int, pcg_iterations: int, trusted: float) -> None:
        self.iterations, self.pcg_iterations, self.trusted = iterations, pcg_iterations, trusted
        self.loop = KeptLoop()


@dataclass(frozen=True)
class Outcome:
    """Why the loop ended, after how many iterations, the largest move in the last that moved [m], and whether the
    budget was spent in the middle of something: its last iteration began ASTRAY times as far from balance as another,
    or HARDLY_NEARER to it than the first ones and with long moves to come; and how far from balance [J] the nearest
    began, the first, and the last.

    Where the first began does not count: forces may balance there though the cloth has not yet gone where its inertia
    takes it, and who went back there would stop in mid-air."""

    wants_search: bool
    wants_room: bool
    iterations: int
    moved: float
    strayed: bool
    least: float
    began: float
    last: float


@dataclass(frozen=True)
class Progress:
    """`state` (PLACES,) int32 and `lengths` (LENGTHS,) float32, by the places above."""

    state: wp.array
    lengths: wp.array

    @staticmethod
    def allocate(device: str) -> Progress:
        return Progress(
            wp.zeros(PLACES, dtype=wp.int32, device=device), wp.zeros(LENGTHS, dtype=wp.float32, device=device)
        )

    @property
    def going_on(self) -> wp.array:
        """The loop's condition."""
        return self.state[0:1]

    @property
    def leaving(self) -> wp.array:
        """Where to count the vertices that the direction takes out of the region."""
        return self.state[6:7]

    @property
    def trial(self) -> wp.array:
        """(1,) where to put the longest way to the trial [m]."""
        return self.lengths[7:8]

    @property
    def length(self) -> wp.array:
        """Where to put the direction's longest vector [m]."""
        return self.lengths[0:1]

    @property
    def moved(self) -> wp.array:
        """Where to put the largest move [m]."""
        return self.lengths[1:2]

    def begin(self, at_most: int, extensions: int, searches: int) -> None:
        """A budget of iterations, how often it is given again to a strayed one, and one of further searches."""
        self._launch(begin_kernel, [at_most, extensions, searches], [self.state, self.lengths])

    def unless_directed(self, find: Callable[[], None]) -> None:
        """Launch `find` if the direction is still to be found."""
        wp.capture_if(self.state[1:2], find)

    def judge_direction(self, imbalance: wp.array, unsettled: float, dt: wp.array) -> None:
        """The direction is found, its length known, and `imbalance` (1,) [J] where it begins: extend a budget that ends
        in the middle of something, by `unsettled` [m/s] times `dt` (1,) [s] too, or drop its last if it overshoots."""
        self._launch(judge_direction_kernel, [imbalance, unsettled, dt], [self.state, self.lengths])

    @property
    def least_yet(self) -> wp.array:
        """(1,) int32: did the iteration begin nearer to balance than all before it?"""
        return self.state[10:11]

    def if_free_to_move(self, move: Callable[[], None]) -> None:
        """Launch `move` if the direction can be taken; else the loop ends, for a search where there is one left."""
        self._launch(decide_kernel, [], [self.state])
        wp.capture_if(self.state[2:3], move)

    def judge_move(self, shortest: float, dt: wp.array) -> None:
        """The direction is taken: end the loop with the budget, or when nothing moved by `shortest` m/s times `dt`."""
        self._launch(judge_move_kernel, [shortest, dt], [self.state, self.lengths])

    def if_going_on(self, look: Callable[[], None]) -> None:
        """Launch `look` if there is another iteration after this move."""
        wp.capture_if(self.state[3:4], look)

    def stop_when_full(self, pairs: ContactPairs) -> None:
        """End the loop if there are more pairs than there is room for."""
        self._launch(stop_when_full_kernel, [pairs.counters, pairs.capacity], [self.state])

    def resume(self) -> None:
        """What the loop ended for is done."""
        self._launch(resume_kernel, [0], [self.state])

    def searched(self) -> None:
        """The same, after a further search."""
        self._launch(resume_kernel, [1], [self.state])

    def read(self) -> Outcome:
        """Waits for the device."""
        state, lengths = self.state.numpy(), self.lengths.numpy()
        least, _, began, last = map(float, lengths[3:7])
        moved, strayed = float(lengths[1]), bool(state[13])
        return Outcome(bool(state[8]), bool(state[9]), int(state[7]), moved, strayed, least, began, last)

    def _launch(self, kernel: wp.Kernel, inputs: list[object], outputs: list[wp.array]) -> None:
        wp.launch(kernel, 1, inputs, outputs, device=self.state.device)
