"""Runs one case in this process."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from harness.frames import Frames
from harness.judgement import judged
from harness.oracle import listening
from harness.others import OURS, InexpressibleError, played_by
from harness.play import Tell, play
from harness.scene import Ask, HardScene, Run
from harness.subject import Simulated, Subject


def run_one(
    scene: HardScene,
    ask: Ask,
    every: int = 1,
    tell: Tell = print,
    solver: str = OURS,
    frames: Path | None = None,
    by_launches: bool = False,
) -> dict[str, Any]:
    """The case's figures and the limits it broke, ready for JSON; by another `solver` instead of ours.

    A set-up that raises has refused the case: right for a case that is to be refused, by an error that says what it
    must; else a failure. IPC Toolkit is asked about every `every`-th frame and the ways to it, of cloth alone about
    all. What is seen is kept in the file `frames`, if there is to be one. `by_launches` a GPU runs it
    without graphs: all moves are heard.
    """
    told = {"name": scene.name, "stresses": scene.stresses}
    try:
        run = scene.set_up(ask)
    except ValueError as error:
        refusal = f"{type(error).__name__}: {error}"
        right = bool(scene.refused and re.search(scene.refused, str(error)))
        return {**told, "refused": refusal, "failure": "" if right else f"refused: {refusal}", "broken": []}

    def watched(subject: Subject) -> dict[str, Any]:
        seen = Frames.of(subject, run.dt)
        tracked = run.tracked if run.told else None
        note = seen.note if frames else None
        # alone, cloth may pass through cloth within a frame and leave no trace in those after it
        asked = every if len(subject.body_faces) else 1
        record = play(subject, run.dt, ask.seconds, asked, run.worn, run.noise, tracked, tell, note)
        if frames:
            seen.save(frames)
        return judged(record, run.asked, scene.stated)

    if solver != OURS:
        return {**told, **by_another(run, solver, watched)}
    with listening(by_launches) as heard:
        result = {**told, **watched(Simulated(run, heard))}
    if scene.refused and not result["failure"] and result["broken"]:
        result["failure"] = "neither refused by name nor resolved"
    return result


def by_another(run: Run, solver: str, watched: Callable[[Subject], dict[str, Any]]) -> dict[str, Any]:
    """The same figures of another solver, but for the energy; a failure where the case can't be expressed."""
    try:
        subject = played_by(solver, run)
    except InexpressibleError as error:
        return {"failure": f"not expressible: {error}", "broken": []}
    return {**watched(subject), "growth": None}
