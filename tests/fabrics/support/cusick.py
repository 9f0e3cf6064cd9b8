"""The drape coefficient of each fabric: a disc of 300 mm over a pedestal of 180 mm, at rest, and what it looks like.

Cusick 1968; BS 5058. Published coefficients are of cloth; ours say how cloth of a fabric's numbers hangs. A disc may
fold in several ways, so that it is laid on anew from each of STARTS, as a drapemeter's is: the mean and the spread
count.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from discretisation_disc import DISC, Start, disc_scene, of_shadow, shadow
from discretisation_rest import STILL as AT_REST
from discretisation_rest import come_to_rest
from small_scenes import STILL

from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

STARTS = (Start(), Start(22.5, 4, 1.2), Start(45.0, 6, 2.1), Start(67.5, 7, 0.8))
DIRECTIONS = 180  # of the outline that is kept
ACROSS = 2.5e-3  # m, between the places where the hem's height is kept


@dataclass(frozen=True)
class Mesh:
    """Edges of `edge` mm, simulated at a preset, from so many of STARTS."""

    edge: float
    preset: str = "live"
    starts: int = len(STARTS)

    def __str__(self) -> str:
        return f"{self.edge:g}mm-{self.preset}"


FINE = Mesh(5.0, starts=1)
LIVE, DRAFT = Mesh(8.5), Mesh(17.0, "draft")  # as sessions have them: EDGE_LENGTHS of runtime/production.py
COARSE = Mesh(DRAFT.edge)  # the mesh of `draft` with the budgets of `live`: what of its drape is the mesh's
MESHES = (DRAFT, COARSE, LIVE, FINE)


def draped(fabric: Fabric, mesh: Mesh, start: Start = STARTS[0]) -> dict[str, Any]:
    """A fabric's disc at rest: `coefficient` in 0 to 1, `folds`, its shadow's `outline` [mm] around the pedestal, and
    `hem` [mm], how far below the pedestal's top it is seen to reach from the side."""
    settings = PRESETS[mesh.preset]
    scene = disc_scene(mesh.edge, settings, fabric=fabric, start=start)
    cloth, speed = come_to_rest(build(scene, settings, "cpu", STILL), STILL)
    coefficient, folds = of_shadow(scene, cloth)
    return {
        "vertices": len(cloth),
        "coefficient": round(coefficient, 4),
        "folds": folds,
        "at_rest": speed < AT_REST,
        "outline": np.round(1e3 * shadow(scene, cloth, DIRECTIONS), 1).tolist(),
        "hem": np.round(1e3 * hem(scene, cloth), 1).tolist(),
    }


def draped_often(fabric: Fabric, mesh: Mesh) -> dict[str, Any]:
    """From each of the mesh's starts: lists of `coefficient`, `folds` and `at_rest`; what is seen is the first's."""
    runs = [draped(fabric, mesh, start) for start in STARTS[: mesh.starts]]
    about = {"fabric": fabric.name, "edge": mesh.edge, "preset": mesh.preset, "k_bend": fabric.k_bend}
    lists = {name: [run[name] for run in runs] for name in ("coefficient", "folds", "at_rest")}
    return {**about, **runs[0], **lists}


def mean_and_spread(run: Mapping[str, Any]) -> tuple[float, float]:
    """Of the coefficients of a run: their mean and standard deviation, which of a single one is 0."""
    found = run["coefficient"]
    return float(np.mean(found)), float(np.std(found, ddof=1)) if len(found) > 1 else 0.0


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
