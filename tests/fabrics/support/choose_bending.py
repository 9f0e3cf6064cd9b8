"""The bending stiffness with which a fabric drapes as was published, found by trials.

A fabric whose mean over all starts lies in its range keeps its stiffness. For another the middle of the range is aimed
at by secants of the mean over the stiffness' logarithm, with the mesh that sessions at `live` have, and the first trial
that lies within the range by SURELY times its spread is taken: what was set before is left by no more than it takes.
Trials are rounded to two figures; all other numbers of the fabric stay.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import exp, log
from typing import Any

from cusick import LIVE, draped_often, mean_and_spread

from tryon_solver.materials.fabric import Fabric

SURELY = 2.0  # spreads of the starts
TRIALS = 8
FACTOR = 0.5  # from the first trial to the second, down, where the first hangs too stiffly

Trial = dict[str, Any]


def choose(fabric: Fabric, drape: Callable[[Fabric], dict[str, Any]] = lambda f: draped_often(f, LIVE)) -> list[Trial]:
    """The trials, the last of them the choice: `k_bend` [N m], `mean` and `spread` of the drape coefficient.

    Raises ValueError for a fabric without a published range, and RuntimeError where TRIALS don't come into it.
    """
    if fabric.drape is None:
        raise ValueError(f"fabric {fabric.name!r}: drape is None; give the range that was published")
    least, most = fabric.drape
    middle = 0.5 * (least + most)
    trials: list[Trial] = []
    k_bend = fabric.k_bend
    while len(trials) < TRIALS:
        mean, spread = mean_and_spread(drape(replace(fabric, k_bend=k_bend)))
        trials.append({"k_bend": k_bend, "mean": round(mean, 4), "spread": round(spread, 4)})
        margin = 0.0 if len(trials) == 1 else SURELY * spread
        if least + margin <= mean <= most - margin:
            return trials
        k_bend = float(f"{following(trials, middle):.2g}")
    raise RuntimeError(f"fabric {fabric.name!r}: {TRIALS} trials miss {least} to {most}: {trials}")


def following(trials: list[Trial], middle: float) -> float:
    """N m, of the next trial: where the line through the last two meets the middle, at most a factor 4 away."""
    last = trials[-1]
    if len(trials) == 1:
        return float(last["k_bend"] * (FACTOR if last["mean"] > middle else 1 / FACTOR))
    before = trials[-2]
    slope = (last["mean"] - before["mean"]) / log(last["k_bend"] / before["k_bend"])
    if slope <= 0:  # the spread hides what the stiffness does: a larger step
        return float(last["k_bend"] * (FACTOR if last["mean"] > middle else 1 / FACTOR))
    step = (middle - last["mean"]) / slope
    return float(last["k_bend"] * exp(max(-log(4), min(log(4), step))))
