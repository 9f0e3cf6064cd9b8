"""How high a skirt's hem hangs on a body that stands: from the floor to the mean of its lowest border."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from accuracy_patterns import pattern_of
from discretisation_rest import AT_60, come_to_rest, live_with, tailors_row

from tryon_solver import dress
from tryon_solver.body.model import default_body
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.size import mesh_with_vertices
from tryon_solver.materials.fabric import FABRICS


@dataclass(frozen=True)
class Hem:
    """Of a garment of the demo; how many `vertices`, and `usual` where they are not what is varied."""

    garment: str = "skirt"
    fabric: str = "cotton_jersey"
    vertices: tuple[int, ...] = (300, 600, 1200, 2400)
    usual: int = 600


HEM = Hem()
LONGEST = 8.0  # s after it was dressed: a hem swings for five


def hem(vertices: int | None = None, rate: float | None = None, d_hat: float | None = None) -> dict[str, Any]:
    """The hem's height [mm] and how much it goes up and down, RMS [mm], with one size changed: vertices, steps a
    second, or d_hat [mm]."""
    panels = mesh_with_vertices(pattern_of(HEM.garment), vertices or HEM.usual)
    settings = live_with(rate or AT_60, **({} if d_hat is None else {"d_hat": 1e-3 * d_hat}))
    dressed = dress(panels, default_body(), FABRICS[HEM.fabric], settings, "cpu")
    cloth, speed = come_to_rest(dressed.simulation, dressed.pose, LONGEST)
    floor = dressed.simulation.body_positions()[:, 1].min()
    loops = boundary_loops(dressed.simulation.scene.garment.faces)
    height = min((cloth[loop, 1] for loop in loops), key=np.mean) - floor
    asked = {"vertices": vertices, "steps [1/s]": rate, "d_hat [mm]": d_hat}
    varied = {name: float(value) for name, value in asked.items() if value is not None}
    more = {"waves": 1e3 * float(height.std()), "speed": speed}
    return tailors_row("hem height", "mm", 1e3 * height.mean(), varied, len(cloth), **more)
