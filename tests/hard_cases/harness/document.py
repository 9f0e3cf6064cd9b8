"""Several runs of the hard cases beside each other, in Markdown: which cases hold in which run, and the worst of each
figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from harness.table import COLUMNS, LIMITS, holds, row, said_of, verdict_of

Result = Mapping[str, Any]

WORST: tuple[tuple[str, Callable[[Result], float | None], str], ...] = (
    ("crossing frames", lambda r: r.get("unclean"), "{:.0f}"),
    ("colliding sub-steps", lambda r: r.get("not_free"), "{:.0f}"),
    ("energy without work [%]", lambda r: scaled(r, "growth", 100), "{:.2f}"),
    ("stretch over limit, 99.9 %", lambda r: over_limit(r, "stretch_most"), "{:.3f}"),
    ("stretch over limit, max", lambda r: over_limit(r, "stretch_max"), "{:.3f}"),
    ("lag at the end [mm]", lambda r: scaled(r, "lag_end", 1e3), "{:.1f}"),
    ("trembling [mm/s]", lambda r: scaled(r, "trembling", 1e3), "{:.2f}"),
    ("in the last safe state [s]", lambda r: r.get("frozen"), "{:.2f}"),
)
"""Figures of which more is worse: name, value in a result, form."""


def scaled(result: Result, name: str, scale: float) -> float | None:
    value = result.get(name)
    return None if value is None else scale * value


def over_limit(result: Result, name: str) -> float | None:
    """A stretch as a share of what the fabric's limit allows."""
    value, limit = result.get(name), result.get("strain_limit")
    return None if value is None or not limit else value / limit


def document(runs: Sequence[Mapping[str, Any]]) -> str:
    """The whole page; a run is what its `run.json` holds: `name`, `about`, `results`."""
    said = "Written by `make hard-page` of what `make hard` left; METHOD.md section 19 says how each figure is judged."
    lines = ["# Hard cases", "", said, ""]
    for run in runs:
        held = sum(holds(r) for r in run["results"])
        lines.append(f"- **{run['name']}**: {held} of {len(run['results'])} cases hold")
        lines += [f"  - {name}: {value}" for name, value in run["about"].items()]
    lines += ["", LIMITS, "", "## Which hold", "", *verdicts(runs), "", "## The worst of each figure", ""]
    lines += ["Over all cases, also those in which a figure is stated and not judged:", "", *worst(runs), ""]
    for run in runs:
        lines += [f"## Figures: {run['name']}", "", "| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
        lines += [*(row(result) for result in run["results"]), ""]
        for result in run["results"]:
            if told := said_of(result):
                lines += [f"- **{result['name']}**", *told]
        lines.append("")
    return "\n".join(lines)


def verdicts(runs: Sequence[Mapping[str, Any]]) -> list[str]:
    """A line a case, a column a run; a dash where the run was not asked for the case."""
    by_run = [{r["name"]: r for r in run["results"]} for run in runs]
    stresses = {r["name"]: r.get("stresses", "") for run in runs for r in run["results"]}
    lines = [
        "| case | stresses | " + " | ".join(run["name"] for run in runs) + " |",
        "|---|---|" + "---|" * len(runs),
    ]
    for name, what in stresses.items():
        cells = [short(results[name]) if name in results else "–" for results in by_run]
        lines.append(f"| {name} | {what} | " + " | ".join(cells) + " |")
    return lines


def short(result: Result) -> str:
    """The verdict without the reason of a failure, which is told below."""
    return "FAILED" if result.get("failure") else verdict_of(result)


def worst(runs: Sequence[Mapping[str, Any]]) -> list[str]:
    """A line a figure, a column a run: its largest value, and the case it is from."""
    lines = [
        "| figure | " + " | ".join(run["name"] for run in runs) + " |",
        "|---|" + "---|" * len(runs),
    ]
    for name, value_of, form in WORST:
        cells = []
        for run in runs:
            found = [(value, r["name"]) for r in run["results"] if (value := value_of(r)) is not None]
            value, case = max(found, default=(0.0, "–"))
            cells.append(f"{form.format(value)} ({case})" if value else form.format(0.0))
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return lines
