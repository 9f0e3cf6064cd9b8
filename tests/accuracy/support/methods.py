"""By what a step is taken: our solver at some settings, a part of it, another precision, or another solver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from tryon_solver.settings import Settings
from tryon_solver.stepping.estimate import scale_of

TITLES = {
    "ours": "ours",
    "trial": "projective dynamics alone",
    "float64": "ours in float64",
    "inertia": "inertia alone",
    "newton_ipc": "Newton IPC",
    "xpbd": "XPBD",
    "chebyshev": "Chebyshev-Jacobi PD",
    "vbd": "Newton's VBD",
    "style3d": "Newton's Style3D",
}


@dataclass(frozen=True)
class Method:
    """`solver` is one of TITLES; `settings` are of ours, `at` says what was varied and to which number."""

    solver: str
    settings: Settings | None = None
    at: Mapping[str, float] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """Ready for JSON: what a page has to know of it; `scale` is what its estimates are scaled by."""
        told = {"solver": self.solver, "at": dict(self.at)}
        return told if self.settings is None else {**told, "scale": scale_of(self.settings)}


def ours(settings: Settings, solver: str = "ours", **at: float) -> Method:
    """Our solver at these settings."""
    return Method(solver, settings, at)
