"""What can go wrong, as a value: where it happened and what the person in front of the screen can do about it."""

from __future__ import annotations

import msgspec


class Problem(msgspec.Struct, frozen=True, kw_only=True):
    """One thing that is wrong with what somebody sent or asked for.

    The same four fields travel in REST replies and in the protocol's error messages.

    Attributes:
        code: stable word for programs, for example ``"pattern.invalid"``.
        place: where it is, for example ``"panels.front.edges[3].curvature"``; empty when it concerns the whole request.
        message: what is wrong, for people.
        remedy: what to do about it, for people.
    """

    code: str
    place: str
    message: str
    remedy: str

    def line(self) -> str:
        """The problem as one line of text for a terminal or a log."""
        where = f" ({self.place})" if self.place else ""
        return f"{self.message}{where}. {self.remedy}"


class ProblemError(Exception):
    """A problem on its way to whoever asked.

    Attributes:
        problem: what is wrong.
        status: the HTTP status that fits, for the REST side.
    """

    def __init__(self, problem: Problem, status: int = 400) -> None:
        super().__init__(problem.line())
        self.problem = problem
        self.status = status


def problem_error(code: str, message: str, remedy: str, *, place: str = "", status: int = 400) -> ProblemError:
    """A ``ProblemError`` in one call."""
    return ProblemError(Problem(code=code, place=place, message=message, remedy=remedy), status)
