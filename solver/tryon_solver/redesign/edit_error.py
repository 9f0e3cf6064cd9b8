"""Why an edit is refused."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

from tryon_solver.geometry.located_error import LocatedError


class EditError(LocatedError):
    """An edit that is none, or that would make an invalid garment: what is wrong, where, and what to do about it."""


def choose_one_of(given: str, known: Iterable[str]) -> str:
    """The remedy for a name that is none of those known: the closest, or else all of them."""
    names = list(known)
    close = get_close_matches(given, names, n=1)
    return f"Did you mean {close[0]!r}?" if close else f"Use one of {', '.join(names)}"
