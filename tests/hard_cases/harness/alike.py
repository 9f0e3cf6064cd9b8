"""Cases whose figures have to be those of another case: the same scene elsewhere, or told otherwise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import limits

BY = {  # figure -> by how much it may differ: float32 rounds differently elsewhere, and contact makes that more
    "growth": 1e-3,  # share of the energy at play
    "stretch_most": 1e-3,
    "stretch_max": 1e-3,
    "lag_max": 1e-5,  # m
    "lag_end": 1e-5,
    "min_gap": 1e-5,
    "slid": 1e-4,
    "trembling": 1e-4,  # m/s
    "restless": 1e-4,
    "speed_at_end": 1e-4,
}


def held_to(results: Sequence[dict[str, Any]], same_as: Mapping[str, str]) -> None:
    """Adds to each result what is not as in the result that `same_as` names for it, where both have been played."""
    played = {r["name"]: r for r in results if "frames" in r}
    for name, other in same_as.items():
        if name in played and other in played:
            result, model = played[name], played[other]
            for figure, by in BY.items():
                off = difference(result.get(figure), model.get(figure))
                found = limits.run_over(f"{figure} not as in {other}, off by", off, by)
                result["broken"] = [*result["broken"], *(b.plain() for b in found)]


def difference(one: float | None, other: float | None) -> float:
    """Infinite where only one of the two was measured."""
    if one is None or other is None:
        return 0.0 if one is other else float("inf")
    return abs(one - other)
