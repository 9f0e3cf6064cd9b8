"""Penetration-free cloth on a moving body: subspace-preconditioned projective dynamics, incremental potential contact.

`dress` puts a meshed pattern on a body; `build` starts from any intersection-free position; both lead to a
`Simulation`, driven by `Simulation.advance`, which answers with a `StepReport`.
"""

from tryon_solver.dressing.dress import Dressed, DressingError, dress
from tryon_solver.results import StepReport
from tryon_solver.scene import Scene
from tryon_solver.settings import PRESETS, Settings
from tryon_solver.simulation import Simulation, build

__all__ = ["PRESETS", "Dressed", "DressingError", "Scene", "Settings", "Simulation", "StepReport", "build", "dress"]
