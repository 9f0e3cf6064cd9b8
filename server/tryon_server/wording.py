"""The same advice for the command line and for the REST side: options of a command as parameters of a request."""

from __future__ import annotations

import re

import msgspec

from tryon_server.problems import Problem

PARAMETERS = {  # longer options first: shorter ones are parts of them
    "--body-units": "units",
    "--body-up": "up",
    "--body-fps": "fps",
    "--body-animation": "animation",
    "--body-facing": "facing",
    "--motion-units": "units",
    "--motion-facing": "facing",
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


def in_parameters(problem: Problem) -> Problem:
    """The problem in words for who uploads."""
    return msgspec.structs.replace(
        problem, message=as_parameters(problem.message), remedy=as_parameters(problem.remedy)
    )
