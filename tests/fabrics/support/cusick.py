"""The drape coefficient of each fabric: a disc of 300 mm over a pedestal of 180 mm, at rest, and what it looks like.

Cusick 1968; BS 5058. Published coefficients are of cloth; ours say how cloth of a fabric's numbers hangs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from discretisation_disc import DISC, disc_scene, of_shadow, shadow
from discretisation_rest import STILL as AT_REST
from discretisation_rest import come_to_rest, live_with
from small_scenes import STILL

from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import Scene
from tryon_solver.simulation import build

EDGE, COARSE = 5.0, 7.0  # mm, of the mesh, and of the one that tells what the mesh costs
DIRECTIONS = 180  # of the outline that is kept
ACROSS = 2.5e-3  # m, between the places where the hem's height is kept


def draped(fabric: Fabric, edge: float) -> dict[str, Any]:
    """A fabric's disc at rest, meshed by edges of `edge` mm: `coefficient` in 0 to 1, `folds`, its shadow's `outline`
    [mm] around the pedestal, and `hem` [mm], how far below the pedestal's top it is seen to reach from the side."""
    settings = live_with()
    scene = disc_scene(edge, settings, fabric=fabric)
    cloth, speed = come_to_rest(build(scene, settings, "cpu", STILL), STILL)
    coefficient, folds = of_shadow(scene, cloth)
    return {
        "fabric": fabric.name,
        "edge": edge,
        "vertices": len(cloth),
        "coefficient": round(coefficient, 4),
        "folds": folds,
        "at_rest": speed < AT_REST,
        "outline": np.round(1e3 * shadow(scene, cloth, DIRECTIONS), 1).tolist(),
        "hem": np.round(1e3 * hem(scene, cloth), 1).tolist(),
    }


def hem(scene: Scene, cloth: np.ndarray) -> np.ndarray:
    """(places,) m, the lowest that cloth (N, 3) m is seen to hang, from -radius to +radius along x every ACROSS."""
    faces = scene.garment.faces
    sides = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    share = np.linspace(0, 1, 20)[:, None, None]
    points = ((1 - share) * cloth[sides[:, 0]] + share * cloth[sides[:, 1]]).reshape(-1, 3)
    count = round(2 * DISC.radius / ACROSS)
    lowest = np.zeros(count)
    place = ((points[:, 0] + DISC.radius) / ACROSS).astype(int)
    within = (place >= 0) & (place < count)
    np.minimum.at(lowest, place[within], points[within, 1])
    return lowest
