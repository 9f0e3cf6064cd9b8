"""The results as a table in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import limits

from harness import judgement, rest

COLUMNS = (
    "case",
    "vertices",
    "frames (asked)",
    "sub-steps asked",
    "unclean",
    "not free",
    "growth [%]",
    "stretch 99.9 %, max (limit)",
    "lag max, end [mm] (over 10 mm [s])",
    "trembling, worst second [mm/s]",
    "speed at the end [mm/s]",
    "void (longest [s])",
    "worn",
    "ms a frame",
    "verdict",
)

LIMITS = "; ".join(
    (
        "Limits: no value that is not a number, no crossing in a published frame and no accepted sub-step that "
        "collides, both by IPC Toolkit in float64 where it was asked",
        f"the energy grows beyond the work done by no more than {judgement.GROWTH:.0%} of the energy at play",
        f"stretch {limits.STRETCH_MOST:g} of the fabric's limit for 99.9 % of the triangles, "
        f"{limits.STRETCH_ANY:g} for all",
        f"{judgement.CATCHING_UP:g} s after the stop the surface is within {1e3 * limits.LAG_MAX:g} mm of the skin "
        f"({1e3 * limits.PINCHED_LAG_MAX:g} mm where the body keeps the cloth squeezed)",
        f"no longer than {judgement.CATCHING_UP:g} s over {1e3 * limits.LAG_MAX:g} mm on the way, but where the body "
        "squeezes cloth",
        f"trembling {1e3 * limits.TREMBLING:g} mm/s RMS above 8 Hz, from 0.5 s after the stop",
        f"where a case says from when on, all motion {1e3 * judgement.QUIET:g} mm/s RMS; asleep equal bytes and no "
        f"solver step, before it {rest.STILL_FOR:g} s at rest, on waking no vertex over {judgement.WAKING:g} m/s",
        f"no longer than {judgement.FROZEN:g} s in the last safe state, void steps in no more than "
        f"{judgement.VOID_SHARE:.0%} of any second's frames, and told in the advice",
        f"told lag, gap and stretch within {1e3 * judgement.TOLD_LAG:g} mm, {1e3 * judgement.TOLD_GAP:g} mm and "
        f"{judgement.TOLD_STRETCH:g} of the true ones",
        "garments worn to the end, as in `make proof`.",
    )
)


def verdict_of(result: Mapping[str, Any]) -> str:
    """In a few words."""
    if result.get("failure"):
        return f"FAILED: {result['failure']}"
    if "refused" in result:
        return "refused by name"
    if result["broken"]:
        return f"{len(result['broken'])} limits broken"
    return "held"


def holds(result: Mapping[str, Any]) -> bool:
    """Did the case keep every limit, or was it rightly refused?"""
    return not result.get("failure") and not result.get("broken")


def markdown(results: Sequence[Mapping[str, Any]], about: Mapping[str, str]) -> str:
    """The table with what it was made with above it, and what was broken, stated and refused below."""
    held = sum(holds(r) for r in results)
    lines = [
        "# Hard cases",
        "",
        *(f"- {name}: {value}" for name, value in about.items()),
        f"- {held} of {len(results)} cases hold",
        "",
        LIMITS,
        "",
        "| " + " | ".join(COLUMNS) + " |",
        "|" + "---|" * len(COLUMNS),
        *(row(result) for result in results),
        "",
        "## What each stresses, and what it broke",
        "",
    ]
    for result in results:
        lines += [f"- **{result['name']}**: {result.get('stresses', '')}", *said_of(result)]
    return "\n".join(lines) + "\n"


def said_of(result: Mapping[str, Any]) -> list[str]:
    """What there is to say of a case beside its figures: what it broke, refused, stated and advised."""
    lines = []
    if result.get("failure"):
        lines.append(f"  - FAILED: {result['failure']}")
    if "refused" in result and not result.get("failure"):
        lines.append(f"  - refused by name: {result['refused']}")
    lines += [f"  - BROKEN: {broken['line']}" for broken in result.get("broken", ())]
    lines += [f"  - stated: {s['line']} ({s['reason']})" for s in result.get("stated", ())]
    if result.get("noise"):
        speed, motion = result["noise"]
        moved = f"cloth on it {1e3 * motion:.3f} mm above 5 Hz"
        lines.append(f"  - under noise: surface {1e3 * speed:.1f} mm/s RMS, {moved}")
    if result.get("off_tracker") is not None:
        off, over = f"{result['off_tracker']:.2f} m", f"over {judgement.OFF_TRACKER:g} m"
        for_long = f"{result['behind_tracker']:.2f} s on end"
        lines.append(f"  - from where the tracker told the skin to be: at most {off}, {over} for {for_long}")
    if result.get("restless") is not None:
        lines.append(f"  - all motion at rest: at most {1e3 * result['restless']:.2f} mm/s RMS")
    if result.get("lost") is not None:
        lines.append(f"  - lost of what it is about: {result['lost']:g}")
    if result.get("asleep"):
        waking = "" if result.get("waking") is None else f", fastest vertex on waking {result['waking']:.3f} m/s"
        lines.append(f"  - asleep for {result['asleep']:.1f} s{waking}")
    return lines + [f"  - advice: {text}" for text in result.get("advice", ())]


def row(result: Mapping[str, Any]) -> str:
    """One line of the table; a dash where a figure was not measured."""
    r = result
    if "frames" not in r:
        return f"| {r['name']} | " + "– | " * (len(COLUMNS) - 2) + f"{verdict_of(r)} |"

    def known(name: str, scale: float, form: str) -> str:
        value = r.get(name)
        return "–" if value is None else format(scale * value, form)

    worn = "–" if r["worn"] is None else "yes" if r["worn"] else "NO"
    cells = (
        r["name"],
        r["vertices"],
        f"{r['frames']} ({r['asked']})",
        r["moves"],
        r["unclean"],
        r["not_free"],
        f"{known('growth', 100, '.2f')}",
        f"{known('stretch_most', 1, '.3f')}, {known('stretch_max', 1, '.3f')} ({known('strain_limit', 1, '.3f')})",
        f"{known('lag_max', 1e3, '.1f')}, {known('lag_end', 1e3, '.1f')} ({known('behind', 1, '.2f')})",
        f"{known('trembling', 1e3, '.2f')}, {known('trembling_most', 1e3, '.2f')}",
        known("speed_at_end", 1e3, ".1f"),
        f"{r['void']} ({known('frozen', 1, '.2f')})",
        worn,
        known("ms", 1, ".0f"),
        verdict_of(r),
    )
    return "| " + " | ".join(str(cell) for cell in cells) + " |"
