"""How long who asks would wait for an answer: the header `Prefer` of RFC 7240, its `respond-async` and `wait`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Header, Request

from tryon_server.api.access import services

DIGITS = 6  # of a `wait` that is read: more seconds than anybody waits


@dataclass(frozen=True)
class Wait:
    """How long to wait for what is asked for [s]; None: nothing was preferred. ``applied`` tells the client what was
    made of its preference, as `Preference-Applied` has it."""

    seconds: float | None
    applied: str = ""


def preferred(values: Iterable[str], longest: float) -> Wait:
    """What the values of the header ask for: no wait of `respond-async` alone, and none beyond the `longest` [s]. What
    is not known or malformed is not applied, as section 2 has it; of one that comes twice the first counts."""
    told: dict[str, str] = {}
    for value in values:
        for preference in value.split(","):
            name, _, word = preference.partition(";")[0].partition("=")
            told.setdefault(name.strip().lower(), word.strip().strip('"'))
    at_once = "respond-async" in told
    applied = ["respond-async"] if at_once else []
    seconds = 0.0 if at_once else None
    word = told.get("wait", "")
    if word.isascii() and word.isdecimal() and len(word) <= DIGITS:
        seconds = min(float(word), longest)
        applied.append(f"wait={seconds:g}")
    return Wait(seconds, ", ".join(applied))


def _wait(
    request: Request,
    prefer: Annotated[
        str | None,
        Header(
            description="RFC 7240: `respond-async` has what takes a while answered by 202 at once, `wait=N` once N "
            "seconds have gone by; `Preference-Applied` tells what was made of it"
        ),
    ] = None,
) -> Wait:
    settings = services(request).settings
    values = request.headers.getlist("prefer") or ([] if prefer is None else [prefer])
    return preferred(values, settings.longest_wait_seconds)


WaitDep = Annotated[Wait, Depends(_wait)]
