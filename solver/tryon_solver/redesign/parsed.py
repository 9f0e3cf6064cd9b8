"""Patterns of specifications that stand in a history: an edit's outcome is parsed once, though asked for many times."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

from tryon_solver.geometry.pattern import Pattern, parse_pattern

KEPT = 12  # the one worn, the one wanted, and a few that are undone and made again, most of them as two

_kept: deque[tuple[Mapping[str, Any], Pattern]] = deque(maxlen=KEPT)


def parsed(specification: Mapping[str, Any]) -> Pattern:
    """`parse_pattern` of a specification that nobody writes to any more. Raises PatternError as that."""
    for known, pattern in tuple(_kept):
        if known is specification:
            return pattern
    pattern = parse_pattern(specification)
    _kept.append((specification, pattern))
    return pattern


def keep_also_for(held: Mapping[str, Any], specification: Mapping[str, Any]) -> None:
    """What was parsed of this one lately is kept for `held`, too, which stands for it in the history."""
    for known, pattern in tuple(_kept):
        if known is specification and held is not known:
            _kept.append((held, pattern))
