"""The page: how large the error of a step is, what it takes, and how well it is estimated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from accuracy_case import AccuracyCase
from svg import Line, line_chart

from tryon_solver.settings import PRESETS

WITHIN = ((2.0, 0.8), (4.0, 0.99))  # times the true error, and for which share of the steps of what was held out
NEGLIGIBLE = 0.05  # mm: what the solver's preset may miss the reference by, RMS; under it no estimate is asked for
HEAD = (
    "scene",
    "steps [1/s]",
    "settings",
    "error p50 / p90 / max [mm]",
    "largest p50 [mm]",
    "ms p50",
    "void",
    "within x2",
    "within x4",
)
SWEPT = ("settings", "ms p50", "error p50 [mm]", "largest p50 [mm]", "none is both faster and nearer")
Result = Mapping[str, Any]


def within(rows: Sequence[Result], times: float) -> float:
    """Share of the steps whose estimate is within so many times their error; both may be negligible instead."""
    good = [
        max(r["error"], r["estimate"]) <= NEGLIGIBLE or 1 / times <= r["estimate"] / r["error"] <= times for r in rows
    ]
    return float(np.mean(good))


def strictly_within(rows: Sequence[Result], times: float) -> float:
    """The same, however small they are."""
    return float(np.mean([1 / times <= r["estimate"] / r["error"] <= times for r in rows]))


def markdown(results: Mapping[str, Result]) -> str:
    """The page of all cases."""
    about = [result["about"] for result in results.values()]
    lines = ["# What accuracy costs in time", ""]
    for what in ("commit", "machine"):
        lines.append(f"- {what}: {'; '.join(sorted({a[what] for a in about}))}")
    lines += [
        "",
        "Written by `python tests/accuracy`. One step from each state of a float64 Newton IPC reference, held to where",
        "the reference is after the same step: RMS over the cloth's vertices, the largest of them in the column after.",
        f"An estimate counts as right where it and the error are under {NEGLIGIBLE:g} mm; in brackets without that.",
        "Times are those of single steps of small garments on a CPU, as busy as it was: they compare in a row.",
        "",
        headed(HEAD),
    ]
    for result in results.values():
        case = AccuracyCase(**result["case"])
        for name, rows in result["rows"].items():
            if name in PRESETS:
                lines.append(row(case, name, rows))
    lines += ["", "## The estimate", "", *estimates(results)]
    swept = [result for result in results.values() if set(result["rows"]) - set(PRESETS)]
    if swept:
        lines += ["", "## One thing changed at a time", "", *sweeps(swept)]
    lines += ["", "## What does not hold", "", *(f"- {said}" for said in broken(results))]
    if not broken(results):
        lines.append("All holds.")
    return "\n".join(lines) + "\n"


def headed(names: Sequence[str]) -> str:
    """A table's first two lines."""
    return f"| {' | '.join(names)} |\n{'|---' * len(names)}|"


def row(case: AccuracyCase, name: str, rows: Sequence[Result]) -> str:
    """Of the first table."""
    e, largest, ms = (np.array([r[key] for r in rows]) for key in ("error", "largest", "ms"))
    cells = (
        case.scene + " (held out)" * case.held_out,
        f"{1 / case.dt:.0f}",
        name,
        f"{np.median(e):.4f} / {np.percentile(e, 90):.4f} / {e.max():.3f}",
        f"{np.median(largest):.3f}",
        f"{np.median(ms):.1f}",
        f"{sum(r['void'] for r in rows)} of {len(rows)}",
        *(f"{100 * within(rows, t):.0f} % ({100 * strictly_within(rows, t):.0f})" for t, _ in WITHIN),
    )
    return f"| {' | '.join(cells)} |"


def estimates(results: Mapping[str, Result]) -> list[str]:
    """Over all steps at presets of what was held out, and of the others."""
    lines = []
    for held_out, said in ((True, "held out"), (False, "fitted to")):
        rows = preset_rows(results, held_out)
        if rows:
            shares = " and ".join(f"x{t:g} for {100 * within(rows, t):.1f} %" for t, _ in WITHIN)
            strict = " and ".join(f"x{t:g} for {100 * strictly_within(rows, t):.1f} %" for t, _ in WITHIN)
            lines.append(f"- Scenes {said}, {len(rows)} steps: within {shares}; without what is negligible, {strict}.")
    return lines


def preset_rows(results: Mapping[str, Result], held_out: bool) -> list[Result]:
    """All rows at presets."""
    return [
        r
        for result in results.values()
        if result["case"]["held_out"] == held_out
        for name, rows in result["rows"].items()
        if name in PRESETS
        for r in rows
    ]


def sweeps(results: Sequence[Result]) -> list[str]:
    """A table of medians over the scenes, in the order of the time they take."""
    names = dict.fromkeys(name for result in results for name in result["rows"])
    figures = {}
    for name in names:
        rows = [r for result in results for r in result["rows"].get(name, ())]
        figures[name] = tuple(float(np.median([r[key] for r in rows])) for key in ("ms", "error", "largest"))
    lines = [headed(SWEPT)]
    for name, (ms, error, largest) in sorted(figures.items(), key=lambda item: item[1]):
        best = not any(m < ms and e < error for m, e, _ in figures.values())
        lines.append(f"| {name} | {ms:.1f} | {error:.4f} | {largest:.3f} | {'yes' if best else ''} |")
    return lines


def plot(results: Mapping[str, Result]) -> str:
    """SVG: error against time, a line for each scene and length of step, through what is on its front."""
    lines = []
    for number, result in enumerate(results.values()):
        case, points = AccuracyCase(**result["case"]), []
        for rows in result["rows"].values():
            points.append(tuple(float(np.median([r[key] for r in rows])) for key in ("ms", "error")))
        front = [p for p in sorted(points) if not any(q[0] < p[0] and q[1] <= p[1] for q in points)]
        lines.append(Line(f"{case.scene}, 1/{1 / case.dt:.0f} s", front, number // 2, number % 2 == 1))
    return line_chart("Error of a step against its time", "ms", "mm", lines)


def broken(results: Mapping[str, Result]) -> list[str]:
    """What does not hold: the estimate on what was held out, and that each preset's error is under that of the one
    before it in steps as long."""
    said = []
    rows = preset_rows(results, held_out=True)
    for times, share in WITHIN:
        if rows and within(rows, times) < share:
            found = 100 * within(rows, times)
            said.append(f"within x{times:g} are {found:.1f} % of the estimates, not {100 * share:g} %")
    for result in results.values():
        medians = {n: float(np.median([r["error"] for r in rs])) for n, rs in result["rows"].items() if n in PRESETS}
        for one, other in zip(list(medians), list(medians)[1:]):
            if medians[other] > medians[one]:
                said.append(f"{AccuracyCase(**result['case']).scene}: {other} is further off than {one}")
    return said
