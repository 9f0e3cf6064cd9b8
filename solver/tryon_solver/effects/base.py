"""What an effect's `bind(spec, context)` gets to see when a simulation is built."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from tryon_solver.materials.device import RestShape
from tryon_solver.scene import Scene
from tryon_solver.settings import Settings


@dataclass(frozen=True)
class BuildContext:
    """`mass` (N,) kg and `area` (N,) m^2 are lumped; `rest` the device's copy of the rest shape; `bending` (N, N) N/m
    the constant bending matrix, None where no fabric has any."""

    scene: Scene
    settings: Settings
    device: str
    rest: RestShape
    mass: np.ndarray
    area: np.ndarray
    bending: sp.csr_matrix | None
