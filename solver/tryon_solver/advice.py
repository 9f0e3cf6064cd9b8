"""What to do when the figures of a step are out of bounds, in words for people."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from tryon_solver.materials.fabric import FABRICS, Fabric
from tryon_solver.results import Counters

if TYPE_CHECKING:
    from tryon_solver.settings import Settings

STRETCH_MOST = 1.02  # of the fabric's limit, for all but OVERSTRETCHED of the triangles
OVERSTRETCHED = 1e-3
STRETCH_ANY = 1.10  # of the fabric's limit, for every triangle
FAR = 4.0  # times the accuracy asked for: within that an error is told rightly, nearly always
PULLING = ("elastic", "fasteners", "adhesion", "pins", "pressure", "gas", "wind", "gravity")  # what can stretch cloth;
HEAVY = 2 * 9.81  # m/s^2: a weight can from there on
LAG = 10e-3  # m from the skin to the collision surface; skin that the body itself pinches may be part of it


def advise(
    counters: Counters,
    debt: float,
    fabric: Fabric,
    stretch: np.ndarray,
    lag: float,
    more: str = "",
    acting: Collection[str] = (),
) -> str:
    """Sentences about one call of `advance`, "" when there is nothing to say.

    `stretch` (F,) is the larger principal stretch of each triangle, `lag` the largest distance [m] from the tracked
    skin to the collision surface, `debt` the time [s] that a gap in the poses left to be simulated, `more` what
    there is to say besides, `acting` the effects that act, gravity among them where it is `heavy`.
    """
    said = []
    if counters.retries:
        said.append(f"{counters.retries} steps were void; the garment stayed in its last safe state")
    if counters.reverts:
        said.append(f"in {counters.reverts} of them the body moved and the garment stayed behind")
    if debt:
        said.append(f"{debt:.2f} s of motion are still to be simulated: poses came too rarely")
    if more:
        said.append(more)
    if counters.behind:
        said.append(f"the pose leaps: the skin is up to {counters.behind:.2f} m short of it, and goes on from there")
    strained = []
    if overstretched(fabric, stretch):
        strained.append(f"the fabric is stretched by up to {percent(float(stretch.max()))} ({allowed(fabric)})")
    if lag > LAG:
        strained.append(f"the cloth holds the body's surface {1e3 * lag:.0f} mm behind the skin")
    if strained:
        best = max(FABRICS.values(), key=lambda known: known.strain_limit)
        other = f"a fabric that stretches more ({best.name}: {percent(best.strain_limit)})"
        tries = "a larger size, a slower motion, or more accuracy (a finer preset: live, fit, or a smaller error)"
        tries = tries if best.strain_limit <= fabric.strain_limit else f"{other}, {tries}"
        why = ["too tight for this motion", "caught between parts of the body"]
        if pulling := ", ".join(name for name in PULLING if name in acting):
            why.insert(0, f"pulled by what acts on it ({pulling})")
            tries = f"less of that, or have it come in over a longer time, {tries}"
        said.append(f"{' and '.join(strained)}: the garment is {', or '.join(why)}; try {tries}")
    return "; ".join(said)


def heavy(acceleration: np.ndarray) -> bool:
    """Is a gravity of this acceleration (1, 3) m/s^2 more than garments are made for?"""
    return float(np.linalg.norm(acceleration)) > HEAVY


def unmet(settings: Settings, error: float, late: float, residual: float = 0.0) -> str:
    """What was asked for of a step and not had: `late` [s] by which the deadline was missed, `error` [m] as estimated
    where an accuracy was to be come to, whatever it takes or before the deadline, and `residual` [m/s] where passes
    were to go on until it is that of the settings."""
    accuracy, deadline = settings.accuracy, settings.deadline
    if late:
        return f"the deadline was missed by {1e3 * late:.1f} ms: allow more time, or choose a coarser mesh"
    if accuracy is not None and error > FAR * accuracy:
        wanted = f"an error of {1e3 * accuracy:.2g} mm was not reached"
        nearer = "shorter steps (a finer preset) or a slower motion come nearer"
        if deadline is not None:
            wanted, nearer = f"{wanted} in {1e3 * deadline:.3g} ms", f"more time, {nearer}"
        return f"{wanted}, it is {1e3 * error:.2g} mm: {nearer}"
    if settings.contact_passes > 1 and settings.ends_by_budget and residual > settings.correction_tolerance:
        return (
            f"{settings.contact_passes} passes did not converge: Newton's ways are {residual:.2g} m/s long yet, and "
            f"the estimated error is {1e3 * error:.2g} mm: shorter steps or a slower motion come nearer"
        )
    return ""


def overstretched(fabric: Fabric, stretch: np.ndarray) -> bool:
    """Are more than a few triangles, of `stretch` (F,), longer than the fabric allows, or is one of them far longer?"""
    limit, most = fabric.strain_limit, float(stretch.max())
    if most <= STRETCH_MOST * limit:
        return False  # as in nearly all frames
    return bool(most > STRETCH_ANY * limit or (stretch > STRETCH_MOST * limit).mean() > OVERSTRETCHED)


def nearest_limit(fabrics: list[Fabric], stretch: np.ndarray) -> tuple[Fabric, np.ndarray]:
    """Of several fabrics (F,) the one that is nearest its limit or furthest beyond, and `stretch` (F,) as if all were
    of it: the same shares of their limits."""
    limits = np.array([fabric.strain_limit for fabric in fabrics])
    worst = fabrics[int(np.argmax(stretch / limits))]
    return worst, stretch / limits * worst.strain_limit


def percent(stretch: float) -> str:
    """How much longer than the pattern."""
    return f"{100 * (stretch - 1):.0f} %"


def allowed(fabric: Fabric) -> str:
    """What the fabric bears, in words."""
    return f"{fabric.name} bears {percent(fabric.strain_limit)}"
