"""What is measured: a demo garment worn in a motion of the demo that repeats without end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tryon_solver import PRESETS, dress
from tryon_solver.body.bvh import parse_bvh
from tryon_solver.body.model import default_body
from tryon_solver.body.motion import blend_in
from tryon_solver.body.pose import Pose
from tryon_solver.body.retarget import retarget
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.size import mesh_with_vertices
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.simulation import Simulation

DEMO = Path(__file__).resolve().parents[2] / "server" / "tryon_server" / "demo"
JERSEY = "cotton_jersey"
LEAD = 1.0  # s, from the pose it was dressed in into the motion


@dataclass(frozen=True)
class Case:
    """A garment of the demo by name, a motion of the demo by name or of a BVH file, about how many vertices, preset and
    device, frames a second, how many such sessions at once, a process each, of which fabric, down to which error [mm]
    and in which time [ms]; None: by the preset's budget, and in what it takes."""

    garment: str
    motion: str
    vertices: int
    preset: str
    device: str
    fps: float
    sessions: int = 1
    fabric: str = JERSEY
    accuracy_mm: float | None = None
    deadline_ms: float | None = None

    @property
    def name(self) -> str:
        """For file names and tables."""
        alone = f"{self.garment}-{Path(self.motion).stem}-{self.vertices}-{self.preset}-{self.device.replace(':', '')}"
        alone += f"-{self.fabric}" * (self.fabric != JERSEY)
        alone += "" if self.accuracy_mm is None else f"-to-{self.accuracy_mm:g}mm"
        alone += "" if self.deadline_ms is None else f"-in-{self.deadline_ms:g}ms"
        return alone if self.sessions == 1 else f"{alone}-x{self.sessions}"

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return dict(vars(self))


def put_on(case: Case) -> tuple[Simulation, Callable[[float], Pose]]:
    """The garment, dressed and settled, and the body's pose so long after that [s]: led in, then round and round."""
    body = default_body()
    panels = mesh_with_vertices(load_pattern(DEMO / "patterns" / f"{case.garment}.json"), case.vertices)
    dressed = dress(panels, body, FABRICS[case.fabric], PRESETS[case.preset], case.device)
    demo = DEMO / "motions" / f"{case.motion}.bvh"
    motion = retarget(parse_bvh((demo if demo.exists() else Path(case.motion)).read_text()), body)
    lead = blend_in(dressed.pose, motion, LEAD)

    def pose(t: float) -> Pose:
        return lead.sample(t) if t < lead.duration else motion.sample(t - lead.duration, loop=True)

    dressed.simulation.buy(thousandth(case.accuracy_mm), thousandth(case.deadline_ms))
    return dressed.simulation, pose


def thousandth(value: float | None) -> float | None:
    """mm in m, or ms in s."""
    return None if value is None else 1e-3 * value
