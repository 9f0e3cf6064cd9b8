"""The results as a table in Markdown."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import limits
from case import stem

COLUMNS = (
    "case",
    "vertices",
    "frames (asked)",
    "NaN",
    "cross itself",
    "cross the body",
    "inside",
    "lag p95 [mm]",
    "lag max [mm]",
    "pinched max [mm]",
    "pinched area [cm²]",
    "stretch 99.9 %",
    "stretch max",
    "worn",
    "hem travel [mm]",
    "trembling, state (decoded) [mm/s]",
    "force/weight (worst)",
    "void steps",
    "ms a frame",
    "broken",
)

LIMITS = (
    f"Limits: skin to surface p95 {1e3 * limits.LAG_P95:g} mm, max {1e3 * limits.LAG_MAX:g} mm, pinched "
    f"{1e3 * limits.PINCHED_LAG_MAX:g} mm; stretch {limits.STRETCH_MOST:g} of the fabric's limit for 99.9 % of the "
    f"triangles, {limits.STRETCH_ANY:g} for all; hem travel over {1e3 * limits.HEM_TRAVEL:g} mm in the walk (the hem's "
    f"median vertex); trembling {1e3 * limits.TREMBLING:g} mm/s; contact force within {limits.WEIGHT:.0%} of the "
    "weight in every frame at rest. A void step breaks no limit."
)


def markdown(results: Iterable[dict[str, Any]], about: dict[str, Any]) -> str:
    """The table with what it was made with above it, and what was broken below."""
    results = list(results)
    lines = [
        "# Garments in motion, frame by frame",
        "",
        *(f"- {name}: {value}" for name, value in about.items()),
        "",
        "Every frame is the server's, decoded by the client; trembling and contact force are of the solver's states.",
        LIMITS,
        "",
        "| " + " | ".join(COLUMNS) + " |",
        "|" + "---|" * len(COLUMNS),
        *(row(result) for result in results),
        "",
    ]
    for result in results:
        if result.get("failure"):
            lines.append(f"- {name_of(result)}: FAILED, {result['failure']}")
        lines += [f"- {name_of(result)}: {broken['line']}" for broken in result.get("broken", ())]
    return "\n".join(lines) + "\n"


def name_of(result: dict[str, Any]) -> str:
    """Garment, motion and what else tells cases apart."""
    case = result["case"]
    return f"{stem(case['garment'])} {stem(case['motion'])} {case['preset']} {case['device']}"


def row(result: dict[str, Any]) -> str:
    """One line of the table."""
    if "frames" not in result:
        return f"| {name_of(result)} | " + " | ".join([""] * (len(COLUMNS) - 2)) + " | failed |"
    r = result
    cells = (
        name_of(r),
        r["cloth_vertices"],
        f"{r['frames']} ({r['frames_asked']})",
        r["not_finite"],
        r["self_intersecting"],
        r["body_intersecting"],
        r["inside"],
        f"{1e3 * r['lag_p95']:.2f}",
        f"{1e3 * r['lag_max']:.1f}",
        f"{1e3 * r['pinched_lag_max']:.1f}",
        f"{1e4 * r['pinched_area']:.0f}",
        f"{r['stretch_most']:.3f}",
        f"{r['stretch_max']:.3f}",
        "yes" if r["worn_frames"] == r["frames"] else f"{r['worn_frames']} of {r['frames']}",
        f"{1e3 * r['hem_travel_median']:.0f}",
        f"{known(r['trembling'], 1e3, '.2f')} ({known(r['trembling_decoded'], 1e3, '.2f')})",
        f"{known(r['force_over_weight'], 1, '.3f')} ({known(r['force_off_most'], 1, '.3f')})",
        r["void_steps"],
        known(r["solver_ms_median"], 1, ".0f"),
        len(r["broken"]) + bool(r["failure"]) or "none",
    )
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def known(value: float | None, scale: float, form: str) -> str:
    """A figure, or a dash where it was not measured."""
    return "–" if value is None else format(scale * value, form)
