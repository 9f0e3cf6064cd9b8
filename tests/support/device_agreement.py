"""One step from equal states on the processor and on another device: how far apart it ends.

    python tests/support/device_agreement.py cuda:0

Contact, friction, strain limit, drag and fabric damping act in every scene; bodies stand, bend at a joint, or come as
a sequence of meshes. numpy, scipy, warp and trimesh are all that is needed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

if __name__ == "__main__":
    HERE = Path(__file__).resolve().parent
    sys.path[:0] = [str(HERE), str(HERE.parents[1] / "solver")]

from contact_scenes import DT, ContactScene, sleeve_on_limb, square_on_sphere, two_sheets
from small_scenes import fabric

from tryon_solver.body.mesh_sequence import make_sequence
from tryon_solver.body.pose import skin
from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import PRESETS, Settings
from tryon_solver.simulation import Simulation, build

CONVERGED = replace(PRESETS["live"], contact_passes=20)
FRAMES = 12  # of the sequence of meshes, one a step


@dataclass(frozen=True)
class Start:
    """A scene, the state (x, v) of cloth and surface from which a step is taken, and the body before and after it."""

    scene: Scene
    x: np.ndarray  # (A, 3) float32 m
    v: np.ndarray  # (N, 3) float32 m/s
    stances: tuple[Any, Any]

    def ready(self, settings: Settings, device: str) -> Simulation:
        """A simulation in this state."""
        sim = build(self.scene, settings, device, self.stances[0], tangled=True)
        sim.state.x.assign(self.x)
        sim.state.v.assign(self.v)
        return sim

    def step(self, settings: Settings, device: str) -> np.ndarray:
        """(A, 3) float64 m: cloth and surface after the step."""
        sim = self.ready(settings, device)
        report = sim.advance(self.stances[1], DT)
        assert report.retries == 0
        return np.vstack([sim.cloth_positions(), sim.body_positions()]).astype(np.float64)


def led_to(case: ContactScene, steps: int) -> Start:
    """The state that a scene comes to in so many steps on the processor."""
    sim = build(case.scene, PRESETS["live"], "cpu", case.pose_at(0))
    for k in range(1, steps + 1):
        sim.advance(case.pose_at(k), k * DT)
    assert sim.pairs.size > 30, "nothing touches"
    stances = case.pose_at(steps), case.pose_at(steps + 1)
    return Start(case.scene, sim.state.x.numpy(), sim.state.v.numpy(), stances)


def with_all_effects(case: ContactScene) -> ContactScene:
    """The scene with fabric damping, too."""
    return replace(case, scene=replace(case.scene, effects=WORN))


def square() -> Start:
    """Cloth that has come upon a ball."""
    return led_to(with_all_effects(square_on_sphere()), 8)


def pulled_square() -> Start:
    """The same, torn apart sideways so fast that its limit of 2 % is passed in the step."""
    start = square()
    cloth = fabric(**{**start.scene.fabric.__dict__, "strain_limit": 1.02})
    pull = 3.0 * start.x[: len(start.v)] * np.array([1, 0, 1])
    return replace(start, scene=replace(start.scene, fabric=cloth), v=(start.v + pull).astype(np.float32))


def sleeve() -> Start:
    """A sewn tube on a rod that bends at its joint."""
    return led_to(with_all_effects(sleeve_on_limb()), 10)


def sheets() -> Start:
    """Cloth on cloth on a table."""
    return led_to(with_all_effects(two_sheets()), 8)


def sleeve_on_meshes() -> Start:
    """The sleeve on the same rod, which comes as a sequence of meshes, a frame each second step."""
    case = with_all_effects(sleeve_on_limb())
    frames = np.stack([skin(case.scene.body, case.pose_at(2 * k)) for k in range(FRAMES)])
    sequence = make_sequence(frames, case.scene.body.faces, 2 * DT)
    moving = ContactScene(
        "sleeve on meshes", replace(case.scene, body=sequence), lambda k: sequence.sample(k * DT)
    )
    return led_to(moving, 10)


STARTS: dict[str, Callable[[], Start]] = {
    "square": square,
    "pulled square": pulled_square,
    "sleeve": sleeve,
    "sheets": sheets,
    "sleeve on meshes": sleeve_on_meshes,
}


def apart(start: Start, settings: Settings, device: str) -> float:
    """Largest distance [m] between any vertex after the step on that device and on the processor."""
    return float(np.linalg.norm(start.step(settings, device) - start.step(settings, "cpu"), axis=1).max())


def main() -> None:
    """Print the distances."""
    for name, begin in STARTS.items():
        start = begin()
        for what, settings in (("converged", CONVERGED), ("live", PRESETS["live"])):
            print(f"{name}, {what}: {1e3 * apart(start, settings, sys.argv[1]):.4f} mm apart", flush=True)


if __name__ == "__main__":
    main()
