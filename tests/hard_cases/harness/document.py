"""Several runs of the hard cases beside each other, in Markdown: which cases hold in which run, and the worst of each
figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from harness.table import COLUMNS, LIMITS, holds, row, said_of, verdict_of

Result = Mapping[str, Any]


class Figure(NamedTuple):
    """One of which more is worse."""

    name: str
    value: Callable[[Result], float | None]
    form: str
    limit: str = "-"  # how the limit on it begins; a case that only states it is left out


WORST = (
    Figure("crossing frames", lambda r: r.get("unclean"), "{:.0f}"),
    Figure("colliding sub-steps", lambda r: r.get("not_free") if r.get("moves") else None, "{:.0f}"),
    Figure("energy without work [%]", lambda r: scaled(r, "growth", 100), "{:.2f}", "energy"),
    Figure("the same at rest [%]", lambda r: scaled(r, "growth_at_rest", 100), "{:.2f}", "energy"),
    Figure("stretch over limit, 99.9 %", lambda r: over_limit(r, "stretch_most"), "{:.3f}", "stretch, 99.9"),
    Figure("stretch over limit, max", lambda r: over_limit(r, "stretch_max"), "{:.3f}", "stretch, max"),
    Figure("surface behind the skin, most [mm]", lambda r: scaled(r, "lag_max", 1e3), "{:.1f}"),
    Figure("lag at the end [mm]", lambda r: scaled(r, "lag_end", 1e3), "{:.1f}"),
    Figure("time over 10 mm behind [s]", lambda r: r.get("behind"), "{:.2f}"),
    Figure("trembling [mm/s]", lambda r: scaled(r, "trembling", 1e3), "{:.2f}", "trembling"),
    Figure("trembling, its worst second [mm/s]", lambda r: scaled(r, "trembling_most", 1e3), "{:.2f}", "trembling"),
    Figure("all motion at rest [mm/s]", lambda r: scaled(r, "restless", 1e3), "{:.2f}"),
    Figure("fastest vertex on waking [m/s]", lambda r: r.get("waking"), "{:.3f}"),
    Figure("surface under noise [mm/s]", lambda r: None if not r.get("noise") else 1e3 * r["noise"][0], "{:.1f}"),
    Figure("cloth on it under noise [mm]", lambda r: None if not r.get("noise") else 1e3 * r["noise"][1], "{:.3f}"),
    Figure("in the last safe state [s]", lambda r: r.get("frozen"), "{:.2f}"),
    Figure("share of a second's frames with void steps [%]", lambda r: scaled(r, "void_share", 100), "{:.0f}"),
    Figure("reported gap off by [mm]", lambda r: scaled(r, "gap_off", 1e3), "{:.4f}"),
    Figure("reported stretch off by", lambda r: r.get("stretch_off"), "{:.5f}"),
)


def scaled(result: Result, name: str, scale: float) -> float | None:
    value = result.get(name)
    return None if value is None else scale * value


def over_limit(result: Result, name: str) -> float | None:
    """A stretch as a share of what the fabric's limit allows."""
    value, limit = result.get(name), result.get("strain_limit")
    return None if value is None or not limit else value / limit


def document(runs: Sequence[Mapping[str, Any]], beside: Sequence[str] = ()) -> str:
    """The whole page; a run is what its `run.json` holds: `name`, `about`, `results`. `beside`: its part on others."""
    said = "Written by `make hard-page` of what `make hard` left; METHOD.md section 19 says how each figure is judged."
    lines = ["# Hard cases", "", said, ""]
    for run in runs:
        refused = sum("refused" in r and holds(r) for r in run["results"])
        held = sum(holds(r) for r in run["results"]) - refused
        by_name = f", {refused} others are refused by name" if refused else ""
        lines.append(f"- **{run['name']}**: {held} of {len(run['results']) - refused} cases hold{by_name}")
        lines += [f"  - {name}: {value}" for name, value in run["about"].items()]
        frames, moves = (sum(r.get(what) or 0 for r in run["results"]) for what in ("asked", "moves"))
        lines.append(f"  - judged: {frames:,} frames and {moves:,} accepted sub-steps on the way to them")
    lines += ["", LIMITS, "", "## Which hold", "", *verdicts(runs), "", "## The worst of each figure", ""]
    lines += ["Over all cases but those in which the figure is stated and not judged:", "", *worst(runs), "", *beside]
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
    """The verdict with what was broken, without where and by how much, which is told below."""
    if result.get("failure"):
        return "FAILED"
    names = [broken["line"].partition(":")[0].partition(" [")[0].partition(" (")[0] for broken in result["broken"]]
    return f"**{'; '.join(names)}**" if names else verdict_of(result)


def worst(runs: Sequence[Mapping[str, Any]]) -> list[str]:
    """A line a figure, a column a run: its largest value, and the case it is from."""
    lines = [
        "| figure | " + " | ".join(run["name"] for run in runs) + " |",
        "|---|" + "---|" * len(runs),
    ]
    for figure in WORST:
        cells = []
        for run in runs:
            judged = [r for r in run["results"] if not stated(r, figure.limit)]
            found = [(value, r["name"]) for r in judged if (value := figure.value(r)) is not None]
            value, case = max(found, default=(None, ""))
            told = "–" if value is None else figure.form.format(value)
            cells.append(f"{told} ({case})" if value else told)
        lines.append(f"| {figure.name} | " + " | ".join(cells) + " |")
    return lines


def stated(result: Result, limit: str) -> bool:
    """Does the case only state the figure that a limit of such a beginning is on?"""
    return any(s["limit"].startswith(limit) for s in result.get("stated", ()))
