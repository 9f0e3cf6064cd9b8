"""Animations of a glTF file: which one is played, and what its keys say at any time.

Khronos Group, glTF 2.0 Specification, 3.11 (times strictly increasing, the first value before the first key and the
last after the last) and appendix C (interpolation).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.files.raw_mesh import MeshFileError

NAMES_LISTED = 12
STILL = 1e-6  # share of its largest number, or of 1, by which a value may vary and move nothing: rounding


@dataclass
class Channel:
    """What one sampler's keys do to one property of one node."""

    node: int
    path: str
    sampler: int
    times: np.ndarray  # (K,) s
    values: np.ndarray  # (K, width); cubic splines as (K, 3, width): tangent, value, tangent
    interpolation: str

    def at(self, time: float) -> np.ndarray:
        """(width,) the value at `time` s."""
        times, values = self.times, self.values
        k = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 1))
        cubic = self.interpolation == "CUBICSPLINE"
        here = values[k, 1] if cubic else values[k]
        if k + 1 >= len(times) or time <= times[0] or self.interpolation == "STEP":
            return here
        step = times[k + 1] - times[k]
        s = (time - times[k]) / step
        if cubic:
            after = values[k + 1, 1]
            out, into = values[k, 2], values[k + 1, 0]
            return (
                (2 * s**3 - 3 * s**2 + 1) * here
                + step * (s**3 - 2 * s**2 + s) * out
                + (3 * s**2 - 2 * s**3) * after
                + step * (s**3 - s**2) * into
            )
        if self.path == "rotation":
            return quaternions.slerp(here, values[k + 1], s)
        return (1 - s) * here + s * values[k + 1]

    def changes(self) -> bool:
        """Whether its value is not the same throughout."""
        cubic = self.interpolation == "CUBICSPLINE"
        values = self.values[:, 1] if cubic else self.values
        if self.path == "rotation":  # a quaternion and its negative are one rotation
            values = values * np.where(values @ values[0] < 0, -1.0, 1.0)[:, None]
        allowed = STILL * max(1.0, float(np.abs(values).max(initial=0.0)))
        slopes = self.values[:, [0, 2]] * float(np.ptp(self.times)) if cubic else np.zeros(1)
        return bool((np.ptp(values, axis=0) > allowed).any() or (np.abs(slopes) > allowed).any())

    def key_out_of_order(self) -> int | None:
        """The first key that is not later than the one before it."""
        wrong = np.flatnonzero(np.diff(self.times) <= 0)
        return int(wrong[0]) + 1 if len(wrong) else None


@dataclass(frozen=True)
class Choice:
    """Which of a file's animations is played."""

    names: tuple[str, ...]  # of all, in the file's order; those without a name of their own by their number
    played: int
    told: bool  # by the user

    def describe(self) -> str:
        """For people; "" where there was nothing to choose."""
        if len(self.names) < 2:
            return ""
        why = "as told" if self.told else "the first" if self.played == 0 else "the first that moves anything"
        return f"it has {len(self.names)} animations ({listed(self.names)}); {self.names[self.played]!r} is read, {why}"


def choose(
    animations: Sequence[dict[str, Any]], moves: Callable[[int], bool], wanted: str | None, name: str
) -> Choice | None:
    """The animation called `wanted`, without that the first that moves anything; None where there is none.

    `animations` as the document has them; `moves` says whether one of these, by its number, moves anything; `name` of
    the file. Raises MeshFileError when there is none so called.
    """
    names = _names(animations)
    if wanted is None:
        return Choice(names, next(filter(moves, range(len(names))), 0), told=False) if names else None
    if wanted in names:
        return Choice(names, names.index(wanted), told=True)
    remedy = f"Say one of: {listed(names)}" if names else "Leave --body-animation out"
    raise MeshFileError(f"it has no animation {wanted!r}", name, remedy)


def listed(names: Sequence[str]) -> str:
    """The first few names."""
    more = f" and {len(names) - NAMES_LISTED} more" if len(names) > NAMES_LISTED else ""
    return ", ".join(repr(name) for name in names[:NAMES_LISTED]) + more


def _names(animations: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    """A name for each that no other has."""
    own = [str(one.get("name") or "") for one in animations]
    return tuple(one if one and own.count(one) == 1 else f"{one or 'animation'} {k}" for k, one in enumerate(own))
