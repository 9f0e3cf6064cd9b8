"""Runs one case in this process."""

from __future__ import annotations

import re
from typing import Any

from harness.baseline import ByBaseline, InexpressibleError
from harness.judgement import judged
from harness.oracle import listening
from harness.recording import Tell, play
from harness.scene import Ask, HardScene, Run
from harness.subject import Simulated

OURS = "ours"


def run_one(
    scene: HardScene, ask: Ask, every: int = 1, tell: Tell = print, solver: str = OURS
) -> dict[str, Any]:
    """The case's figures and the limits it broke, ready for JSON; by `solver` of SOLVERS instead of ours.

    A set-up that raises has refused the case: right for a case that is to be refused, by an error that says what it
    must; else a failure.
    """
    told = {"name": scene.name, "stresses": scene.stresses}
    try:
        run = scene.set_up(ask)
    except ValueError as error:
        refusal = f"{type(error).__name__}: {error}"
        right = bool(scene.refused and re.search(scene.refused, str(error)))
        return {**told, "refused": refusal, "failure": "" if right else f"refused: {refusal}", "broken": []}
    if solver != OURS:
        return {**told, **by_baseline(scene, run, ask, every, tell, solver)}
    with listening() as heard:
        record = play(Simulated(run, heard), run.dt, ask.seconds, every, run.worn, run.noise, tell)
    result = {**told, **judged(record, run.stops, run.rests, run.squeezed, scene.stated)}
    if scene.refused and not result["failure"] and result["broken"]:
        result["failure"] = "neither refused by name nor resolved"
    return result


def by_baseline(scene: HardScene, run: Run, ask: Ask, every: int, tell: Tell, solver: str) -> dict[str, Any]:
    """The same figures of another solver, but for the energy; a failure where the case can't be expressed."""
    try:
        subject = ByBaseline(run, solver)
    except InexpressibleError as error:
        return {"failure": f"not expressible: {error}", "broken": []}
    record = play(subject, run.dt, ask.seconds, every, run.worn, run.noise, tell)
    return {**judged(record, run.stops, run.rests, run.squeezed, scene.stated), "growth": None}
