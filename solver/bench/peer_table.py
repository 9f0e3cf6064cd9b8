"""The scenes of the peers as a table in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

SAID = (
    "Frames of 1/60 s, of which the first ten are not timed. What crosses is IPC Toolkit's word on the frames asked. "
    "Jitter is the RMS speed above 8 Hz from half a second after everything stands; cloth that fell through something "
    "crosses nothing any more: the speed at the end tells. `solver/bench` says what each solver is given."
)

COLUMNS = (
    "scene",
    "vertices",
    "solver",
    "frame p50 / p99 / max [ms]",
    "crossing of asked (itself, body)",
    "rest jitter [mm/s]",
    "speed at the end [mm/s]",
    "largest stretch at the end",
    "frames",
    "to build [s]",
)


def section(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """The scenes as a table."""
    lines = [SAID, "", "| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    return [*lines, *(row(result) for result in results)]


def row(result: Mapping[str, Any]) -> str:
    """One line of the table; a dash where there is no figure."""
    r = result
    if "failure" in r:
        cells = (r["scene"], r["vertices"], r["title"], f"not played: {r['failure']}")
        return "| " + " | ".join(str(c) for c in cells) + " |" + " – |" * (len(COLUMNS) - len(cells))

    def known(name: str, scale: float, form: str) -> str:
        return "–" if r[name] is None else format(scale * r[name], form)

    ms = r["frame_ms"]
    cells = (
        r["scene"],
        r["cloth_vertices"],
        r["title"],
        "–" if ms is None else f"{ms['p50']:.1f} / {ms['p99']:.1f} / {ms['max']:.1f}",
        f"{r['unclean']} of {r['asked']} ({r['with_itself']}, {r['with_body']})",
        known("jitter", 1e3, ".2f"),
        known("speed_at_end", 1e3, ".1f"),
        known("stretch", 1, ".3f"),
        f"{r['frames']}" if r["frames"] == r["of_frames"] else f"{r['frames']} of {r['of_frames']}: not a number",
        f"{r['build_s']:.1f}",
    )
    return "| " + " | ".join(str(cell) for cell in cells) + " |"
