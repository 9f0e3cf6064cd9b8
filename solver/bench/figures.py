"""Figures of many frames, and of several sessions, in one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def spread(values: ArrayLike) -> dict[str, float]:
    """Mean, median, 99th percentile and largest."""
    return {
        "mean": mean(values),
        "p50": float(np.percentile(values, 50)),
        "p99": float(np.percentile(values, 99)),
        "max": float(np.max(values)),
    }


def of_all(sessions: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The figures of sessions that ran at once: a frame's time over all of theirs, the rest of the first one's but for
    what was judged and the memory, which are sums, and the extremes."""
    failed = next((s for s in sessions if "failure" in s), None)
    if failed is not None:
        return dict(failed)
    times = [time for s in sessions for time in s["times_ms"]]
    smallest, largest = ("min_gap",), ("max_stretch", "body_lag", "dressing_s")
    return {
        **{name: value for name, value in sessions[0].items() if name != "times_ms"},
        "frame_ms": spread(times),
        "slowest_p50_ms": max(s["frame_ms"]["p50"] for s in sessions),
        **{name: min(s[name] for s in sessions) for name in smallest},
        **{name: max(s[name] for s in sessions) for name in largest},
        **{name: sum(s[name] for s in sessions) for name in ("frames", "behind", "void", "late", "asked", "unclean")},
        **{key: total([s[key] for s in sessions]) for key in ("memory_mib", "memory_at_most_mib")},
        **{key: added([s[key] for s in sessions]) for key in ("growth_mib", "growth_most_mib", "growth_late_mib")},
        "simulated_over_wall": min(s["simulated_over_wall"] for s in sessions),
    }


def added(parts: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """The sum of each name that all parts have."""
    return {name: sum(part[name] for part in parts) for name in parts[0] if all(name in part for part in parts)}


def total(values: Sequence[float | None]) -> float | None:
    """Their sum; None where one is not known."""
    known = [value for value in values if value is not None]
    return sum(known) if len(known) == len(values) else None


def mean(values: ArrayLike) -> float:
    return float(np.mean(values))
