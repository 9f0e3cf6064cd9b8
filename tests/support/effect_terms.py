"""What single effects of a built simulation add to a step."""

from __future__ import annotations

import numpy as np
import warp as wp
from small_scenes import device_vectors

from tryon_solver.plan import Contribution
from tryon_solver.simulation import Simulation


def contribution(sim: Simulation, name: str) -> Contribution:
    """The one of that name."""
    return next(c for c in sim.plan.contributions if c.name == name)


def effect_gradient(sim: Simulation, name: str, x: np.ndarray) -> np.ndarray:
    """(N, 3) float64 N: what its `add_gradient` adds at x (N, 3) m."""
    term, gradient = contribution(sim, name), wp.zeros(len(x), dtype=wp.vec3, device="cpu")
    assert term.add_gradient is not None
    term.add_gradient(device_vectors(x), gradient)
    return gradient.numpy().astype(np.float64)
