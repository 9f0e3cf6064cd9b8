"""Garments that do not fit, and heavy ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from harness.scene import Ask, HardScene, Run
from harness.wearer import COMES_TO_REST, moving, put_on, walked

from scenes.poses import SKIRT_MOVES, SKIRT_SECONDS
from tryon_solver.materials.fabric import FABRICS

TIGHT = r"too tight for this body"
HEAVY = replace(FABRICS["denim"], name="heavy_denim", areal_density=0.8)


def walking(garment: str, across: float, down: float, fabric: str = "cotton_jersey") -> Callable[[Ask], Run]:
    """The garment in other proportions, on a walk that stops."""

    def set_up(ask: Ask) -> Run:
        stance, stops = walked(0.5 * ask.seconds)
        quiet = stops + COMES_TO_REST[garment]
        return moving(put_on(ask, garment, fabric, across, down), stance, stops, quiet=quiet)

    return set_up


def heavy_skirt(ask: Ask) -> Run:
    """A skirt to the floor in denim of 0.8 kg/m^2, walked in."""
    stance, stops = walked(SKIRT_MOVES * ask.seconds)
    return moving(put_on(ask, "skirt", HEAVY, 1.0, 2.0), stance, stops, quiet=stops + COMES_TO_REST["skirt"])


SCENES = (
    *(
        HardScene(
            f"tshirt_{percent}_percent_too_small",
            f"a T-shirt {percent} % too small: worn to the end, or refused as too tight",
            walking("tshirt", 1 - percent / 100, 1 - percent / 100),
            refused=TIGHT,
        )
        for percent in (10, 20, 30)
    ),
    HardScene(
        "tshirt_2x_too_large",
        "a T-shirt twice too large on a walk",
        walking("tshirt", 2.0, 2.0),
    ),
    HardScene(
        "tshirt_3x_too_large",
        "a T-shirt three times too large: its collar is wider than the shoulders; worn to the end, or refused as that",
        walking("tshirt", 3.0, 3.0),
        refused=r"too large for this body",
    ),
    HardScene(
        "heavy_long_skirt",
        "a floor-length skirt of 0.8 kg/m^2 on a walk",
        heavy_skirt,
        seconds=SKIRT_SECONDS,
    ),
)
