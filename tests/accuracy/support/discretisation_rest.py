"""Cloth that comes to rest, and rows of what is measured of it then."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tryon_solver.body.pose import Pose
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.settings import PRESETS, Settings
from tryon_solver.simulation import Simulation

STILL = 1e-3  # m/s, RMS over the cloth: slower is at rest
CALM = 0.25  # s, for which it has to be: what swings is so slow where it turns back
LONGEST = 4.0  # s, after which it is measured anyway
AT_60 = 60  # steps a second where they are not what is varied


def live_with(rate: float = AT_60, **changes: Any) -> Settings:
    """`live` in so many steps a second, with these changes."""
    return replace(PRESETS["live"], largest_step=1 / rate, **changes)


def come_to_rest(sim: Simulation, pose: Pose | None, longest: float = LONGEST) -> tuple[np.ndarray, float]:
    """(N, 3) m where the cloth is at rest, or after so many seconds, and its RMS speed then [m/s]."""
    dt = sim.settings.largest_step
    begun, before = sim.state.time, sim.cloth_positions().astype(np.float64)
    speed, calm = np.inf, 0
    for k in range(1, round(longest / dt) + 1):
        sim.advance(pose, begun + k * dt)
        cloth = sim.cloth_positions().astype(np.float64)
        speed = float(np.sqrt(((cloth - before) ** 2).sum(1).mean())) / dt
        before = cloth
        calm = calm + 1 if speed < STILL else 0
        if calm * dt >= CALM:
            break
    return before, speed


def meshed(outline: np.ndarray, edge: float) -> tuple[Garment, np.ndarray]:
    """A piece of that outline (P, 2) m, meshed with edges of about `edge` m, and its pattern's places (N, 2) m."""
    panel = {
        "vertices": (100 * outline).tolist(),
        "edges": [{"endpoints": [k, (k + 1) % len(outline)]} for k in range(len(outline))],
        "translation": [0, 0, 0],
        "rotation": [0, 0, 0],
    }
    pattern = {"pattern": {"panels": {"piece": panel}, "stitches": []}, "properties": {"units_in_meter": 100}}
    mesh = mesh_pattern(parse_pattern(pattern), edge)
    return Garment(mesh.faces, mesh.uv[mesh.faces], np.zeros(len(mesh.faces), np.int32), len(mesh.uv)), mesh.uv


def tailors_row(
    measure: str,
    unit: str,
    value: float,
    varied: dict[str, float],
    vertices: int,
    exact: float | None = None,
    **more: Any,
) -> dict[str, Any]:
    """Of the table: the measure, and what was varied, to which number."""
    ((name, at),) = varied.items()
    figures = {"value": float(value), "at": float(at), "exact": exact, "vertices": vertices}
    return {"measure": measure, "unit": unit, "varied": name, **figures, **more}
