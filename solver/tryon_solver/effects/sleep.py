"""Sleep: when nothing moves, nothing is done. The watch over it is stepping/sleep.py's."""

from __future__ import annotations

from tryon_solver.effects.base import BuildContext
from tryon_solver.plan import Contribution
from tryon_solver.scene import Sleep


def bind(spec: Sleep, context: BuildContext) -> Contribution | None:
    """None when no stillness is long enough, or no speed low enough, to sleep."""
    if spec.speed == 0 or spec.fastest == 0 or spec.time == float("inf"):
        return None
    return Contribution("sleep", sleep=spec)
