"""How much of its budgets a step spends: all of them, or what a deadline leaves time for.

Every iterate of the correction is free of contact, so that it may end at any of them: a deadline costs accuracy and
never freedom from penetration. Sub-steps of the body are those of the settings: longer ones hold more cloth back, and
pinched cloth that is held back is torn. What they leave the scheme's cycles and the correction share, less what comes
after these is expected to take: all cycles or one, and the correction has the rest. When its time is over it ends as
soon as it is near enough by a coarse measure, `Settings.late_nearness`, and goes on, late, until it is, for as long as
without a deadline: cloth that is left further from balance is crumpled, then torn, and its next steps are dearer than
what was saved. Iterations are thorough, with the gradients and searches of what is bought, where there is time for as
many of such as the budget has; else brief, with those that it has. What a part takes is what it took lately: all but
the dearest of its last WINDOW times, and no more than HICCUP times the second dearest: a processor that did something
else for once would else cost accuracy in all of them. Ours.
"""

from __future__ import annotations

import time as clock
from collections import deque
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import warp as wp

from tryon_solver.linalg.read_back import wait
from tryon_solver.results import StepReport
from tryon_solver.settings import Settings

WINDOW = 60  # times that are remembered of each part
DEAREST = 0.01  # share of them that a part may exceed: as many frames may be late
HICCUP = 2.0  # times as long as all others, one alone is no reason to expect such
LEAST = 2  # iterations that are planned for when cycles are chosen
START = 2  # times as long as an iteration it takes to choose where the first begins
RESERVE = 0.03  # share of the deadline that nothing is planned for
GUESSED = 1 / 20  # of the deadline, what a part takes that was not seen yet; but
INSTANT = 1e-6  # s: nothing takes less
MOST_LOOKED_AT = 12_000  # candidates for each vertex of the cloth, by all iterations of a step; and
LEAST_CROWDED = 4  # iterations all the same


@dataclass(frozen=True)
class Allowance:
    """Newton iterations of a correction: so many `in_time`, and `at_most`, of which those that are late end where they
    are near enough (`Settings.late_nearness`)."""

    in_time: int
    at_most: int


class Pace(Protocol):
    """What a step may spend, asked in the order of the step.

    Attributes:
        thorough: does the correction that was asked about last have the gradients and searches of what is bought?
    """

    thorough: bool

    @property
    def over(self) -> bool:
        """Is the step's time over?"""

    def begin(self) -> None:
        """A call of `advance` begins."""

    def begin_step(self, left: int) -> None:
        """A step begins, the first of the `left` that are to be made in this call."""

    def cycles(self) -> int:
        """Cycles of the scheme, after the sub-steps."""

    def iterations(self, most: int) -> Allowance:
        """Of the correction, of `most` by the settings; waits for the device where time counts."""

    def again(self, most: int) -> Allowance:
        """Of a correction that is done again, late or not; none where there are too many candidates for it."""

    def more(self, made: int, candidates: int) -> Allowance | None:
        """What is left of it to a correction that stopped on the way after so many, with so many candidates on its list
        from there on; None: what it has left."""

    def corrected(self, iterations: int) -> None:
        """The correction has made so many; the device has been waited for."""

    def end(self) -> float:
        """The call ends, the device has been waited for: how long after its deadline [s], 0 without one."""


class Unhurried:
    """Without a deadline: what the settings say, but of iterations on a long list of candidates no more than go through
    MOST_LOOKED_AT of them for each of the cloth's `vertices` in a step, and LEAST_CROWDED.

    What an iteration takes is what its list is long. Where all of a garment is pushed decimetres at once, by a storm
    or a hundred times a balloon's pressure, that is a hundred times as much as usual, and the budgets, that are meant
    for blows, are all spent: a step ended after minutes. It ends where it has come to, which is free, and the next
    step goes on from there. Where a step is to be the full energy's, or as accurate as asked, it takes what it takes.
    """

    def __init__(self, settings: Settings, vertices: int) -> None:
        self.thorough = True
        self._cycles = settings.outer_iterations
        bounded = settings.contact_passes == 1 and settings.ends_by_budget
        self._most = MOST_LOOKED_AT * vertices if bounded else None
        self._left, self._made, self._listed = 0, 0, 0

    @property
    def over(self) -> bool:
        return False

    def begin(self) -> None:
        pass

    def begin_step(self, left: int) -> None:  # noqa: ARG002 - as Pace has it
        self._left, self._made, self._listed = self._most or 0, 0, 0

    def cycles(self) -> int:
        return self._cycles

    def iterations(self, most: int) -> Allowance:
        return Allowance(most, most)

    def again(self, most: int) -> Allowance:
        if self._most is None or not self._listed:
            return Allowance(most, most)
        affordable = min(most, max(0, self._left // self._listed))
        count = affordable if affordable >= min(most, LEAST_CROWDED) else 0
        return Allowance(count, count)

    def more(self, made: int, candidates: int) -> Allowance | None:
        self._look_at(made)
        self._listed = candidates
        if self._most is None or not candidates:
            return None
        count = max(LEAST_CROWDED - made, self._left // candidates, 0)
        return Allowance(count, count)

    def corrected(self, iterations: int) -> None:
        self._look_at(iterations)
        self._made = 0

    def end(self) -> float:
        return 0.0

    def _look_at(self, made: int) -> None:
        """So many iterations of the correction are made, those since the last time over the list as it was then."""
        self._left -= (made - self._made) * self._listed
        self._made = made


def time_of_iteration(report: StepReport) -> float | None:
    """What one of the corrections' iterations took [s], by the report of a call of `advance`; None: it made none."""
    iterations = report.newton_iterations
    took = report.times_ms.get("correct_penetration", 0.0)
    return 1e-3 * took / (START * report.steps + iterations) if took and iterations else None


@dataclass
class Cost:
    """What one of something takes [s]; `first` until one was seen."""

    first: float
    seen: deque[float] = field(default_factory=lambda: deque(maxlen=WINDOW))

    def add(self, seconds: float, count: int = 1) -> None:
        """So many took so long together."""
        self.seen.append(seconds / count)

    @property
    def expected(self) -> float:
        """All but the dearest take less."""
        if not self.seen:
            return max(self.first, INSTANT)
        second = sorted(self.seen)[-2:][0]
        return max(min(float(np.quantile(self.seen, 1 - DEAREST)), HICCUP * second), INSTANT)


class Hurried:
    """With a deadline [s] for each call of `advance`, met by what its parts took in the calls before. `iteration` s is
    what one of the correction took without a deadline, if that is known."""

    def __init__(self, settings: Settings, device: str, iteration: float | None = None) -> None:
        self._device = device
        self.buy(settings)
        guess = GUESSED * self._deadline
        self.thorough = True
        self._tail = Cost(guess)
        self._thorough, self._brief = Cost(guess), Cost(guess)  # iterations
        self._dearer = 0.0  # times as dear as brief ones thorough ones were when both were taken in turn; 0: taken last
        if iteration is not None:
            self._brief.add(iteration)
            self._dearer = settings.pcg_iterations / settings.correction_pcg_iterations
        self._each = self._brief.expected  # what iterations of the correction that was asked about last take
        self._one, self._all = Cost(guess), Cost(guess)  # cycles, each with search and proxy
        self._times = 0.0  # as dear as one cycle all were when both were taken in turn; 0: all were taken last
        self._cycles = 1
        self._most = self._promised = 0  # iterations: at most, and late or not where none is near enough
        self._begun = self._step_end = self._since = 0.0
        self._corrected = self._repeated = False

    def buy(self, settings: Settings) -> None:
        """From the next call on, with these settings' deadline; what was seen of parts stands."""
        assert settings.deadline is not None
        self._deadline, self._most_cycles = settings.deadline, settings.outer_iterations
        self._budget = settings.correction_iterations
        self._longest = self._budget * (1 + settings.correction_extensions)

    @property
    def over(self) -> bool:
        return self._left() <= 0.0

    def begin(self) -> None:
        self._begun = clock.perf_counter()
        self._corrected = False

    def begin_step(self, left: int) -> None:
        now = clock.perf_counter()
        self._end_tail(now)
        end = self._begun + (1 - RESERVE) * self._deadline
        self._step_end = now + max(0.0, end - now) / left

    def cycles(self) -> int:
        self._since = clock.perf_counter()
        spare = self._left() - self._tail.expected - (START + LEAST) * self._each
        dear = self._times * self._one.expected if self._times else self._all.expected
        self._cycles = self._most_cycles if dear <= spare else 1
        return self._cycles

    def iterations(self, most: int) -> Allowance:
        wait(wp.get_device(self._device))
        now = clock.perf_counter()
        if self._cycles == self._most_cycles:
            self._all.add(now - self._since)
            self._times = 0.0
        else:
            self._one.add(now - self._since)
            self._times = self._times or self._all.expected / self._one.expected
        self._since = now
        dear = self._dearer * self._brief.expected if self._dearer else self._thorough.expected
        self.thorough = self._affordable(dear) >= self._budget
        self._each = dear if self.thorough else self._brief.expected
        return self._allow(most, min(most, self._longest), repeated=False)

    def again(self, most: int) -> Allowance:
        return self._allow(most, most, repeated=True)

    def more(self, made: int, candidates: int) -> Allowance | None:  # noqa: ARG002 - as Pace has it
        in_time = max(0, min(self._most - made, START + self._affordable(self._each)))
        return Allowance(in_time, max(in_time, self._promised - made))

    def corrected(self, iterations: int) -> None:
        now = clock.perf_counter()
        if not self._repeated:  # those have a budget of their own, and say nothing of these
            made = self._thorough if self.thorough else self._brief
            made.add(now - self._since, START + iterations)
            self._dearer = 0.0 if self.thorough else self._dearer or self._thorough.expected / self._brief.expected
        self._since, self._corrected = now, True

    def end(self) -> float:
        now = clock.perf_counter()
        self._end_tail(now)
        return max(0.0, now - self._begun - self._deadline)

    def _end_tail(self, now: float) -> None:
        if self._corrected:
            self._tail.add(now - self._since)
            self._corrected = False

    def _allow(self, most: int, promised: int, repeated: bool) -> Allowance:
        self._most, self._promised, self._repeated = most, promised, repeated
        in_time = min(most, max(0, self._affordable(self._each)))
        return Allowance(in_time, max(in_time, promised))

    def _left(self) -> float:
        return self._step_end - clock.perf_counter()

    def _affordable(self, dear: float) -> int:
        """Iterations that take so long each [s], after choosing where they begin."""
        return int((self._left() - self._tail.expected) / dear) - START
