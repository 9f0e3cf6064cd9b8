"""Contact between cloth and body: lets the cloth touch the body's surface."""

from __future__ import annotations

from tryon_solver.contact import import_for_steps
from tryon_solver.effects.base import BuildContext
from tryon_solver.plan import Contribution
from tryon_solver.scene import BodyContact

import_for_steps()  # and with them their kernels, which are compiled before the first step


def bind(spec: BodyContact, context: BuildContext) -> Contribution | None:
    """The barrier itself is in contact/; this names the surface it acts on."""
    return Contribution("body_contact", touches=("body",))
