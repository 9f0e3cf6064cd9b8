"""Runs of several garments worn over each other as tables in a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

BEGIN, END = "<!-- made by tests/outfits -->", "<!-- until here: outfits -->"
COLUMNS = ("motion", "worn", "vertices", "judged", "crossing", "void steps", "least gap [mm]", "stretch", "lag [mm]")
TIMES = ("ms a frame", "99 %", "processor ms", "times one", "by the processor")

Figures = Mapping[str, Any]


def line(figures: Figures) -> str:
    """What came of one of them, in a line."""
    names, counts = " + ".join(figures["garments"]), " + ".join(f"{n:,}" for n in figures["vertices"])
    crossing = f", first in frame {figures['crossing'][0]}" if figures["crossing"] else ""
    return (
        f"{names} ({counts}), {figures['motion']}: {len(figures['crossing'])} of {figures['judged']} frames judged, of "
        f"{figures['frames']}, cross{crossing}; {figures['ms']:.0f} ms a frame (99 %: {figures['ms_99']:.0f}), "
        f"{figures['cpu_ms']:.0f} of a processor; {figures['void']} void steps, least gap {1e3 * figures['gap']:.2f} mm"
    )


def write(page: Path, runs: Sequence[Figures]) -> int:
    """Write the runs into the page, between its two marks; 1 where anything crosses. Raises ValueError without them."""
    text = page.read_text()
    head, begun, rest = text.partition(BEGIN)
    _, ended, tail = rest.partition(END)
    if not begun or not ended:
        raise ValueError(f"{page}: there is no place for the runs; put {BEGIN} and {END} there")
    page.write_text(head + "\n".join([BEGIN, "", *(line for run in runs for line in of_run(run)), END]) + tail)
    return 1 if any(one["crossing"] for run in runs for one in run["runs"]) else 0


def of_run(run: Figures) -> list[str]:
    """A run's table, and how many frames crossed in all."""
    about = run["about"]
    alone = {one["motion"]: one for one in run["runs"] if len(one["garments"]) == 1}
    judged, crossing = (sum(each) for each in zip(*((one["judged"], len(one["crossing"])) for one in run["runs"])))
    lines = [
        f"{about['machine']}; commit {about['commit']}; preset `{about['preset']}`, {about['fps']:g} frames a second:",
        f"**{crossing} of {judged} frames cross.**",
        "",
        f"| {' | '.join((*COLUMNS, *TIMES))} |",
        "|---" * len((*COLUMNS, *TIMES)) + "|",
    ]
    for one in run["runs"]:
        beside = alone.get(one["motion"], one)
        cells = [
            one["motion"],
            " + ".join(one["garments"]),
            " + ".join(f"{count:,}" for count in one["vertices"]),
            f"{one['judged']} of {one['frames']}",
            str(len(one["crossing"])),
            str(one["void"]),
            f"{1e3 * one['gap']:.2f}",
            f"{one['stretch']:.2f}",
            f"{1e3 * one['lag']:.1f}",
            f"{one['ms']:.0f}",
            f"{one['ms_99']:.0f}",
            f"{one['cpu_ms']:.0f}",
            "" if one is beside else f"{one['ms'] / beside['ms']:.2f}",
            "" if one is beside else f"{one['cpu_ms'] / beside['cpu_ms']:.2f}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return [*lines, ""]
