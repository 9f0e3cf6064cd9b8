"""By what is judged: limits of what is promised, which steps count, and which of other solvers' are beyond ours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from accuracy_case import takes_such_steps
from accuracy_data import Found, Measured, Row
from methods import TITLES

WITHIN = ((2.0, 0.8), (4.0, 0.99))  # times the true error, and for which share of the steps of what was held out
NEGLIGIBLE = 0.05  # mm: where both are under it the estimate counts as right
REFERENCE, AGREEMENT = "reference", 0.05  # the preset, and what it may be off, RMS over all steps [mm]
ROUNDING = 0.01  # mm: medians under it are as good as each other, for they are those of float32
JUDGED = 5.0  # mm: other solvers' steps with larger errors are not compared
OTHERS = ("xpbd", "chebyshev", "newton_ipc", "vbd", "style3d")
IN_NUMPY = ("xpbd", "chebyshev", "newton_ipc")  # of these: what compiled ones would take is not known


def within(rows: Sequence[Row], times: float, negligible: float = NEGLIGIBLE) -> float:
    """Share of the steps whose estimate is within so many times their error; both may be negligible instead."""
    return float(np.mean([is_within(row, times, negligible) for row in rows]))


def is_within(row: Row, times: float, negligible: float = NEGLIGIBLE) -> bool:
    """Of one step."""
    error, estimate = row["error"], row["estimate"]
    return max(error, estimate) <= negligible or error / times <= estimate <= error * times


def preset_rows(found: Found, held_out: bool | None = None, on_gpu: bool = False) -> list[tuple[Measured, str, Row]]:
    """All steps on the CPU, or on a GPU, at presets whose own are no shorter; of what was held out or not, or both."""
    return [
        (measured, name, row)
        for measured in found.presets
        if measured.on_gpu == on_gpu and (held_out is None or measured.case.held_out == held_out)
        for name in measured.presets
        if takes_such_steps(name, measured.case.dt)
        for row in measured.rows[name]
        if row["error"] is not None
    ]


def beyond_ours(measured: Measured) -> list[tuple[str, float, float, float | None]]:
    """Method, ms and error of each that is not on or above our front over the states that it has, and our error in no
    more time, if we have any.

    Errors under AGREEMENT are as good as each other.
    """
    found = []
    for name in measured.of_solver(*OTHERS):
        states = measured.shared & measured.states(name)
        ms, error = measured.point(name, states)
        ours = [measured.point(own, states) for own in measured.ours_over(states)]
        best = min((e for m, e in ours if m <= ms), default=None)
        if ours and error < JUDGED and (best is None or best > max(error, AGREEMENT)):
            found.append((name, ms, error, best))
    return found


def title(measured: Measured, method: str) -> str:
    """Of a method's solver."""
    return TITLES[str(measured.about[method]["solver"])]
