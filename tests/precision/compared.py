"""Steps in float32 held against the same steps in float64."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from precision_cases import Case
from twin_step import Moment, Stepper, Taken

from tryon_solver.settings import PRESETS, Settings
from tryon_solver.simulation import build

PLACES = ("carried", "contact-free", "cycles", "first move", "end")  # in a step: where both are compared
BUDGETS = ("outer_iterations", "correction_iterations", "correction_pcg_iterations", "searches", "deflection_passes")
PASSES = 20  # at most; a step ends them when a correction ends below its tolerance
SAME_IN_FLOAT32 = 0.49  # of its spacing: so far from a float32 all float64 are rounded to it


@dataclass(frozen=True)
class Apart:
    """Of a step, taken twice: how far each of the cloth's vertices (N,) m is apart, by place in the step."""

    number: int
    at: dict[str, np.ndarray]
    one: Taken
    other: Taken

    @property
    def rms(self) -> float:
        """At the end, over the vertices [m]."""
        return rms(self.at["end"])

    @property
    def largest(self) -> float:
        """At the end [m]."""
        return float(self.at["end"].max())

    @property
    def same_counts(self) -> bool:
        """Did both take as many cycles and Newton iterations?"""
        one, other = self.one.report, self.other.report
        return (one.iterations, one.newton_iterations) == (other.iterations, other.newton_iterations)


@dataclass(frozen=True)
class Compared:
    """A step in float32 against float64; in float64 against float64, from starts that float32 does not tell apart; and
    the first again with contact passes, where that was asked."""

    precisions: Apart
    starts: Apart
    converged: Apart | None


def rms(lengths: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(lengths))))


def apart(number: int, one: Taken, other: Taken) -> Apart:
    """Two steps from one state, compared."""
    at = {
        "carried": (one.after("move_body"), other.after("move_body")),
        "contact-free": (one.after("solve_without_contact"), other.after("solve_without_contact")),
        "cycles": (one.trial(), other.trial()),
        "first move": (one.moves[0] if one.moves else one.x, other.moves[0] if other.moves else other.x),
        "end": (one.x, other.x),
    }
    return Apart(number, {place: np.linalg.norm(a - b, axis=1) for place, (a, b) in at.items()}, one, other)


def to_the_end(settings: Settings) -> Settings:
    """The same step with contact passes, each with the budget of preset live."""
    return replace(settings, contact_passes=PASSES, **{name: getattr(PRESETS["live"], name) for name in BUDGETS})


def compared_steps(case: Case, every: int, converge: int) -> Iterator[Compared]:
    """Each `every`th of the case's steps, from the states of a run in float32; each `converge`th of these with contact
    passes, too."""
    start, settings = case.stance_at(0), to_the_end(case.settings)
    run = build(case.scene, case.settings, "cpu", start, case.surface)
    single, double, again = (Stepper(case.scene, case.settings, start, is_double) for is_double in (False, True, True))
    ends = [Stepper(case.scene, settings, start, is_double) for is_double in (False, True)]
    random = np.random.default_rng(0)
    for number in range(1, case.last + 1):
        moment, to = Moment.of(run), (case.stance_at(number), number * case.dt)
        run.advance(*to)
        place = number - case.first
        if place < 0 or place % every:
            continue
        exact = double.step(moment, *to)
        elsewhere = again.step(moment.moved(SAME_IN_FLOAT32, random), *to)
        converged = None
        if place // every % converge == 0:
            converged = apart(number, *(stepper.step(moment, *to) for stepper in ends))
        precisions = apart(number, single.step(moment, *to), exact)
        yield Compared(precisions, apart(number, elsewhere, exact), converged)
