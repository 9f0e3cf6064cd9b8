"""Measured cases as tables in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import peer_table
import roofline_table
import starting_table

SAID = (
    "The smallest gap is the distance of the nearest pair of surfaces less its offset, which is the fabric's "
    "thickness, and half of it on skin: below 0 they are nearer than that, and apart."
)

COLUMNS = (
    "case",
    "vertices",
    "frame p50 / p99 / max [ms]",
    "late",
    "error p50 / p99 [mm]",
    "of real time (longer than that)",
    "Newton p50 / max",
    "pairs p50 / max",
    "sub-steps: frames",
    "smallest gap beyond the offset [mm]",
    "stretch",
    "lag [mm]",
    "void",
    "crossing of asked",
    "host waits p50 / p99 / max",
    "memory (at most) [MiB]",
    "growth [MiB]",
    "dressing [s]",
)


def markdown(run: Mapping[str, Any]) -> str:
    """What a run measured, with what; then where the time of a frame goes, other solvers and roofs, if asked for."""
    results = run["results"]
    lines = ["# Time of a frame", "", *(f"- {name}: {value}" for name, value in run["about"].items()), ""]
    if results:
        lines += [SAID, "", *figures_of(results), "", "## Stages", *stages_of(results)]
    if run["peers"]:
        lines += ["", "## Other solvers", "", *peer_table.section(run["peers"])]
    if run["roofline"]:
        lines += ["", "## Kernels and roofs", "", *roofline_table.section(run["roofline"])]
    if run.get("starts"):  # not in older runs
        lines += ["", "## Starts", "", *starting_table.section(run["starts"])]
    return "\n".join(lines) + "\n"


def figures_of(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """A line a case."""
    return ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS), *(row(result) for result in results)]


def stages_of(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """A table a case, the dearest verb first."""
    lines = ["", "p50 / p99 in a frame [ms], the verbs of `step.py`; the body's kinematic sub-steps are `move_body`."]
    for result in results:
        if "failure" in result:
            continue
        lines += ["", f"**{result['name']}**", "", "| verb | p50 | p99 |", "|---|---|---|"]
        lines += [
            f"| {verb} | {times['p50']:.2f} | {times['p99']:.2f} |"
            for verb, times in sorted(result["stages_ms"].items(), key=lambda entry: -entry[1]["p50"])
        ]
    return lines


def row(result: Mapping[str, Any]) -> str:
    """One line of the table."""
    r = result
    if "failure" in r:
        return f"| {r['name']} | " + "– | " * (len(COLUMNS) - 2) + f"FAILED: {r['failure']} |"
    ms, newton, pairs = r["frame_ms"], r["newton"], r["pairs"]
    cells = (
        r["name"],
        r["cloth_vertices"],
        f"{ms['p50']:.1f} / {ms['p99']:.1f} / {ms['max']:.1f}",
        "–" if r.get("deadline_ms") is None else f"{r['late']} of {r['frames']}",
        f"{r['error_mm']['p50']:.3f} / {r['error_mm']['p99']:.3f}" if "error_mm" in r else "–",  # not in older runs
        f"{r['simulated_over_wall']:.2f}" + behind(r),
        f"{newton['p50']:.0f} / {newton['max']:.0f}",
        f"{pairs['p50']:.0f} / {pairs['max']:.0f}",
        ", ".join(f"{count}: {frames}" for count, frames in r["substeps"].items()),
        f"{1e3 * r['min_gap']:.3f}",
        f"{r['max_stretch']:.3f}",
        f"{1e3 * r['body_lag']:.1f}",
        r["void"],
        f"{r['unclean']} of {r['asked']}",
        waits(r),
        "–" if r["memory_mib"] is None else f"{r['memory_mib']:.0f}" + at_most(r),
        ", ".join(f"{name} {growth:.1f}" + told_of(r, name) for name, growth in r["growth_mib"].items()),
        f"{r['dressing_s']:.1f}",
    )
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def told_of(result: Mapping[str, Any], name: str) -> str:
    """Of a memory's growth how much it was at most, and what came in the second half of the frames; older runs do not
    tell the one or both."""
    told = (("growth_most_mib", "at most"), ("growth_late_mib", "late"))
    parts = [f"{result[key][name]:.1f} {word}" for key, word in told if name in result.get(key, {})]
    return f" ({', '.join(parts)})" if parts else ""


def behind(result: Mapping[str, Any]) -> str:
    """The share of frames that took longer than what they are apart; older runs do not tell it, nor the two below."""
    return f" ({100 * result['behind'] / result['frames']:.1f} %)" if "behind" in result else ""


def waits(result: Mapping[str, Any]) -> str:
    """How often the host waited for a GPU in a frame."""
    counts = result.get("waits")
    return "–" if counts is None else f"{counts['p50']:.0f} / {counts['p99']:.0f} / {counts['max']:.0f}"


def at_most(result: Mapping[str, Any]) -> str:
    """The most that was held at any time."""
    most = result.get("memory_at_most_mib")
    return "" if most is None else f" ({most:.0f})"
