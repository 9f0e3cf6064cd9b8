"""A simulation built while another goes on: in parts between its frames, the dearest one on a thread beside both."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import wait
from itertools import chain
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from tryon_solver.scene import Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import BESIDE, Simulation

LOOK_SECONDS = 1e-3  # for an inverse that is being made


def build_in_parts(
    scene: Scene,
    settings: Settings,
    device: str,
    pose: Any,
    surface: np.ndarray | None,
    dt: float,
    basis: csr_matrix | None = None,
    more: Iterable[object] = (),
) -> Iterator[Simulation | None]:
    """As `build`, for steps of `dt` s, but for the look whether the start touches; None after each part but the last.

    `basis` is the garment's `basis_by_edges` if that has been made; `more` are parts of something else, done while the
    inverse is being made. Raises GarmentError as `build`.
    """
    simulation = Simulation(scene, settings, device)
    yield None
    building = simulation.parts(pose, surface, basis)
    next(building)
    yield None
    next(building)
    simulation.whole = dt
    simulation.set_diagonals(dt)
    inverse = BESIDE.submit(simulation.inverse_to_make())  # as soon as there are matrices: it takes longest
    yield None
    for _ in chain(building, more):
        yield None
    while not wait([inverse], LOOK_SECONDS).done:
        yield None
    simulation.use_inverse(inverse.result())
    yield simulation
