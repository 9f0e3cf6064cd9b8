"""A scene's solver, in float32 or in float64, that is put into a state and takes one step, watched verb by verb."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from in_float64 import twin_module, twin_of

from tryon_solver import simulation
from tryon_solver.results import StepReport
from tryon_solver.scene import Scene
from tryon_solver.settings import Settings
from tryon_solver.stepping import correct

CARRIED_OVER = ("x", "v", "skin", "hold")  # arrays of the state that a step may find from the one before


@dataclass(frozen=True)
class Moment:
    """All that a simulation takes into its next step, copied."""

    state: dict[str, np.ndarray]  # as in State
    solved: np.ndarray  # (A, 3) float32 m
    skin_now: np.ndarray  # (B, 3) float32 m
    stance: Any  # of the body
    time: float  # s
    still: tuple[float, float]  # s, m^2/s^2
    asleep: bool
    went_back: bool
    kept: tuple[tuple[np.ndarray, np.ndarray], ...]  # how far contacts have given, by contact term

    @staticmethod
    def of(sim: simulation.Simulation) -> Moment:
        """Of a simulation of a body, between two steps."""
        state, body = sim.state, sim.body
        assert body is not None
        return Moment(
            {name: getattr(state, name).numpy().copy() for name in CARRIED_OVER},
            sim.solved.numpy().copy(),
            body.skin_now.numpy().copy(),
            body.pose,
            state.time,
            (state.still, state.liveliest),
            state.asleep,
            sim.went_back,
            tuple(term.kept() for term in sim.stages.contact),
        )

    def moved(self, most: float, random: np.random.Generator) -> Moment:
        """The same with each coordinate of x moved by up to `most` of the spacing of float32 there, in float64."""
        x = self.state["x"]
        there = x.astype(np.float64) + most * np.spacing(np.abs(x)) * random.uniform(-1, 1, x.shape)
        return replace(self, state={**self.state, "x": there})

    def put_into(self, sim: Any, same: Callable[[Any], Any]) -> None:
        """Let a simulation go on from here; `same` makes values of its precision of ours."""
        for name, values in self.state.items():
            getattr(sim.state, name).assign(same(values))
        sim.solved.assign(same(self.solved))
        sim.body.skin_now.assign(same(self.skin_now))
        sim.body.pose = same(self.stance)
        sim.state.time, sim.state.asleep = self.time, self.asleep
        sim.state.still, sim.state.liveliest = self.still
        sim.went_back = self.went_back
        for term, kept in zip(sim.stages.contact, self.kept):
            term.restore(*kept)


@dataclass
class Taken:
    """A step that was taken: its report, and where the cloth is, (N, 3) float64 m, at its end, after each of its verbs
    and after each of Newton's moves."""

    report: StepReport
    x: np.ndarray
    verbs: list[tuple[str, np.ndarray]] = field(default_factory=list)
    moves: list[np.ndarray] = field(default_factory=list)

    def after(self, verb: str) -> np.ndarray:
        """The cloth where the verb was first done."""
        return next(x for name, x in self.verbs if name == verb)

    def trial(self) -> np.ndarray:
        """The cloth as the first correction finds it."""
        names = [name for name, _ in self.verbs]
        return self.verbs[names.index("correct_penetration") - 1][1]


class Stepper:
    """A simulation of a scene with a body, as it is or as its twin in float64."""

    def __init__(self, scene: Scene, settings: Settings, stance: Any, in_float64: bool) -> None:
        """`stance` is any of the body's; a step sets its own."""
        self._same: Callable[[Any], Any] = twin_of if in_float64 else lambda value: value
        build = twin_module("simulation").build if in_float64 else simulation.build
        self._correct = twin_module("stepping.correct") if in_float64 else correct
        self.sim = build(self._same(scene), self._same(settings), "cpu", self._same(stance), tangled=True)

    def step(self, moment: Moment, stance: Any, time: float) -> Taken:
        """From the moment to the body's `stance` at `time` s."""
        sim = self.sim
        moment.put_into(sim, self._same)
        verbs: list[tuple[str, np.ndarray]] = []
        moves: list[np.ndarray] = []
        timed, iterate = sim.timed, self._correct.iterate

        def watched(verb: Callable[..., None], *arguments: object) -> None:
            timed(verb, *arguments)
            verbs.append((verb.__name__, cloth(sim)))

        def counted(*arguments: object) -> None:
            before = cloth(sim)
            iterate(*arguments)
            after = cloth(sim)
            if not np.array_equal(before, after):  # some only ask for a search
                moves.append(after)

        sim.timed, self._correct.iterate = watched, counted
        try:
            report = sim.advance(self._same(stance), time)
        finally:
            sim.timed, self._correct.iterate = timed, iterate
        return Taken(report, cloth(sim), verbs, moves)


def cloth(sim: Any) -> np.ndarray:
    """(N, 3) float64 m"""
    return np.array(sim.state.x.numpy()[: sim.cloth_count], np.float64)
