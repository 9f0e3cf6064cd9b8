"""What the command line and the REST side have in common: advice, options of the one as parameters of the other; and
what both read of text."""

from __future__ import annotations

import re
from collections.abc import Sequence

import msgspec

from tryon_server.problems import Problem, problem_error

PARAMETERS = {  # longer options first: shorter ones are parts of them
    "--body-units": "units",
    "--body-up": "up",
    "--body-fps": "fps",
    "--body-animation": "animation",
    "--body-facing": "facing",
    "--motion-units": "units",
    "--motion-up": "up",
    "--motion-joint ": "joint=",
    "--motion-facing": "facing",
    "--rest-shape ": "rest_shape=",
    "--rest-shape": "rest_shape",
    "--size": "size",
    "--units": "units",
    "--up": "up",
}
PRESETS = (  # a session's mesh is as fine as its preset
    (re.compile(r"\ba (shorter|smaller) edge length( than [0-9.e-]+ m)?"), "a finer preset"),
    (re.compile(r"\ba (longer|larger) edge length"), "a coarser preset"),
)


def as_parameters(text: str) -> str:
    """The text with the parameters of an upload or a session in place of the command's options."""
    for option, parameter in PARAMETERS.items():
        text = text.replace(option, parameter)
    for choice, preset in PRESETS:
        text = choice.sub(preset, text)
    return text


def joints_told(told: Sequence[str] | None, place: str) -> dict[str, str] | None:
    """Part of the body -> joint of a file, of a PART=NAME each; None where nothing is told.

    `place` is where it was told. Raises ProblemError 422 for what is no such pair, or tells of a part twice.
    """
    joints: dict[str, str] = {}
    for text in told or ():
        part, _, name = (word.strip() for word in text.partition("="))
        if not (part and name) or part in joints:
            why = f"{part} is told twice" if part in joints else f"{text!r} is not PART=NAME"
            remedy = "Say PART=NAME, such as left_forearm=LeftElbow, once of each part"
            raise problem_error("motion.joint", why, remedy, place=place, status=422)
        joints[part] = name
    return joints or None


def in_parameters(problem: Problem) -> Problem:
    """The problem in words for who uploads."""
    return msgspec.structs.replace(
        problem, message=as_parameters(problem.message), remedy=as_parameters(problem.remedy)
    )
