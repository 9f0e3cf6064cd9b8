"""What an effect's `bind(spec, context)` gets to see when a simulation is built."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_solver.materials.device import RestShape
from tryon_solver.scene import Scene
from tryon_solver.settings import Settings


@dataclass(frozen=True)
class BuildContext:
    """`mass` (N,) kg and `area` (N,) m^2 are lumped; `rest` the device's copy of the rest shape."""

    scene: Scene
    settings: Settings
    device: str
    rest: RestShape
    mass: np.ndarray
    area: np.ndarray
