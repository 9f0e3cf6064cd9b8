"""What was promised: of each promise what was measured of it, and whether it holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from accuracy_data import table


@dataclass(frozen=True)
class Verdict:
    """Of one promise.

    Attributes:
        promise: what was to be shown.
        measured: in words and figures.
        parts: of what the promise is made of, each: does it hold? None where there is nothing to judge by.
    """

    promise: str
    measured: str
    parts: Sequence[bool]

    @property
    def holds(self) -> str:
        """In a word."""
        if not self.parts:
            return "not measured"
        return "yes" if all(self.parts) else "in part" if any(self.parts) else "no"

    @property
    def missed(self) -> bool:
        """Is there a part that does not hold?"""
        return not all(self.parts)


@dataclass(frozen=True)
class Chapter:
    """Promises that belong together, and in lines of Markdown what of them does not hold, or is to be known beside;
    none where all holds."""

    title: str
    verdicts: Sequence[Verdict]
    told: Sequence[str]


def promise_table(chapters: Sequence[Chapter]) -> list[str]:
    """A row for each promise."""
    rows = [(v.promise, v.measured, v.holds) for chapter in chapters for v in chapter.verdicts]
    return table(("promise", "measured", "holds"), rows)


def broken_lines(chapters: Sequence[Chapter]) -> list[str]:
    """What does not hold, by chapter."""
    lines: list[str] = []
    for chapter in chapters:
        if chapter.told:
            lines += ["", f"### {chapter.title}", "", *chapter.told]
    return lines[1:] or ["What was measured holds."]


def missed(chapters: Sequence[Chapter]) -> list[str]:
    """Promises that do not hold, a line each."""
    return [f"{v.holds}: {v.promise}: {v.measured}" for chapter in chapters for v in chapter.verdicts if v.missed]
