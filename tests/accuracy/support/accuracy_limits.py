"""What is promised, and where it does not hold."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from accuracy_case import takes_such_steps
from accuracy_data import CPU, Found, Measured, Row, digits
from methods import TITLES

WITHIN = ((2.0, 0.8), (4.0, 0.99))  # times the true error, and for which share of the steps of what was held out
NEGLIGIBLE = 0.05  # mm: where both are under it the estimate counts as right
REFERENCE, AGREEMENT = "reference", 0.05  # the preset, and what it may be off, RMS over all steps [mm]
ROUNDING = 0.01  # mm: medians under it are as good as each other, for they are those of float32
JUDGED = 5.0  # mm: other solvers' steps with larger errors are not compared
OTHERS = ("xpbd", "chebyshev", "newton_ipc", "vbd", "style3d")


def within(rows: Sequence[Row], times: float, negligible: float = NEGLIGIBLE) -> float:
    """Share of the steps whose estimate is within so many times their error; both may be negligible instead."""
    return float(np.mean([is_within(row, times, negligible) for row in rows]))


def is_within(row: Row, times: float, negligible: float = NEGLIGIBLE) -> bool:
    """Of one step."""
    error, estimate = row["error"], row["estimate"]
    return max(error, estimate) <= negligible or error / times <= estimate <= error * times


def preset_rows(found: Found, held_out: bool | None = None) -> list[tuple[Measured, str, Row]]:
    """All steps on the CPU at presets whose own are no shorter, of what was held out or not, or of all."""
    return [
        (measured, name, row)
        for measured in found.presets
        if measured.device == CPU and (held_out is None or measured.case.held_out == held_out)
        for name in measured.presets
        if takes_such_steps(name, measured.case.dt)
        for row in measured.rows[name]
        if row["error"] is not None
    ]


def broken(found: Found) -> list[str]:
    """In words, each."""
    return [*estimate_broken(found), *order_broken(found), *reference_broken(found), *fronts_broken(found)]


def estimate_broken(found: Found) -> list[str]:
    """The estimate, on what was held out."""
    rows = [row for _, _, row in preset_rows(found, held_out=True)]
    said = []
    for times, share in WITHIN:
        counted, strict = within(rows, times) if rows else 1.0, within(rows, times, 0.0) if rows else 1.0
        if counted < share:
            said.append(f"within x{times:g} are {100 * counted:.1f} % of the estimates, not {100 * share:g} %")
        elif strict < share:
            said.append(
                f"within x{times:g} are {100 * counted:.1f} % of the estimates, but {100 * strict:.1f} % where none "
                f"counts as right for being under {NEGLIGIBLE:g} mm, as its error is"
            )
    return said


def order_broken(found: Found) -> list[str]:
    """Each preset's median error is under that of the one before it, or under ROUNDING."""
    said = []
    for measured in found.presets:
        names = measured.presets
        for one, other in pairwise(names):
            errors = [float(np.median([row["error"] for row in measured.rows[name]])) for name in (one, other)]
            if errors[1] > max(errors[0], ROUNDING):
                far = " and ".join(f"{digits(error)} mm" for error in errors)
                said.append(f"{measured.name}: {other} is further off than {one} ({far})")
    return said


def reference_broken(found: Found) -> list[str]:
    """The preset that claims it is Newton's equal, over all steps of each case."""
    said = []
    for measured in found.presets:
        if REFERENCE in measured.presets:
            rows = measured.rows[REFERENCE]
            off = float(np.sqrt(np.mean([row["error"] ** 2 for row in rows])))
            if off > AGREEMENT:
                far = [row for row in rows if row["error"] > AGREEMENT]
                balanced = [row for row in far if (row.get("own_balance") or np.inf) < AGREEMENT]
                lower = sum((row["energy"] or 0.0) < 0 for row in balanced)
                said.append(
                    f"{measured.name}: preset {REFERENCE} is {digits(off)} mm from Newton IPC, RMS; {len(far)} of "
                    f"{len(rows)} steps are further off than {AGREEMENT:g} mm, {len(balanced)} of these in a balance "
                    f"of their own, {lower} with less energy than Newton's"
                )
    if not any(REFERENCE in measured.presets for measured in found.errors):
        said.append(f"there is no preset {REFERENCE} to be held to Newton IPC")
    return said


def fronts_broken(found: Found) -> list[str]:
    """Where another solver's step is nearer than each of ours that takes no longer, its error being under JUDGED."""
    said = []
    for measured in found.errors:
        for name, ms, error, best in beyond_ours(measured):
            rows = measured.rows[name]
            crossed = f"crossed in {sum(row['crossed'] > 0 for row in rows)} of {len(rows)} ends"
            ours = "ours takes longer at its fastest"
            if best is not None:
                ours = f"ours in no more time is {digits(best)} mm off"
            trials = [(e, m) for m, e in map(measured.point, measured.of_solver("trial")) if m <= ms]
            alone = f"; PD alone is {digits(min(trials)[0])} mm off in {digits(min(trials)[1])} ms" if trials else ""
            said.append(
                f"{measured.name}: {name} takes {digits(ms)} ms and is {digits(error)} mm off, {crossed}; {ours}{alone}"
            )
    return said


def beyond_ours(measured: Measured) -> list[tuple[str, float, float, float | None]]:
    """Method, ms and error of each that is not on or above our front over the states that it has, and our error in no
    more time, if we have any.

    Errors under AGREEMENT are as good as each other.
    """
    found = []
    for name in measured.of_solver(*OTHERS):
        states = measured.shared & measured.states(name)
        ms, error = measured.point(name, states)
        ours = [measured.point(own, states) for own in measured.of_solver("ours")]
        best = min((e for m, e in ours if m <= ms), default=None)
        if error < JUDGED and (best is None or best > max(error, AGREEMENT)):
            found.append((name, ms, error, best))
    return found


def title(measured: Measured, method: str) -> str:
    """Of a method's solver."""
    return TITLES[str(measured.about[method]["solver"])]
