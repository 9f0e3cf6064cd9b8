"""Figures of many frames, and of several sessions, in one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def spread(values: Sequence[float]) -> dict[str, float]:
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
    memories = [s["memory_mib"] for s in sessions]
    return {
        **{name: value for name, value in sessions[0].items() if name != "times_ms"},
        "frame_ms": spread(times),
        "slowest_p50_ms": max(s["frame_ms"]["p50"] for s in sessions),
        **{name: min(s[name] for s in sessions) for name in smallest},
        **{name: max(s[name] for s in sessions) for name in largest},
        **{name: sum(s[name] for s in sessions) for name in ("frames", "void", "late", "asked", "unclean")},
        "memory_mib": None if None in memories else sum(memories),
        "growth_mib": {name: sum(s["growth_mib"][name] for s in sessions) for name in sessions[0]["growth_mib"]},
        "simulated_over_wall": min(s["simulated_over_wall"] for s in sessions),
    }


def mean(values: Sequence[float]) -> float:
    return float(np.mean(values))
