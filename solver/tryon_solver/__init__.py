"""Penetration-free cloth on a moving body: subspace-preconditioned projective dynamics, incremental potential contact.

`dress` puts a meshed pattern on a body; `build` starts from any intersection-free position; both lead to a
`Simulation`, driven by `Simulation.advance`, which answers with a `StepReport`. The names are imported when first used:
reading a pattern or a body loads neither Warp nor scipy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tryon_solver.dressing.dress import Dressed, dress
    from tryon_solver.dressing.fit import DressingError
    from tryon_solver.results import StepReport
    from tryon_solver.scene import Scene
    from tryon_solver.settings import PRESETS, Settings
    from tryon_solver.simulation import Simulation, build

__all__ = ["PRESETS", "Dressed", "DressingError", "Scene", "Settings", "Simulation", "StepReport", "build", "dress"]

MODULES = {
    "Dressed": "dressing.dress",
    "DressingError": "dressing.fit",
    "dress": "dressing.dress",
    "StepReport": "results",
    "Scene": "scene",
    "PRESETS": "settings",
    "Settings": "settings",
    "Simulation": "simulation",
    "build": "simulation",
}


def __getattr__(name: str) -> object:
    if name not in MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{MODULES[name]}"), name)
