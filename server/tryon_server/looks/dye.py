"""A colour that somebody dyes a fabric with."""

from __future__ import annotations

import re

from tryon_server.problems import problem_error

HEX = re.compile(r"#?([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})")


def read_dye(told: str | None) -> tuple[float, float, float] | None:
    """A colour of the web (RRGGBB, sRGB) as linear RGB, 0 to 1; None for None.

    Raises:
        ProblemError: 422, it is no such colour.
    """
    if told is None:
        return None
    found = HEX.fullmatch(told)
    if found is None:
        remedy = "Give six hexadecimal digits, two each of red, green and blue, for example 2c3a55"
        raise problem_error("dye.invalid", f"{told!r:.60} is no colour", remedy, place="dye", status=422)
    red, green, blue = (_linear(int(part, 16) / 255) for part in found.groups())
    return (red, green, blue)


def _linear(seen: float) -> float:
    """IEC 61966-2-1, from sRGB."""
    return seen / 12.92 if seen <= 0.04045 else ((seen + 0.055) / 1.055) ** 2.4
