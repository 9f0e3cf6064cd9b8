"""The error of single steps: each from a state of the float64 reference, held to where that is after the same step."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from accuracy_case import AccuracyCase
from accuracy_limits import is_within
from against_reference import KEPT_IN, ReferenceStep, known_contacts
from error_measures import Measures, rounded
from methods import Method
from recorded import Writer
from steppers import Stepper, stepper_of
from worn_start import Worn, worn_at_start

from tryon_solver.baselines.newton_ipc import Motion, Reference
from tryon_solver.baselines.newton_ipc.newton import NotConvergedError
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import Simulation, build

FIRST = 3  # steps of the reference that are not counted: its contacts begin without having given
EXPLAINED = 4.0
TRAJECTORY = 0.5  # s: cloth buckles, and after a while two ways that began alike have no more in common


def reference_steps(worn: Worn, case: AccuracyCase, until: int | None = None) -> Iterator[ReferenceStep]:
    """The reference's steps that count, numbered from FIRST + 1 on, to the `until`-th that does or all of the case's;
    kept on disk. One that finds no balance counts as none: the ones after it begin where that has come to."""
    ref, pose_at = Reference(worn.scene.scene, kept_in=KEPT_IN), worn.scene.pose_at
    motion = Motion(worn.x, worn.v, pose_at(0))
    last = case.states if until is None else min(until, case.states)
    for number in range(1, FIRST + last + 1):
        pose = pose_at(number)
        try:
            after = ref.step(motion, pose, case.dt)
        except NotConvergedError as error:
            motion = ref.moved(motion, pose, case.dt, error.nearest)
            continue
        assert ref.solved is not None
        if number > FIRST:
            yield ReferenceStep(number, motion, after, ref.solved.last_move)
        motion = after


def measure_errors(
    case: AccuracyCase,
    methods: Mapping[str, Method],
    device: str,
    writer: Writer,
    tell: Callable[[str], None],
    every: int = 1,
    explain: bool = False,
    until: int | None = None,
) -> None:
    """A row of each method for each `every`-th state: `state`, `method`, what `Measures` says of the end, the `ms`
    under way and what the solver told. What is in the writer's file is not measured again; states after the `until`-th
    are left to another run.

    To `explain` is to tell, where the estimate is not within EXPLAINED times the error, `own_balance` as well.
    """
    worn = worn_at_start(case)
    measures = Measures(worn.scene, worn.x, case.dt)
    finder: Simulation = build(worn.scene.scene, PRESETS["live"], "cpu", worn.scene.pose_at(0), tangled=True)
    steppers: dict[str, Stepper] = {}
    for step in reference_steps(worn, case, until):
        state = step.number - FIRST
        if (state - 1) % every or is_whole(writer, state, methods):
            continue
        writer.drop(state)
        measures.begin(step)
        contacts = known_contacts(finder, step.before)
        rows = []
        for name, method in methods.items():
            if name not in steppers:
                steppers[name] = stepper_of(worn.scene, method, device)
                if steppers[name].is_compiled:  # or captured: with a first step, which is not timed
                    steppers[name].begin(step.before, contacts)
                    steppers[name].step(worn.scene.pose_at(step.number), case.dt)
            steppers[name].begin(step.before, contacts)
            ended = steppers[name].step(worn.scene.pose_at(step.number), case.dt)
            row = {"state": state, "method": name, **measures.of(ended.x), "ms": rounded(ended.ms), **ended.told}
            if explain and not is_within(row, EXPLAINED):
                row["own_balance"] = measures.own_balance(ended.x)
            rows.append(row)
        writer.add(rows)
        tell(f"state {state}: {', '.join(said(row) for row in rows[:4])}")


def measure_trajectories(
    case: AccuracyCase, methods: Mapping[str, Method], device: str, writer: Writer, tell: Callable[[str], None]
) -> None:
    """The same of ways that begin together, at the first state, and go on by themselves for TRAJECTORY s."""
    worn = worn_at_start(case)
    measures = Measures(worn.scene, worn.x, case.dt)
    finder: Simulation = build(worn.scene.scene, PRESETS["live"], "cpu", worn.scene.pose_at(0), tangled=True)
    steppers: dict[str, Stepper] = {}
    for step in reference_steps(worn, case):
        state = step.number - FIRST
        if state * case.dt > TRAJECTORY * (1 + 1e-9):
            return
        measures.begin(step)
        rows = []
        for name, method in methods.items():
            if name not in steppers:
                steppers[name] = stepper_of(worn.scene, method, device)
                steppers[name].begin(step.before, known_contacts(finder, step.before))
            ended = steppers[name].step(worn.scene.pose_at(step.number), case.dt)
            if not is_whole(writer, state, methods):
                rows.append({"state": state, "method": name, **measures.of(ended.x), **ended.told})
        writer.add(rows)
        tell(f"state {state}: {', '.join(said(row) for row in rows)}")


def is_whole(writer: Writer, state: int, methods: Mapping[str, Method]) -> bool:
    """Are there rows of all methods of that state?"""
    return {row["method"] for row in writer.rows if row["state"] == state} >= set(methods)


def said(row: Mapping[str, Any]) -> str:
    """A row in short."""
    return f"{row['method']} {row['error']} mm"
