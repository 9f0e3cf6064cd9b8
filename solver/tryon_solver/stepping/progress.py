"""How far the correction's loop has come: kept and judged on the device, read by the host when the loop ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.linalg.device_loop import KeptGraph
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read

if TYPE_CHECKING:
    from tryon_solver.contact.pairs import ContactPairs

wp.set_module_options({"enable_backward": False})

OVERSHOT = wp.constant(2.0)  # so many times as long as the step before it
ASTRAY = wp.constant(4.0)  # so many times as far from balance as an iteration before
TRUSTED = 5.0  # m/s: what a direction may be longer than twice the way to the trial
TRUSTED_AGAIN = 1.0  # m/s, of a correction that is done again
ADRIFT = wp.constant(0.01)  # m/s: what the cloth as one still has to gain or to lose
HARDLY_NEARER = wp.constant(0.1)  # more than this share as far from balance as at first

NO_FIGURES: Mapping[str, wp.array] = MappingProxyType({})

# Places in `state`. Each of the first four is a condition, 0 or 1.
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
STARTING = wp.constant(14)  # 1 until it is chosen where the first iteration begins; a condition, as is
TRYING = wp.constant(15)  # 1 if the way to the trial can be taken now; and
GOING_BACK = wp.constant(16)  # 1 if the trial is further from balance than where its way began
SINCE = wp.constant(17)  # iterations since a direction was much shorter than all before it (near.py)
APART = wp.constant(18)  # where the iteration begins: 0 is not told, WITHIN or BEYOND what is near enough; and
LAST_ONE = wp.constant(19)  # 1 if it is to be the last, being near enough (near.py)
OVERSHOT_MOVE = wp.constant(20)  # 1 if the move has led uphill (overshoot.py); a condition
LEAVING_TO_TRIAL = wp.constant(21)  # vertices that the way to the trial takes out of the region
ENDED_WELL = wp.constant(22)  # 1 if the correction has ended as it should (ending.py); a condition, as is
CONCLUDED = wp.constant(23)  # 1 if what it ended with has passed the check of a commit, and all else is done by then
IN_TIME = wp.constant(24)  # iterations left before a deadline: later than that, one that is late enough is the last
EXTENDING = wp.constant(25)  # 1 if the list is to be extended (extend.py); a condition; and
UNFITTED = wp.constant(26)  # 1 if what was found had no room on it
PLACES = 27

LED_ASTRAY = wp.constant(10.0)  # so many times as far from balance as where the first iteration began

WITHIN = wp.constant(1)
BEYOND = wp.constant(2)

# Places in `lengths` [m], from the fourth on [J]: <g, D^-1 g>, how far from balance.
LENGTH = wp.constant(0)  # of the direction's longest vector
MOVED = wp.constant(1)  # largest move of a vertex in this iteration
BEFORE = wp.constant(2)  # that of the one before
LEAST = wp.constant(3)  # of all iterations where they began, but the first
FIRST = wp.constant(4)  # the larger of the first two
BEGAN = wp.constant(5)  # of the first
LAST = wp.constant(6)  # of the last
TRIAL = wp.constant(7)  # way to the trial, of the vertex that goes farthest [m]
STANDING = wp.constant(8)  # at x_feasible [J]
TRIED = wp.constant(9)  # at the trial, as far as the way there is free [J]
SHORTEST = wp.constant(10)  # of the directions so far, as a root mean square over the cloth (near.py) [m]
ENOUGH = wp.constant(11)  # root mean square over the cloth that is near enough (near.py) [m]
STRETCH = wp.constant(12)  # the cloth's largest, where iterations ended (torn.py)
WITHHELD = wp.constant(13)  # of the iteration's direction by contact, likewise, and doubled (near.py) [m]
SLOPE = wp.constant(14)  # of the potential along the move, where it begins [J]
STRIDE = wp.constant(15)  # times Newton's direction, that the next iteration goes (stride.py)
FREE_SLOPE = wp.constant(16)  # of the potential where the move begins, along what of it went all its way [J]
CARRIED = wp.constant(17)  # the most that carrying stretched a triangle by in this step (halve.py)
FURTHER = wp.constant(18)  # how much further an extension may reach (extend.py)
LENGTHS = 19


@wp.kernel
def begin_kernel(
    at_most: int,
    extensions: int,
    searches: int,
    starting: int,
    state: wp.array(dtype=wp.int32),
    lengths: wp.array(dtype=wp.float32),
):
    for k in range(PLACES):
        state[k] = 0
    state[STARTING] = starting
    state[GOING_ON] = wp.where(at_most > 0, 1, 0)
    state[NO_DIRECTION] = 1
    state[LEFT] = at_most
    state[IN_TIME] = at_most
    state[BUDGET] = at_most
    state[EXTENSIONS] = extensions
    state[SEARCHES] = searches
    lengths[MOVED] = 0.0
    lengths[BEFORE] = wp.inf
    lengths[LEAST] = wp.inf
    lengths[FIRST] = 0.0
    lengths[BEGAN] = 0.0
    lengths[LAST] = 0.0
    lengths[SHORTEST] = wp.inf
    lengths[WITHHELD] = 0.0
    lengths[STRIDE] = 1.0


@wp.kernel
def decide_to_try_kernel(state: wp.array(dtype=wp.int32)):
    """How many leave is kept: the rest of the turn counts anew, for a direction that there is not yet."""
    state[TRYING] = 1
    state[LEAVING_TO_TRIAL] = state[LEAVING]
    if (state[LEAVING] > 0 and state[SEARCHES] > 0) or state[UNFITTED] == 1:
        state[TRYING] = 0
        state[NO_DIRECTION] = 0
        state[GOING_ON] = 0
        state[WANTS_SEARCH] = 1


@wp.kernel
def judge_trial_kernel(
    counters: wp.array(dtype=wp.int32), room: int, state: wp.array(dtype=wp.int32), lengths: wp.array(dtype=wp.float32)
):
    """Where there are more pairs than room nothing can be said of the trial: it is tried again when there is room."""
    if counters[0] > room:
        state[NO_DIRECTION] = 0
        state[GOING_ON] = 0
        state[WANTS_ROOM] = 1
        return
    state[STARTING] = 0
    state[GOING_BACK] = wp.where(lengths[TRIED] > lengths[STANDING], 1, 0)


@wp.kernel
def judge_direction_kernel(
    imbalance: wp.array(dtype=wp.float32),
    unsettled: float,
    dt: wp.array(dtype=wp.float32),
    together: wp.array(dtype=wp.vec3),
    count: int,
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
    state[IN_TIME] = state[IN_TIME] - 1
    if state[LEFT] == 0:
        adrift = wp.length(together[0]) > ADRIFT * dt[0] * float(count) and state[APART] != WITHIN
        astray = imbalance[0] > ASTRAY * lengths[LEAST]
        hardly_nearer = imbalance[0] > HARDLY_NEARER * lengths[FIRST]
        snapping = lengths[LENGTH] > unsettled * dt[0] and state[APART] != WITHIN
        stuck = state[FOUND] > 2 and snapping and hardly_nearer
        state[STRAYED] = wp.where(astray or stuck, 1, 0)
        if (state[STRAYED] == 1 or state[APART] == BEYOND or adrift) and state[EXTENSIONS] > 0:
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
def judge_ending_kernel(
    torn: float,
    mass: wp.array(dtype=wp.float32),
    harmless: float,
    state: wp.array(dtype=wp.int32),
    lengths: wp.array(dtype=wp.float32),
):
    """What correct.py asks on the host; who is in doubt here is asked there."""
    on_the_way = state[WANTS_SEARCH] == 1 or state[WANTS_ROOM] == 1 or state[STRAYED] == 1
    astray = lengths[LAST] > wp.max(LED_ASTRAY * lengths[BEGAN], 0.5 * mass[0] * harmless * harmless)
    state[ENDED_WELL] = wp.where(on_the_way or astray or lengths[STRETCH] > torn, 0, 1)


@wp.kernel
def judge_state_kernel(
    violations: wp.array(dtype=wp.int32),
    counters: wp.array(dtype=wp.int32),
    room: int,
    state: wp.array(dtype=wp.int32),
):
    state[CONCLUDED] = wp.where(violations[0] == 0 and counters[0] <= room, 1, 0)


@wp.kernel
def limit_kernel(most: int, state: wp.array(dtype=wp.int32)):
    state[EXTENSIONS] = wp.min(state[EXTENSIONS], wp.max(most - state[LEFT], 0) / state[BUDGET])
    state[LEFT] = wp.min(state[LEFT], most)


@wp.kernel
def hurry_kernel(in_time: int, at_most: int, state: wp.array(dtype=wp.int32)):
    state[IN_TIME] = in_time
    state[LEFT] = at_most


class Budget:
    """How many Newton iterations a correction has, and conjugate gradients each; it is one graph on a GPU.

    A direction is cut to what moves at `trusted` m/s beside twice the way to the trial: longer ones are absurd, and
    searching along them takes minutes. `ends_near`: it ends before where the preset's nearness is reached.
    """

    def __init__(self, iterations: int, pcg_iterations: int, trusted: float, ends_near: bool = True) -> None:
        self.iterations, self.pcg_iterations, self.trusted = iterations, pcg_iterations, trusted
        self.ends_near = ends_near
        self.graph = KeptGraph()


@dataclass(frozen=True)
class Outcome:
    """Whether it is still to be chosen where to start, why the loop ended, after how many iterations, how many
    vertices its last way leads out of the region, how many pairs there should be, where they were asked about, the
    largest move in the last that moved [m], the longest way that its last direction leads a vertex [m], and whether
    the budget was spent in the middle of something: its last iteration began ASTRAY times as far from balance as
    another, or HARDLY_NEARER to it than the first ones and with long moves to come; how far from balance [J] the
    nearest began, the first, and the last; the largest stretch, where it is measured; and whether the last
    direction was near enough, where that is asked; whether the device has ended the step by itself (ending.py);
    what carrying stretched a triangle by, at most, before the step was solved; how many further searches are left, and
    whether the last had no room for what it found (extend.py); and the figures that were read with it, which are the
    report's (report.py) if the device has.

    Where the first began does not count: forces may balance there though the cloth has not yet gone where its inertia
    takes it, and who went back there would stop in mid-air."""

    starting: bool
    wants_search: bool
    wants_room: bool
    iterations: int
    leaving: int
    pairs: int
    moved: float
    wanted: float
    strayed: bool
    least: float
    began: float
    last: float
    stretch: float
    near: bool
    concluded: bool
    carried: float
    searches: int
    unfitted: bool
    figures: Mapping[str, np.ndarray] = field(default_factory=dict)


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

    @cached_property
    def numbers(self) -> tuple[wp.array, ...]:
        """Those of `state`, each by itself, (1,): to make an array of a part takes as long as a small kernel."""
        return tuple(self.state[k : k + 1] for k in range(PLACES))

    @cached_property
    def ways(self) -> tuple[wp.array, ...]:
        """Those of `lengths`, likewise."""
        return tuple(self.lengths[k : k + 1] for k in range(LENGTHS))

    @property
    def last_one(self) -> wp.array:
        """(1,) int32: is the iteration to be the last, being near enough?"""
        return self.numbers[LAST_ONE]

    @property
    def going_on(self) -> wp.array:
        """The loop's condition."""
        return self.numbers[GOING_ON]

    @property
    def wants_room(self) -> wp.array:
        """(1,) 1 where there are more pairs than there is room for."""
        return self.numbers[WANTS_ROOM]

    @property
    def leaving(self) -> wp.array:
        """Where to count the vertices that the direction takes out of the region."""
        return self.numbers[LEAVING]

    @property
    def extending(self) -> wp.array:
        """(1,) int32 condition: is the list to be extended?"""
        return self.numbers[EXTENDING]

    @property
    def further(self) -> wp.array:
        """(1,) m, how much further an extension may reach."""
        return self.ways[FURTHER]

    @property
    def trial(self) -> wp.array:
        """(1,) where to put the longest way to the trial [m]."""
        return self.ways[TRIAL]

    @property
    def length(self) -> wp.array:
        """Where to put the direction's longest vector [m]."""
        return self.ways[LENGTH]

    @property
    def moved(self) -> wp.array:
        """Where to put the largest move [m]."""
        return self.ways[MOVED]

    @property
    def standing(self) -> wp.array:
        """Where to put how far from balance x_feasible is [J]."""
        return self.ways[STANDING]

    @property
    def tried(self) -> wp.array:
        """Where to put how far from balance the trial is [J]."""
        return self.ways[TRIED]

    @property
    def overshot(self) -> wp.array:
        """(1,) int32 condition: did the move lead uphill?"""
        return self.numbers[OVERSHOT_MOVE]

    @property
    def slope(self) -> wp.array:
        """(1,) where to put the potential's slope along the move, where it begins [J]."""
        return self.ways[SLOPE]

    @property
    def free_slope(self) -> wp.array:
        """(1,) where to put the potential's slope where the move begins, along what of it went all its way [J]."""
        return self.ways[FREE_SLOPE]

    @property
    def stretch(self) -> wp.array:
        """(1,) where to put the cloth's largest stretch."""
        return self.ways[STRETCH]

    @property
    def carried(self) -> wp.array:
        """(1,) where to put what carrying stretched a triangle by, at most."""
        return self.ways[CARRIED]

    def begin(self, at_most: int, extensions: int, searches: int, starting: bool = False) -> None:
        """A budget of iterations, how often it is given again to a strayed one, and one of further searches. With
        `starting` it is chosen first where the iterations begin."""
        self._launch(begin_kernel, [at_most, extensions, searches, int(starting)], [self.state, self.lengths])

    def if_starting(self, choose: Callable[[], None]) -> None:
        """Launch `choose` if it is to be chosen where the iterations begin."""
        wp.capture_if(self.numbers[STARTING], choose)

    def if_free_to_try(self, attempt: Callable[[], None]) -> None:
        """Launch `attempt` if the way to the trial can be taken; else the loop ends, for a search."""
        self._launch(decide_to_try_kernel, [], [self.state])
        wp.capture_if(self.numbers[TRYING], attempt)

    def if_tried_in_vain(self, pairs: ContactPairs, back: Callable[[], None]) -> None:
        """Launch `back` if the trial is further from balance; end the loop if there are too many pairs to tell."""
        self._launch(judge_trial_kernel, [pairs.counters, pairs.capacity], [self.state, self.lengths])
        wp.capture_if(self.numbers[GOING_BACK], back)

    def unless_directed(self, find: Callable[[], None]) -> None:
        """Launch `find` if the direction is still to be found."""
        wp.capture_if(self.numbers[NO_DIRECTION], find)

    def judge_direction(
        self, imbalance: wp.array, unsettled: float, dt: wp.array, together: wp.array, count: int
    ) -> None:
        """The direction is found, its length known, and `imbalance` (1,) [J] where it begins: extend a budget that ends
        in the middle of something, by `unsettled` [m/s] times `dt` (1,) [s] too, or with the cloth's `count` vertices
        ADRIFT, whose moves sum up to `together` (1,) m; or drop its last if it overshoots."""
        told = [imbalance, unsettled, dt, together, count]
        self._launch(judge_direction_kernel, told, [self.state, self.lengths])

    @property
    def least_yet(self) -> wp.array:
        """(1,) int32: did the iteration begin nearer to balance than all before it?"""
        return self.numbers[LEAST_YET]

    def if_free_to_move(self, move: Callable[[], None]) -> None:
        """Launch `move` if the direction can be taken; else the loop ends, for a search where there is one left."""
        self._launch(decide_kernel, [], [self.state])
        wp.capture_if(self.numbers[FREE_TO_MOVE], move)

    def judge_move(self, shortest: float, dt: wp.array) -> None:
        """The direction is taken: end the loop with the budget, or when nothing moved by `shortest` m/s times `dt`."""
        self._launch(judge_move_kernel, [shortest, dt], [self.state, self.lengths])

    def if_going_on(self, look: Callable[[], None]) -> None:
        """Launch `look` if there is another iteration after this move."""
        wp.capture_if(self.numbers[LOOKING], look)

    def if_ended_well(self, torn: float, mass: wp.array, harmless: float, end: Callable[[], None]) -> None:
        """Launch `end` where the loop has ended as it should: not for the host to do something, nor astray by more
        than `mass` (1,) kg has at the speed `harmless` [m/s], with cloth that is stretched no more than `torn`."""
        self._launch(judge_ending_kernel, [torn, mass, harmless], [self.state, self.lengths])
        wp.capture_if(self.numbers[ENDED_WELL], end)

    def if_sound(self, violations: wp.array, pairs: ContactPairs, conclude: Callable[[], None]) -> None:
        """Launch `conclude` where there are no `violations` (1,) and there is room for all `pairs`."""
        self._launch(judge_state_kernel, [violations, pairs.counters, pairs.capacity], [self.state])
        wp.capture_if(self.numbers[CONCLUDED], conclude)

    def start_here(self) -> None:
        """Go on from x_feasible, looked around: the trial is not tried, nor are directions trusted by its length."""
        self.numbers[STARTING].zero_()
        self.numbers[WANTS_SEARCH].zero_()
        self.numbers[NO_DIRECTION].fill_(1)
        self.numbers[GOING_ON].fill_(1)
        self.ways[TRIAL].zero_()

    def resume(self, searches: int, starting: bool) -> None:
        """What the loop ended for is done; so many further searches are left. If it is still `starting`, the iteration
        begins anew."""
        self.numbers[GOING_ON].fill_(1)
        for done in (WANTS_SEARCH, WANTS_ROOM, UNFITTED):
            self.numbers[done].zero_()
        if starting:
            self.numbers[NO_DIRECTION].fill_(1)
        self.numbers[SEARCHES].fill_(searches)

    def limit(self, most: int) -> None:
        """No more than so many further directions are to be found."""
        self._launch(limit_kernel, [most], [self.state])

    def hurry(self, in_time: int, at_most: int) -> None:
        """So many further directions are to be found before the deadline, and so many at most."""
        self._launch(hurry_kernel, [in_time, at_most], [self.state])

    def read(self, pairs: ContactPairs | None = None, figures: Mapping[str, wp.array] = NO_FIGURES) -> Outcome:
        """Waits for the device. `pairs` know their size then, too; `figures` are read along."""
        counted = [] if pairs is None else [pairs.counters]
        state, lengths, *told = read(self.state, self.lengths, *counted, *figures.values())
        found = 0 if pairs is None else pairs.know_size(told[0])
        named = dict(zip(figures, told[len(counted) :], strict=True))
        least, _, began, last = map(float, lengths[3:7])
        wanted, moved, strayed = float(lengths[0]), float(lengths[1]), bool(state[13])
        why = bool(state[14]), bool(state[8]), bool(state[9])
        leaving, iterations = int(state[21] if why[0] else state[6]), int(state[7])
        stretch, carried = float(lengths[12]), float(lengths[17])
        near, concluded = int(state[18]) == int(WITHIN), bool(state[23])
        return Outcome(
            *why,
            iterations,
            leaving,
            found,
            moved,
            wanted,
            strayed,
            least,
            began,
            last,
            stretch,
            near,
            concluded,
            carried,
            int(state[5]),
            bool(state[26]),
            named,
        )

    def _launch(self, kernel: wp.Kernel, inputs: Sequence[object], outputs: Sequence[wp.array]) -> None:
        launch(kernel, 1, inputs, outputs, device=self.state.device)
