"""From measures of bodies to the factors of a garment: what a pattern was made for, and what is wanted.

A garment is scaled in width by one factor, and in height by one. Girths that ask for different ones share it: the one
that misses none of them by more than any other, in proportion, is the root of the smallest times the largest. Graded
sizes add the same length to chest, waist and hip, so that these part by a few per cent.
"""

from __future__ import annotations

from collections.abc import Mapping

from tryon_solver.geometry.size import SIZE_MAX, SIZE_MIN
from tryon_solver.redesign.edit_error import EditError

GIRTHS = ("chest", "waist", "hip")
HEIGHT = "height"
NAMES = (*GIRTHS, HEIGHT)
MOST_MISSED = 0.03  # of a girth: half of what parts two sizes
TOLD_FROM = 5e-4  # m that a girth is missed by

Measures = Mapping[str, float]
"""By their names, those of NAMES: m, of a body."""


def factors_of(made_for: Measures, wanted: Measures) -> tuple[float, float]:
    """Width and height of the garment for the body that is `wanted`, over those of the one that was made for the other.

    Raises EditError where one is told of one of them alone, or no such factors are.
    """
    for one, other, what in ((wanted, made_for, "made_for"), (made_for, wanted, "wanted")):
        missing = [name for name in one if name not in other]
        if missing:
            message = f"the {missing[0]} is told once, and not both of what the pattern was made for and what is wanted"
            raise EditError(message, f"{what}.{missing[0]}", "Tell it, or leave it out of the other")
    ratios = {name: wanted[name] / made_for[name] for name in wanted}
    girths = {name: ratio for name, ratio in ratios.items() if name in GIRTHS}
    width = (min(girths.values()) * max(girths.values())) ** 0.5 if girths else 1.0
    for name, ratio in girths.items():
        if abs(width / ratio - 1) > MOST_MISSED:
            asked = ", ".join(f"{each} for {own:.3f}" for each, own in girths.items())
            message = f"the width is scaled by one factor, and {asked} are asked for by the measures: too far apart"
            remedy = "Leave some of them out, and take the seams in or let them out there"
            raise EditError(message, f"wanted.{name}", remedy)
    factors = width, ratios.get(HEIGHT, 1.0)
    for factor, names in zip(factors, (tuple(girths), (HEIGHT,))):
        if not SIZE_MIN <= factor <= SIZE_MAX:
            message = f"a factor of {factor:.3f} is outside {SIZE_MIN:g} to {SIZE_MAX:g}"
            raise EditError(message, f"wanted.{names[0]}", "Begin with a pattern nearer to it")
    return factors


def told(made_for: Measures, wanted: Measures, factors: tuple[float, float]) -> str:
    """What the garment is scaled by, and for what body it is then where that is not the one that is wanted."""
    said = f"scaled by {factors[0]:.3f} in width and {factors[1]:.3f} in height"
    missed = [
        f"{name} of {100 * made_for[name] * factors[0]:.1f} instead of {100 * wanted[name]:.1f} cm"
        for name in wanted
        if name in GIRTHS and abs(made_for[name] * factors[0] - wanted[name]) > TOLD_FROM
    ]
    return f"{said}, which is for a {', a '.join(missed)}" if missed else said
