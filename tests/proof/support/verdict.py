"""From the figures of all frames to those of the run, and the limits that were broken."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import limits
import numpy as np
from frame_figures import FrameFigures
from limits import Broken
from over_time import travel

SERIES = (
    "lag_p95",
    "lag_max",
    "pinched_lag_max",
    "pinched_area",
    "skin_depth",
    "stretch_most",
    "stretch_max",
    "slid",
)


def broken_by_frames(
    figures: Sequence[FrameFigures], strain_limit: float, late_allowed: float | None
) -> Iterable[Broken]:
    """Limits that hold in every frame; the first of `figures` is frame 0, as dressed.

    Those of the lag only where no frame may be over: `late_allowed` is the motion's `limits.late_share`.
    """
    numbers = range(len(figures))
    asked = [(k, f.verdict) for k, f in zip(numbers, figures) if f.verdict is not None]

    def over(limit: str, name: str, bound: float) -> Iterable[Broken]:
        return limits.over(limit, numbers, [float(getattr(f, name)) for f in figures], bound)

    yield from limits.over("not a number", numbers, [float(not f.finite) for f in figures], 0)
    yield from limits.over("intersections", [k for k, _ in asked], [float(not v.clean) for _, v in asked], 0)
    if late_allowed == 0:
        yield from over("skin to surface, p95 [m]", "lag_p95", limits.LAG_P95)
        yield from over("skin to surface, max [m]", "lag_max", limits.LAG_MAX)
        yield from over("pinched skin to surface [m]", "pinched_lag_max", limits.PINCHED_LAG_MAX)
    yield from over("stretch, 99.9 %", "stretch_most", limits.STRETCH_MOST * strain_limit)
    yield from over("stretch, max", "stretch_max", limits.STRETCH_ANY * strain_limit)
    yield from limits.over("no longer worn", numbers, [float(not f.worn) for f in figures], 0)
    yield from over("an opening slid along its limb [m]", "slid", limits.SLID)


def figures_of_frames(figures: Sequence[FrameFigures]) -> dict[str, Any]:
    """Counts and worst values over the frames, and series of what may be looked at frame by frame."""
    asked = [f.verdict for f in figures if f.verdict is not None]
    series = {name: [getattr(f, name) for f in figures] for name in SERIES}
    return {
        "frames": len(figures),
        "frames_asked": len(asked),
        "not_finite": sum(not f.finite for f in figures),
        "self_intersecting": sum(v.self_intersecting for v in asked),
        "body_intersecting": sum(v.body_intersecting for v in asked),
        "inside": max((v.inside for v in asked), default=0),
        **{name: max(values, default=math.nan) for name, values in series.items()},
        "worn_frames": sum(f.worn for f in figures),
        "series": {**series, "worn": [f.worn for f in figures]},
    }


def broken_by_share(late_share: float, late_allowed: float | None) -> Iterable[Broken]:
    """The limit of the frames in which the surface is late, where some may be."""
    if late_allowed:
        yield from limits.run_over("share of frames with skin to surface over 10 mm", late_share, late_allowed)


def broken_by_weight(force: list[float]) -> Iterable[Broken]:
    """`force` on the body over the garment's weight, frame by frame at rest: its mean must be the weight."""
    off = abs(float(np.mean(force)) - 1) if force else None
    return limits.run_over("contact force off the weight", off, limits.WEIGHT)


def late(figures: Sequence[FrameFigures], motion_frames: int) -> dict[str, float]:
    """Frames in which unpinched skin is over LAG_MAX from the surface, and their share of the motion's own frames."""
    count = sum(not f.lag_max <= limits.LAG_MAX for f in figures)
    return {"late_frames": count, "late_share": count / max(motion_frames, 1)}


def hem_travel(figures: Sequence[FrameFigures]) -> dict[str, float | None]:
    """How far the lowest loop's vertices move relative to the pelvis [m]: the median vertex and the widest."""
    if len(figures) < 2:
        return {"hem_travel_median": None, "hem_travel_max": None}
    moved = travel(np.array([f.hem for f in figures]))
    return {"hem_travel_median": float(np.median(moved)), "hem_travel_max": float(moved.max())}
