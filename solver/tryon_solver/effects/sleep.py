"""Sleep: when nothing moves, nothing is done. The watch over it is stepping/sleep.py's."""

from __future__ import annotations

from tryon_solver.effects.base import BuildContext
from tryon_solver.plan import Contribution
from tryon_solver.scene import Sleep


def bind(spec: Sleep, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec of no speed that is low enough is idle."""
    return Contribution("sleep", sleep=spec)
