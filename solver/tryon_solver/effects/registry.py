"""From what a scene asks for to what does it. Importing this imports no effect: Warp compiles a whole module at once,
so a module that is never imported is never compiled."""

from __future__ import annotations

from importlib import import_module

from tryon_solver.effects.base import BuildContext
from tryon_solver.plan import Contribution
from tryon_solver.scene import EffectSpec


def bind(spec: EffectSpec, context: BuildContext) -> Contribution | None:
    """The contribution of one effect, or None where the scene leaves it nothing to do."""
    return import_module(spec.module).bind(spec, context)
