"""Plays garments that are worn over each other, and has every frame judged."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
from frame_judge import FrameJudge, principal_stretches
from worn_garment import DEMO, demo_motion, led_into

from tryon_solver.body.model import default_body
from tryon_solver.dressing.dress import dress
from tryon_solver.dressing.outfit import Outfit, Worn, WornOutfit
from tryon_solver.dressing.put_over import put_over
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

OUTFIT = {"skirt": "cotton_poplin", "tshirt": "cotton_jersey", "overshirt": "denim"}
EDGE, COUNT = 0.0165, 3117  # m, and how many vertices each of these has with it in the mean; count times edge^2 stays


def edge_for(vertices: int) -> float:
    """Length of edges [m] with which garments have about so many vertices each."""
    return float(EDGE * np.sqrt(COUNT / vertices))


def put_on(names: list[str], edge: float, preset: str, device: str) -> WornOutfit:
    """These garments, one over the other."""
    meshes = {name: mesh_pattern(load_pattern(DEMO / "patterns" / f"{name}.json"), edge) for name in names}
    first, *others = names
    fabric = FABRICS[OUTFIT[first]]
    alone = dress(meshes[first], default_body(), fabric, PRESETS[preset], device)
    outfit = Outfit((Worn.of_pattern(first, alone.panels, alone.welded, fabric),))
    worn = WornOutfit(outfit, alone.simulation, alone.pose)
    for name in others:
        worn = put_over(worn, name, meshes[name], FABRICS[OUTFIT[name]])
    return worn


def played(worn: WornOutfit, motion: str, frames: int, fps: float) -> dict[str, Any]:
    """Figures of so many frames of the motion, the first second of which leads into it, from where it was put on.

    Times are of a frame's wall time and of the processor's time of this process, in ms: medians, and 99th percentile.
    """
    dressed = worn.simulation
    assert dressed.body is not None
    assert dressed.scene.body is not None
    scene = replace(dressed.scene, x_start=dressed.cloth_positions().astype(np.float64))
    surface = dressed.body_positions().astype(np.float64)
    sim = build(scene, dressed.settings.by_budget(), str(dressed.device), dressed.body.pose, surface)
    body, garment = default_body(), scene.garment
    stance = led_into(worn.pose, demo_motion(motion, body))
    judge = FrameJudge(garment.faces, body.faces, sim.cloth_positions(), sim.body_positions())
    wall, own = [], []
    crossing: list[int] = []
    retries, gap, lag, stretch = 0, np.inf, 0.0, 0.0
    for k in range(1, frames + 1):
        clock, cpu = time.perf_counter(), time.process_time()
        report = sim.advance(stance(k / fps), k / fps)
        x = sim.cloth_positions()
        wall.append(1e3 * (time.perf_counter() - clock))
        own.append(1e3 * (time.process_time() - cpu))
        retries, gap, lag = retries + report.retries, min(gap, report.min_gap), max(lag, report.body_lag)
        stretch = max(stretch, float(principal_stretches(x, garment.faces, garment.uv_corners).max()))
        if not judge.judge(x, sim.body_positions()).clean:
            crossing.append(k)
    layers = worn.outfit.layers
    return {
        "motion": motion,
        "garments": [one.name for one in worn.outfit.worn],
        "vertices": [layer.vertices.stop - layer.vertices.start for layer in layers],
        "frames": frames,
        "judged": frames,
        "crossing": crossing,
        "ms": float(np.median(wall)),
        "ms_99": float(np.quantile(wall, 0.99)),
        "cpu_ms": float(np.median(own)),
        "void": retries,
        "gap": float(gap),
        "lag": lag,
        "stretch": stretch,
    }
