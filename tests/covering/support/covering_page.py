"""The page of runs of the covering array: what was together, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from covered_limits import FASTEST, NAMED_SPEED, NAMED_STRETCH, STRETCHED
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
    seen = {key(result): result for results in runs.values() for result in results if "stretched_at" in result}
    for name, results in runs.items():
        lines += ["", f"## {name}", "", *of_run(results, seen)]
    return "\n".join(lines) + "\n"


def introduction() -> list[str]:
    """What is played and how it is judged."""
    every = FACTORS.pairs
    return [
        "Scenes of 3 s in which any two variants of any two effects that may meet do meet: a pairwise covering array",
        f"of {len(LEVELS)} factors, {sum(map(len, LEVELS.values()))} levels and {len(every)} pairs (`tests/covering`;",
        "`make effects` plays it, a test proves that it covers all pairs). IPC Toolkit judges every frame, or every",
        "second one where half as many are told as judged, for what crosses of the surfaces that contact keeps apart",
        "in the scene; where the scene has no contact at all, so that nothing could cross, the frame is not judged and",
        "counted apart. Two garments lie one over the other, of one fabric or of two with their own thickness and",
        "friction. Speeds are of the fastest vertex, less",
        "what its fall gives it; stretch is the largest of any triangle; `at the end` is the cloth's RMS speed in the",
        "last frame; void are steps that were made so (METHOD.md, section 8). When values are written in the running",
        "scene (drawstrings drawn, buttons opened, pins led, creases pressed anew, seams closed, blown out and in,",
        "pumped, what dries) `support/covered_scene.py` says.",
        "",
        "A scene holds when no judged frame crosses, every position is a finite number, no step fails, no vertex",
        f"goes faster than {FASTEST:g} m/s and no triangle is stretched to more than {STRETCHED:g} times its pattern.",
        "The last two are there to catch a simulation that has gone wild, and say nothing of whether cloth looks",
        "right: pairs of effects pull, blow and hold harder than a wearer does, and fabrics are meant to bear 1.04 to",
        f"1.15. So each scene that goes beyond {NAMED_SPEED:g} m/s or {NAMED_STRETCH:g} times is named beneath its",
        "table, with where and why.",
        "",
        "| factor | levels |",
        "|---|---|",
        *(f"| {factor} | {', '.join(levels)} |" for factor, levels in LEVELS.items()),
    ]


def key(result: Result) -> tuple[tuple[str, str], ...]:
    """By which a scene is known in any run: its row."""
    return tuple(result["row"].items())


def of_run(results: Sequence[Result], seen: Mapping[Any, Result] | None = None) -> list[str]:
    """The table of a run and what does not hold in it. `seen` are results of any run that recorded where cloth was
    stretched, by `key`."""
    if not results:
        return ["Nothing was played."]
    covered = {pair for result in results for pair in pairs_of(result["row"], list(LEVELS))}
    judged, crossing, free = (sum(count(r, what) for r in results) for what in ("judged", "crossing", "free"))
    two = sum(count(r, "judged") for r in results if r["row"]["garments"] != "one")
    broken = [result for result in results if result["broken"]]
    named = [result for result in results if is_named(result)]
    calm = len(results) - len({*map(key, broken), *map(key, named)})
    lines = [f"- {what}: {'; '.join(sorted({r['about'][what] for r in results}))}" for what in ("commit", "machine")]
    lines += [
        f"- {len(results)} scenes, {len(covered & FACTORS.pairs)} of {len(FACTORS.pairs)} pairs",
        f"- {judged} frames judged, {two} of them of two garments, {crossing} crossing",
        f"- {free} frames more were looked at in scenes without contact, for speed and stretch alone",
        f"- {len(results) - len(broken)} scenes hold in all, {calm} of them within {NAMED_SPEED:g} m/s and "
        f"{NAMED_STRETCH:g} times, too",
        "",
        row_of((*FIGURES, *MORE)),
        row_of(["---"] * (len(FIGURES) + len(MORE))),
        *(row_of(cells(result)) for result in results),
        "",
    ]
    lines += [f"- scene {result['scene']}: {'; '.join(why(result, seen or {}))}" for result in named]
    lines += [""] if named else []
    missing = sorted(set(range(len(rows()))) - {result["scene"] for result in results})
    lines += [f"- scene {k}: not played to its end" for k in missing]
    lines += [f"- scene {r['scene']}: {len(r['broken'])} times; first {r['broken'][0]}" for r in broken]
    return lines if broken or missing else [*lines, "All holds."]


def is_named(result: Result) -> bool:
    """Is it beyond what is told by name?"""
    return bool(result["fastest"] > NAMED_SPEED or result["stretch"] > NAMED_STRETCH)


def why(result: Result, seen: Mapping[Any, Result]) -> list[str]:
    """What was fast or long in it, and where; found in this run, or in another of the same scene."""
    here = "stretched_at" in result
    found, said = (result if here else seen.get(key(result))), []
    row = result["row"]
    if result["fastest"] > NAMED_SPEED:
        blown = "blown" if row["pressure"] == "blown" else "not blown"
        held = "held by nothing" if row["pins"] == "none" else "held by three pins"
        if row["garments"] != "one" and row["pins"] != "none":
            held = "the inner garment held by three pins, the outer one by nothing"
        said.append(f"{result['fastest']:.2f} m/s: {blown}, {held}")
        if found is not None and found["fastest"] > NAMED_SPEED:
            said[-1] += f"; half of its vertices go at {found['usual']:.2f} m/s or more then{elsewhere(here)}"
    if result["stretch"] > NAMED_STRETCH:
        said.append(f"stretched to {result['stretch']:.2f}")
        if found is None or found["stretch"] <= NAMED_STRETCH:
            more = "" if found is None else f" (in another run to {found['stretch']:.2f})"
            said[-1] += f": where, this run did not record{more}"
        else:
            at = [f"{where}, {row[where]}" if where in row else "the outer garment" for where in found["stretched_at"]]
            said[-1] += f": at {' and '.join(at) or 'cloth that no effect of a spot acts on'}{elsewhere(here)}"
    return said


def elsewhere(here: bool) -> str:
    """Said behind what another run found."""
    return "" if here else " (as another run found)"


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
