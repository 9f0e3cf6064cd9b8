"""The results as a table in Markdown."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import limits
from case import case_of, is_of_meshes, stem

COLUMNS = (
    "case",
    "vertices",
    "size",
    "frames (asked)",
    "NaN",
    "cross itself",
    "cross the body",
    "inside",
    "lag p95 [mm]",
    "lag max [mm]",
    "frames over 10 mm (share, allowed)",
    "pinched max [mm]",
    "pinched area [cm²]",
    "skin in skin [mm]",
    "stretch 99.9 %",
    "stretch max",
    "worn",
    "openings slid [mm]",
    "hem travel [mm]",
    "trembling, state (decoded) [mm/s]",
    "speed at rest [mm/s]",
    "force/weight, mean (worst frame off by)",
    "void steps",
    "simulated/wall",
    "ms a frame",
    "limits broken",
)

def _motions(share: float) -> str:
    return ", ".join(name for name, allowed in limits.LATE_SHARE.items() if allowed == share).replace("_", " ")


LIMITS = "; ".join(
    (
        f"Limits: skin to surface p95 {1e3 * limits.LAG_P95:g} mm, max {1e3 * limits.LAG_MAX:g} mm, pinched "
        f"{1e3 * limits.PINCHED_LAG_MAX:g} mm in {_motions(0.0)}; in {_motions(0.02)} unpinched skin may be over "
        f"{1e3 * limits.LAG_MAX:g} mm from it in 2 % of the motion's frames; in other motions the lag is told only",
        f"stretch {limits.STRETCH_MOST:g} of the fabric's limit for 99.9 % of the triangles, "
        f"{limits.STRETCH_ANY:g} for all",
        "worn: every opening is passed by the same limbs as when dressed, and none but the hem has slid by over "
        f"{1e3 * limits.SLID:g} mm",
        f"hem travel over {1e3 * limits.HEM_TRAVEL:g} mm in the walk (its median vertex)",
        f"trembling {1e3 * limits.TREMBLING:g} mm/s",
        f"contact force within {limits.WEIGHT:.0%} of the weight, as a mean over the last half second; of single "
        "frames it is told",
        "a void step breaks no limit",
        "skin in skin: where pinched skin lags, how deep one part's lies in another; cloth between has a place only "
        "where one of the two lags by at least half of that.",
    )
)


def markdown(results: Iterable[dict[str, Any]], about: dict[str, Any]) -> str:
    """The table with what it was made with above it, and what was broken below."""
    results = list(results)
    errands = [result for result in results if "errand" in result]
    results = [result for result in results if "errand" not in result]
    lines = [
        "# Garments in motion, frame by frame",
        "",
        *(f"- {name}: {value}" for name, value in about.items()),
        "",
        "Every frame is the server's, decoded by the client. Trembling and contact force are judged on the solver's "
        "states; decoded frames are rounded to 1/16 mm, which alone trembles by 1 to 2 mm/s at 60 fps.",
        LIMITS,
        "",
        "| " + " | ".join(COLUMNS) + " |",
        "|" + "---|" * len(COLUMNS),
        *(row(result) for result in results),
        "",
    ]
    for result in [*results, *errands]:
        if result.get("failure"):
            lines.append(f"- {name_of(result)}: FAILED, {result['failure']}")
        lines += [f"- {name_of(result)}: {broken['line']}" for broken in result.get("broken", ())]
    sized = [result for result in results if result.get("fit") and result["fit"] != "size 1"]
    fits = dict.fromkeys(f"- {stem(result['case']['garment'])}: {result['fit']}" for result in sized)
    if fits:
        lines += ["", "Sizes other than the pattern's own, and what is too wide:", *fits]
    for errand in errands:
        lines += ["", f"## {errand['errand'].capitalize()}", "", *errand["said"]]
    return "\n".join(lines) + "\n"


def name_of(result: dict[str, Any]) -> str:
    """Garment, motion and what else tells cases apart."""
    if "errand" in result:
        return str(result["errand"])
    case = result["case"]
    if "server" in case:
        where = "live"
    elif is_of_meshes(case_of(case)):
        where = f"mesh on a mesh {case['device']}"
    elif case["edge"]:
        where = f"{1e3 * case['edge']:g} mm {case['device']}"
    else:
        where = f"{case['vertices']} vertices {case['device']}"
    return f"{stem(case['garment'])} {stem(case['motion'])} {case['preset']} {where}"


def row(result: dict[str, Any]) -> str:
    """One line of the table; a dash where a figure was not measured."""
    r = result
    if "frames" not in r:
        return f"| {name_of(r)} | " + "| " * (len(COLUMNS) - 2) + "| failed |"

    def known(name: str, scale: float, form: str) -> str:
        value = r.get(name)
        return "–" if value is None else format(scale * value, form)

    cells = (
        name_of(r),
        r["cloth_vertices"],
        known("size", 1, "g"),
        f"{r['frames']} ({r['frames_asked']})",
        r["not_finite"],
        r["self_intersecting"],
        r["body_intersecting"],
        r["inside"],
        known("lag_p95", 1e3, ".2f"),
        known("lag_max", 1e3, ".1f"),
        f"{known('late_frames', 1, 'd')} ({known('late_share', 100, '.1f')} %, {known('late_allowed', 100, 'g')} %)",
        known("pinched_lag_max", 1e3, ".1f"),
        known("pinched_area", 1e4, ".0f"),
        known("skin_depth", 1e3, ".0f"),
        known("stretch_most", 1, ".3f"),
        known("stretch_max", 1, ".3f"),
        "yes" if r["worn_frames"] == r["frames"] else f"{r['worn_frames']} of {r['frames']}",
        known("slid", 1e3, ".0f"),
        known("hem_travel_median", 1e3, ".0f"),
        f"{known('trembling', 1e3, '.2f')} ({known('trembling_decoded', 1e3, '.2f')})",
        known("speed_at_rest", 1e3, ".1f"),
        f"{known('force_over_weight', 1, '.4f')} ({known('force_off_most', 100, '.2f')} %)",
        known("void_steps", 1, "d"),
        known("simulated_over_wall", 1, ".2f"),
        known("ms_a_frame", 1, ".0f"),
        len(r["broken"]) + bool(r["failure"]) or "none",
    )
    return "| " + " | ".join(str(cell) for cell in cells) + " |"
