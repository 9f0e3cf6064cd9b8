"""The page of runs of the covering array: what was together, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from covering_array import pairs_of
from effect_factors import FACTORS, LEVELS, rows

Result = Mapping[str, Any]
HOW = ("preset", "rate")  # of the factors those that say how a scene is simulated
WHAT = ("cloth", "body", "fabric")
ABSENT = {"none", "fabric", "off", "one"}  # levels that list no effect
FIGURES = ("scene", "cloth", "body", "vertices", "preset, rate", "frames", "judged", "crossing", "fastest [m/s]")
MORE = ("stretch", "at the end [m/s]", "void", "asleep", "ms a frame", "with")


def page(runs: Mapping[str, Sequence[Result]]) -> str:
    """In Markdown; a section for each run."""
    lines = ["# All effects together", "", *introduction()]
    for name, results in runs.items():
        lines += ["", f"## {name}", "", *of_run(results)]
    return "\n".join(lines) + "\n"


def introduction() -> list[str]:
    """What is played and how it is judged."""
    every = FACTORS.pairs()
    return [
        "Scenes of 3 s in which any two variants of any two effects that may meet do meet: a pairwise covering array",
        f"of {len(LEVELS)} factors, {sum(map(len, LEVELS.values()))} levels and {len(every)} pairs (`tests/covering`;",
        "`make effects` plays it, a test proves that it covers all pairs). IPC Toolkit judges every second frame for",
        "what crosses of the surfaces that contact keeps apart in the scene; where the scene has no contact at all, so",
        "that nothing could cross, the frame is not judged and counted apart. Two garments lie one over the other, of",
        "one fabric or of two with their own thickness and friction. Speeds are of the fastest vertex, less",
        "what its fall gives it; stretch is the largest of any triangle; `at the end` is the cloth's RMS speed in the",
        "last frame; void are steps that were made so (METHOD.md, section 8). When values are written in the running",
        "scene (drawstrings drawn, buttons opened, pins led, creases pressed anew, seams closed, blown out and in,",
        "pumped, what dries) `support/covered_scene.py` says.",
        "",
        "| factor | levels |",
        "|---|---|",
        *(f"| {factor} | {', '.join(levels)} |" for factor, levels in LEVELS.items()),
    ]


def of_run(results: Sequence[Result]) -> list[str]:
    """The table of a run and what does not hold in it."""
    if not results:
        return ["Nothing was played."]
    covered = {pair for result in results for pair in pairs_of(result["row"], list(LEVELS))}
    judged, crossing, free = (sum(count(r, what) for r in results) for what in ("judged", "crossing", "free"))
    two = sum(count(r, "judged") for r in results if r["row"]["garments"] != "one")
    broken = [result for result in results if result["broken"]]
    lines = [f"- {what}: {'; '.join(sorted({r['about'][what] for r in results}))}" for what in ("commit", "machine")]
    lines += [
        f"- {len(results)} scenes, {len(covered & FACTORS.pairs())} of {len(FACTORS.pairs())} pairs",
        f"- {judged} frames judged, {two} of them of two garments, {crossing} crossing",
        f"- {free} frames more were looked at in scenes without contact, for speed and stretch alone",
        f"- {len(results) - len(broken)} scenes hold in all",
        "",
        row_of((*FIGURES, *MORE)),
        row_of(["---"] * (len(FIGURES) + len(MORE))),
        *(row_of(cells(result)) for result in results),
        "",
    ]
    missing = sorted(set(range(len(rows()))) - {result["scene"] for result in results})
    lines += [f"- scene {k}: not played to its end" for k in missing]
    lines += [f"- scene {r['scene']}: {len(r['broken'])} times; first {r['broken'][0]}" for r in broken]
    return lines if broken or missing else [*lines, "All holds."]


def count(result: Result, what: str) -> int:
    """A figure that is a number or a list."""
    value = result[what]
    return len(value) if isinstance(value, list) else int(value)


def cells(result: Result) -> list[str]:
    """A scene's row."""
    row = result["row"]
    effects = [f"{factor}: {level}" for factor, level in row.items() if is_effect(factor, level)]
    return [
        str(result["scene"]),
        f"{row['cloth']}, {row['fabric'].replace('_', ' ')}",
        row["body"],
        str(result["vertices"]),
        f"{row['preset']}, {row['rate']}",
        str(result["frames"]),
        str(result["judged"]) if result["judged"] else "no contact",
        str(len(result["crossing"])),
        f"{result['fastest']:.2f}",
        f"{result['stretch']:.2f}",
        f"{result['speed_at_end']:.3f}",
        str(result["void"]),
        str(result["asleep"]),
        f"{result['ms']:.0f}",
        "; ".join(effects),
    ]


def is_effect(factor: str, level: str) -> bool:
    """Does the level list one? The fabric's own friction is an effect, its own stretch is none."""
    if factor in (*HOW, *WHAT):
        return False
    return level not in ABSENT or (factor == "friction" and level == "fabric")


def row_of(cells: Sequence[str]) -> str:
    """A line of a table."""
    return f"| {' | '.join(cells)} |"
