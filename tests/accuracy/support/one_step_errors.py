"""The error of single steps: each from a state of the float64 reference, held to where that is after the same step."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from accuracy_case import AccuracyCase
from against_reference import KEPT_IN, ReferenceStep, rms, simulation_at
from contact_scenes import ContactScene

from tryon_solver import PRESETS, dress
from tryon_solver.baselines.newton_ipc import Motion, Reference
from tryon_solver.body.bvh import parse_bvh
from tryon_solver.body.model import default_body
from tryon_solver.body.motion import blend_in
from tryon_solver.body.pose import Pose
from tryon_solver.body.retarget import retarget
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.size import mesh_with_vertices
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import Settings
from tryon_solver.simulation import Simulation

DEMO = Path(__file__).resolve().parents[3] / "server" / "tryon_server" / "demo"
LEAD = 1.0  # s, from the pose it was dressed in into the motion
BEGIN = 1.6  # s after that began, where the reference sets out: the motion itself
FIRST = 3  # steps of the reference that are not counted: its contacts begin without having given


@dataclass(frozen=True)
class Worn:
    """A garment in motion: the scene, poses by number, and where the reference begins, (A, 3) m and (N, 3) m/s."""

    scene: ContactScene
    x: np.ndarray
    v: np.ndarray


def put_on(case: AccuracyCase) -> Worn:
    """Dressed, and led into the motion at the preset `live` in the case's steps."""
    body = default_body()
    panels = mesh_with_vertices(load_pattern(DEMO / "patterns" / f"{case.garment}.json"), case.vertices, case.size)
    dressed = dress(panels, body, FABRICS[case.fabric], PRESETS["live"], "cpu")
    motion = retarget(parse_bvh((DEMO / "motions" / f"{case.motion}.bvh").read_text()), body)
    lead, sim = blend_in(dressed.pose, motion, LEAD), dressed.simulation
    begun, steps = sim.state.time, round(BEGIN / case.dt)

    def pose_at(number: int) -> Pose:
        t = (steps + number) * case.dt
        return lead.sample(t) if t < lead.duration else motion.sample(t - lead.duration, loop=True)

    for k in range(1 - steps, 1):
        sim.advance(pose_at(k), begun + (steps + k) * case.dt)
    x = np.vstack([sim.cloth_positions(), sim.body_positions()]).astype(np.float64)
    scene = replace(sim.scene, x_start=sim.cloth_positions().astype(np.float64))
    return Worn(ContactScene(case.scene, scene, pose_at), x, sim.state.v.numpy().astype(np.float64))


def reference_steps(worn: Worn, case: AccuracyCase) -> Iterator[ReferenceStep]:
    """The reference's steps that count; kept on disk."""
    ref, pose_at = Reference(worn.scene.scene, kept_in=KEPT_IN), worn.scene.pose_at
    motion = Motion(worn.x, worn.v, pose_at(0))
    for number in range(1, FIRST + case.states + 1):
        after = ref.step(motion, pose_at(number), case.dt)
        assert ref.solved is not None
        if number > FIRST:
            yield ReferenceStep(number, motion, after, ref.solved.last_move)
        motion = after


def errors(
    case: AccuracyCase, settings: Mapping[str, Settings], tell: Callable[[str], None]
) -> dict[str, list[dict[str, Any]]]:
    """Of each settings, a row for each state: the step's `error` (RMS over the cloth), its `largest` and the `estimate`
    of it in mm, the `ms` it took, Newton iterations, and whether it was void. Raises NotConvergedError."""
    worn = put_on(case)
    rows: dict[str, list[dict[str, Any]]] = {name: [] for name in settings}
    for step in reference_steps(worn, case):
        for name, its in settings.items():
            rows[name].append(one_step(worn.scene, step, replace(its, largest_step=case.dt), case.dt))
        said = (f"{name} {its[-1]['error']:.3f} mm" for name, its in rows.items() if name in PRESETS)
        tell(f"state {step.number - FIRST}: {', '.join(said)}")
    return rows


def one_step(scene: ContactScene, step: ReferenceStep, settings: Settings, dt: float) -> dict[str, Any]:
    """A row."""
    sim: Simulation = simulation_at(scene, step.before, settings)
    report = sim.advance(scene.pose_at(step.number), dt)
    n = sim.cloth_count
    off = sim.cloth_positions().astype(np.float64) - step.after.x[:n]
    return {
        "error": 1e3 * rms(off),
        "largest": 1e3 * float(np.linalg.norm(off, axis=1).max()),
        "estimate": 1e3 * report.error,
        "ms": sum(report.times_ms.values()),
        "newton": report.newton_iterations,
        "void": report.retries > 0,
    }
