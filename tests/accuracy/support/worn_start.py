"""Where a case begins: the garment worn, and led into its motion. Kept on disk.

Any free state of worn cloth will do to begin with. Kept under a hash of what was asked for, and not of the solver's
source, it is the same for all who measure, whatever has changed in the solver since, and so are the reference's steps.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from accuracy_case import AccuracyCase
from accuracy_patterns import pattern_of, specification
from contact_scenes import ContactScene

from tryon_solver import PRESETS, dress
from tryon_solver.baselines.newton_ipc.cache import content_hash
from tryon_solver.body.bvh import parse_bvh
from tryon_solver.body.model import BodyModel, default_body
from tryon_solver.body.motion import blend_in
from tryon_solver.body.pose import Pose
from tryon_solver.body.retarget import retarget
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.size import mesh_with_vertices
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.scene import WORN, Attached, Scene
from tryon_solver.simulation import Simulation

MOTIONS = Path(__file__).resolve().parents[3] / "server" / "tryon_server" / "demo" / "motions"
KEPT_IN = Path(__file__).resolve().parents[3] / ".cache" / "tryon" / "accuracy"
LEAD = 1.0  # s, from the pose it was dressed in into the motion
BEGIN = 1.6  # s after that began, where a case sets out: the motion itself


@dataclass(frozen=True)
class Worn:
    """A garment in motion: the scene, poses by number, and where a case begins, (A, 3) m and (N, 3) m/s."""

    scene: ContactScene
    x: np.ndarray
    v: np.ndarray


def worn_at_start(case: AccuracyCase, device: str = "cpu", kept_in: Path = KEPT_IN) -> Worn:
    """Looked up, or dressed on the device and led into the motion at the preset `live` in the case's steps."""
    body, motion = default_body(), (MOTIONS / f"{case.motion}.bvh").read_bytes()
    asked = (case.size, case.fabric, case.vertices, round(1 / case.dt), json.dumps(specification(case.garment)))
    path = kept_in / f"{content_hash(asked, motion, body.rest_vertices, body.faces)}.npz"
    if not path.exists():
        keep(path, *put_on(case, body, device))
    with np.load(path) as kept:
        return restored(case, body, dict(kept))


def put_on(case: AccuracyCase, body: BodyModel, device: str) -> tuple[Simulation, Pose]:
    """The garment where the case begins, and the pose it was dressed in."""
    panels = mesh_with_vertices(pattern_of(case.garment), case.vertices, case.size)
    dressed = dress(panels, body, FABRICS[case.fabric], PRESETS["live"], device)
    sim, pose_at = dressed.simulation, poses(case, body, dressed.pose)
    begun, steps = sim.state.time, round(BEGIN / case.dt)
    for k in range(1 - steps, 1):
        sim.advance(pose_at(k), begun + (steps + k) * case.dt)
    return sim, dressed.pose


def poses(case: AccuracyCase, body: BodyModel, dressed_in: Pose) -> Callable[[int], Pose]:
    """The body's pose at the end of step k of the case; at 0 the one to begin in, before it the lead."""
    motion = retarget(parse_bvh((MOTIONS / f"{case.motion}.bvh").read_text()), body)
    lead, steps = blend_in(dressed_in, motion, LEAD), round(BEGIN / case.dt)

    def pose_at(number: int) -> Pose:
        t = (steps + number) * case.dt
        return lead.sample(t) if t < lead.duration else motion.sample(t - lead.duration, loop=True)

    return pose_at


def keep(path: Path, sim: Simulation, dressed_in: Pose) -> None:
    """Write the start down; whoever reads at the same time sees it whole or not at all."""
    garment = sim.scene.garment
    assert garment.group is None
    assert garment.spline_corners is None
    kept = {
        "faces": garment.faces,
        "uv_corners": garment.uv_corners,
        "panel_of_face": garment.panel_of_face,
        "x": np.vstack([sim.cloth_positions(), sim.body_positions()]),
        "v": sim.state.v.numpy(),
        "root": dressed_in.root,
        "rotations": dressed_in.rotations,
    }
    for effect in sim.scene.effects:
        if isinstance(effect, Attached):
            kept |= {f"attached_{name}": value for name, value in vars(effect).items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(f".{os.getpid()}.npz")
    np.savez_compressed(unfinished, **kept)
    unfinished.replace(path)


def restored(case: AccuracyCase, body: BodyModel, kept: dict[str, np.ndarray]) -> Worn:
    """What was written down."""
    x, v = kept["x"].astype(np.float64), kept["v"].astype(np.float64)
    garment = Garment(kept["faces"], kept["uv_corners"], kept["panel_of_face"], len(v))
    effects = WORN
    if "attached_vertices" in kept:
        onto = (kept["attached_vertices"], kept["attached_onto"], kept["attached_weights"])
        effects = (*effects, Attached(*onto, float(kept["attached_stiffness"])))
    scene = Scene(garment, x[: len(v)], body, FABRICS[case.fabric], effects)
    dressed_in = Pose(kept["root"], kept["rotations"])
    return Worn(ContactScene(case.scene, scene, poses(case, body, dressed_in)), x, v)
