"""Where each effect lives. Importing this imports no effect: Warp compiles a whole module at once, so a module that is
never imported is never compiled."""

from __future__ import annotations

from importlib import import_module

from tryon_solver.effects.base import BuildContext
from tryon_solver.plan import Contribution
from tryon_solver.scene import (
    AirDrag,
    Attached,
    BodyContact,
    FabricDamping,
    Friction,
    Gravity,
    Pins,
    SelfContact,
    Sewing,
    Sleep,
    StrainLimit,
)

MODULES: dict[type, str] = {
    Gravity: "tryon_solver.effects.gravity",
    BodyContact: "tryon_solver.effects.body_contact",
    SelfContact: "tryon_solver.effects.self_contact",
    Friction: "tryon_solver.effects.friction",
    StrainLimit: "tryon_solver.effects.strain_limit",
    FabricDamping: "tryon_solver.effects.fabric_damping",
    Sewing: "tryon_solver.effects.sewing",
    Attached: "tryon_solver.effects.attached",
    AirDrag: "tryon_solver.effects.air_drag",
    Pins: "tryon_solver.effects.pins",
    Sleep: "tryon_solver.effects.sleep",
}


def bind(spec: object, context: BuildContext) -> Contribution | None:
    """The contribution of one effect, or None where the scene leaves it nothing to do."""
    return import_module(MODULES[type(spec)]).bind(spec, context)
