"""Vertices drawn to places that are other ones from frame to frame (drawn.py): pins under a name of their own, so that
what a tailor's pins hold meanwhile stays held."""

from __future__ import annotations

from dataclasses import replace

from tryon_solver.effects import pins
from tryon_solver.effects.base import BuildContext
from tryon_solver.plan import Contribution
from tryon_solver.scene import Pins


def bind(spec: Pins, context: BuildContext) -> Contribution | None:
    """None when nothing is drawn."""
    bound = pins.bind(spec, context)
    return None if bound is None else replace(bound, name="drawn")
