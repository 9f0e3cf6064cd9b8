"""Run one case of a garment that is a mesh on a body that is a moving mesh, both as `tryon simulate` takes them.

The files are those of scripts/make_strangers.py, which knows what bones moved the body it wrote.
"""

from __future__ import annotations

import importlib.util
import math
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import limits
import numpy as np
from case import Case, stem
from frame_figures import Bones, FrameFigures, Stance, StateMeter
from pinched_skin import PinchedSkin
from verdict import broken_by_frames, broken_by_share, figures_of_frames, hem_travel, late

from tryon_server.runtime.order import DrapeOrder
from tryon_server.runtime.production import build_drape
from tryon_solver.body.mesh_sequence import MeshSequence
from tryon_solver.body.model import default_body
from tryon_solver.body.motion import Motion
from tryon_solver.body.pose import world_from_joint

SCRIPT = Path(__file__).resolve().parents[3] / "scripts" / "make_strangers.py"
GARMENTS = ("skirt.obj", "top.glb")
BODIES = ("walk", "squat.glb")
SECONDS = 3.0  # s of each body's motion, the first of them on the way into it
ROUNDING = 1e-9  # s

Tell = Callable[[str], None]


def script() -> ModuleType:
    """scripts/make_strangers.py."""
    specification = importlib.util.spec_from_file_location("make_strangers", SCRIPT)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def write_strangers(folder: Path) -> None:
    """Two garments and two moving bodies."""
    script().write_all(folder, SECONDS)


def run_mesh_case(case: Case, tell: Tell) -> dict[str, Any]:
    """The case's figures and the limits it broke, ready for JSON: the body's frames from first to last."""
    order = DrapeOrder(Path(case.garment), case.fabric, case.preset, case.device, body=Path(case.motion))
    begun = time.perf_counter()
    drape = build_drape(order, lambda _what, _share: None)
    dressing = time.perf_counter() - begun
    for note in drape.notes:
        tell(note)
    sim, sequence = drape.simulation, drape.own_motion
    assert sequence is not None
    motion = script().motion_from_rest(default_body(), stem(case.motion), SECONDS)
    garment = sim.scene.garment
    bones = Bones(default_body().joint_names, default_body().parents, default_body().rest_joints)
    reach = PinchedSkin.reach(sim.contact.sizes.xi_body, sim.contact.sizes.d_hat)
    meter = StateMeter(
        garment.faces,
        garment.uv_corners,
        sequence.rest_vertices,
        sequence.faces,
        bones,
        drape.cloth_positions().astype(np.float64),
        stance_at(sequence, motion, 0.0),
        reach,
    )
    frames = math.floor(sequence.duration * case.fps + ROUNDING)
    figures: list[FrameFigures] = []
    retries, milliseconds = 0, []
    for k in range(frames + 1):
        t = k / case.fps
        if k:
            begun = time.perf_counter()
            retries += drape.advance(sequence.sample(t), t).retries
            milliseconds.append(1e3 * (time.perf_counter() - begun))
        cloth, surface = (
            positions.astype(np.float64) + drape.origin
            for positions in (drape.cloth_positions(), drape.body_positions())
        )
        asked = k % case.every == 0 or k == frames
        figures.append(meter.measure(cloth, surface, stance_at(sequence, motion, t), asked))
    limit = sim.scene.fabric.strain_limit
    behind, allowed = late(figures, frames), limits.late_share(stem(case.motion))
    return {
        "case": case.plain(),
        "failure": "",
        "dressing_s": dressing,
        "cloth_vertices": sim.cloth_count,
        "notes": list(drape.notes),
        "strain_limit": limit,
        **figures_of_frames(figures),
        **hem_travel(figures),
        **behind,
        "late_allowed": allowed,
        "void_steps": retries,
        "simulated_over_wall": 1e3 * len(milliseconds) / case.fps / sum(milliseconds),
        "ms_a_frame": float(np.median(milliseconds)),
        "broken": [
            b.plain()
            for b in (
                *broken_by_frames(figures, limit, allowed),
                *broken_by_share(behind["late_share"], allowed),
            )
        ],
    }


def stance_at(sequence: MeshSequence, motion: Motion, t: float) -> Stance:
    """The body t s after its first frame: its own surface, and the bones that the script moved it with."""
    world = world_from_joint(default_body(), motion.sample(t))
    return Stance(sequence.surface(sequence.sample(t)), world[0, :3, :3], world[:, :3, 3])
