"""The demo's garments, dressed, and their windows of the demo's motions: what hard cases run and judge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from frame_judge import FrameJudge, FrameVerdict, enclosed_bone, principal_stretches, turns_around
from pinched_skin import PinchedSkin

from tryon_solver.body.bvh import parse_bvh
from tryon_solver.body.model import BodyModel, default_body
from tryon_solver.body.motion import Motion, blend_in
from tryon_solver.body.pose import Pose, skin, world_from_joint
from tryon_solver.body.retarget import retarget
from tryon_solver.dressing.dress import dress
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.materials.fabric import FABRICS, Fabric
from tryon_solver.scene import Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

DEMO = Path(__file__).resolve().parents[2] / "server" / "tryon_server" / "demo"


@dataclass(frozen=True)
class WornGarment:
    """A garment dressed on the default body in its rest pose."""

    garment: Garment
    body: BodyModel
    fabric: Fabric
    x: np.ndarray  # (N, 3) m, as dressed
    surface: np.ndarray  # (B, 3) m, the collision surface then
    loops: list[np.ndarray]  # vertex ids of every boundary loop
    bones: list[tuple[int, int]]  # the bone each encloses: joint at its far end, turns around it

    def bone_names(self) -> list[str]:
        """Name of the joint at the far end of each loop's bone."""
        return [self.body.joint_names[joint] for joint, _ in self.bones]


@dataclass(frozen=True)
class JudgedFrame:
    """A frame's verdict and figures; lengths in m."""

    verdict: FrameVerdict
    stretch: np.ndarray  # (F,) larger principal stretch of each triangle
    lag_p95: float  # skin to surface at the frame's own pose time, unpinched vertices
    lag_max: float
    pinched_lag_max: float
    pinched_area: float  # m^2
    still_worn: bool  # every loop runs around its bone as it did when dressed
    hem_offset: np.ndarray  # (3,) centre of the lowest loop relative to the pelvis, in the pelvis's own frame
    retries: int


def dressed_demo(name: str, edge_length: float, fabric: str = "cotton_jersey", preset: str = "draft") -> WornGarment:
    """Dress a demo pattern on the default body."""
    body = default_body()
    panels = mesh_pattern(load_pattern(DEMO / "patterns" / f"{name}.json"), edge_length)
    dressed = dress(panels, body, FABRICS[fabric], PRESETS[preset])
    sim = dressed.simulation
    garment, x = sim.scene.garment, sim.cloth_positions().astype(np.float64)
    loops = boundary_loops(garment.faces)
    joints = world_from_joint(body, dressed.pose)[:, :3, 3]
    bones = [enclosed_bone(x[loop], joints, body.parents) for loop in loops]
    return WornGarment(garment, body, FABRICS[fabric], x, sim.body_positions().astype(np.float64), loops, bones)


def demo_motion(name: str, body: BodyModel) -> Motion:
    """A motion of the demo, retargeted. They are part of the repository: scripts/make_demo_motions.py writes them."""
    path = DEMO / "motions" / f"{name}.bvh"
    if not path.exists():
        raise FileNotFoundError(f"{path} is missing: write it with python scripts/make_demo_motions.py")
    return retarget(parse_bvh(path.read_text()), body)


def led_into(pose: Pose, motion: Motion, seconds: float = 1.0) -> Callable[[float], Pose]:
    """The stance at a time [s]: for so many seconds from `pose` into where the motion begins, then the motion."""
    into = blend_in(pose, motion, seconds)
    return lambda time: into.sample(time) if time < seconds else motion.sample(time - seconds)


def run_window(
    worn: WornGarment, motion: str, start: float, frames: int, fps: float, preset: str, lead_in: float = 1.0
) -> list[JudgedFrame]:
    """Lead the dressed body into `motion` at `start` s, then judge `frames` frames of it, `fps` a second."""
    body, garment, settings = worn.body, worn.garment, PRESETS[preset]
    whole = demo_motion(motion, body)
    first = round(start / whole.dt)
    clip = Motion(whole.roots[first:], whole.rotations[first:], whole.dt, motion)
    into = blend_in(Pose.rest(body), clip, lead_in)
    sim = build(Scene(garment, worn.x, body, worn.fabric), settings, "cpu", Pose.rest(body), worn.surface)
    for k in range(1, int(lead_in * fps) + 1):
        sim.advance(into.sample(k / fps), k / fps)
    sizes = sim.contact.sizes
    pinch = PinchedSkin(body.rest_vertices, body.faces, PinchedSkin.reach(sizes.xi_body, sizes.d_hat))
    judge = FrameJudge(garment.faces, body.faces, worn.x, worn.surface)
    judged = []
    for k in range(1, frames + 1):
        pose = clip.sample(k / fps)
        report = sim.advance(pose, lead_in + k / fps)
        cloth, surface = sim.cloth_positions(), sim.body_positions()
        judged.append(judged_frame(worn, judge, pinch, pose, cloth, surface, report.retries))
    return judged


def judged_frame(
    worn: WornGarment,
    judge: FrameJudge,
    pinch: PinchedSkin,
    pose: Pose,
    cloth: np.ndarray,
    surface: np.ndarray,
    retries: int = 0,
) -> JudgedFrame:
    """Everything that is asked of a frame, from its positions and its pose alone."""
    body = worn.body
    tracked = skin(body, pose)
    lag = np.linalg.norm(surface - tracked, axis=1)
    # telling pinched skin takes longer than all the rest: where no vertex lags, none has to be excused
    pinched = pinch.pinched(tracked) if lag.max() > 3e-3 else np.zeros(len(lag), bool)
    world = world_from_joint(body, pose)
    joints = world[:, :3, 3]
    turns = [
        turns_around(cloth[loop].astype(np.float64), joints[body.parents[joint]], joints[joint])
        for loop, (joint, _) in zip(worn.loops, worn.bones)
    ]
    lowest = min(worn.loops, key=lambda loop: worn.x[loop, 1].mean())
    hem = cloth[lowest].mean(0) - joints[0]
    return JudgedFrame(
        verdict=judge.judge(cloth, surface),
        stretch=principal_stretches(cloth, worn.garment.faces, worn.garment.uv_corners)[:, 1],
        lag_p95=float(np.percentile(lag[~pinched], 95)),
        lag_max=float(lag[~pinched].max()),
        pinched_lag_max=float(lag[pinched].max(initial=0.0)),
        pinched_area=pinch.area(tracked, pinched),
        still_worn=turns == [turn for _, turn in worn.bones],
        hem_offset=world[0, :3, :3].T @ hem,
        retries=retries,
    )
