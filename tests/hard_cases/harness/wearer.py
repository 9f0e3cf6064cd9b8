"""The default body in a demo garment: dressed, posed joint by joint, and told that it is still worn."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from loops_on_limbs import LoopsOnLimbs
from scipy.spatial.transform import Rotation
from worn_garment import DEMO, demo_motion

from harness.changing_room import Places, hung
from harness.kit import ramp
from harness.scene import Ask, Run, Worn
from tryon_solver.body import quaternions
from tryon_solver.body.model import BodyModel, default_body
from tryon_solver.body.motion import blend_in
from tryon_solver.body.pose import Pose, world_from_joint
from tryon_solver.dressing.dress import dress
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.pattern import Pattern, parse_pattern
from tryon_solver.geometry.size import mesh_with_vertices
from tryon_solver.geometry.weld import weld
from tryon_solver.materials.fabric import FABRICS, Fabric
from tryon_solver.scene import WORN, Effect, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import Simulation, build

BODY = default_body()
REST = Pose.rest(BODY)
COMES_TO_REST = {"tshirt": 2.0, "skirt": 10.0}  # s after the body's stop, from when on nothing of it moves
Turns = dict[str, tuple[float, float, float]]
"""Joint name -> rotation vector in degrees, away from the rest pose, about the axes of the world at rest."""


def pattern(garment: str) -> Pattern:
    """One of the demo's."""
    return parse_pattern(json.loads((DEMO / "patterns" / f"{garment}.json").read_text()))


def scaled(panels: PanelMesh, across: float, down: float) -> PanelMesh:
    """The pieces so many times as wide and as long, their highest point where it was."""
    top = np.array([0.0, panels.placed[:, 1].max(), 0.0])
    sizes = np.array([across, down, across])
    return replace(panels, uv=panels.uv * [across, down], placed=top + sizes * (panels.placed - top))


def put_on(
    ask: Ask,
    garment: str,
    fabric: Fabric | str = "cotton_jersey",
    across: float = 1.0,
    down: float = 1.0,
    effects: tuple[Effect, ...] = WORN,
) -> Simulation:
    """The garment dressed on the default body, about as many vertices as asked for; raises as dress() does."""
    cloth = FABRICS[fabric] if isinstance(fabric, str) else fabric
    panels = scaled(mesh_with_vertices(pattern(garment), ask.vertices), across, down)

    def dressed() -> Places:
        sim = dress(panels, BODY, cloth, PRESETS["draft"], ask.device).simulation
        return sim.cloth_positions(), sim.body_positions()

    what = (garment, ask.vertices, cloth, across, down, ask.device)
    x, surface = (places.astype(np.float64) for places in hung(ask.dressed, what, dressed))
    sewn = weld(panels)
    pieces = Garment(sewn.vertex_of_corner, sewn.uv_corners, sewn.panel_of_face, sewn.vertex_count)
    return build(Scene(pieces, x, BODY, cloth, effects), ask.settings, ask.device, REST, surface)


def worn(sim: Simulation, stance: Callable[[float], Pose]) -> Worn:
    """The garment's loops as they are now, and the joints along the motion."""
    loops = boundary_loops(sim.scene.garment.faces)
    x = sim.cloth_positions()
    lowest = int(np.argmin([x[loop, 1].mean() for loop in loops]))
    limbs = LoopsOnLimbs(loops, BODY.joint_names, BODY.parents, BODY.rest_joints)
    return Worn(limbs, lambda t: world_from_joint(BODY, stance(t))[:, :3, 3], lowest)


def moving(sim: Simulation, stance: Callable[[float], Pose], stops: float, **more: object) -> Run:
    """A worn garment on a body that moves as told and stands still from `stops` s on."""
    return Run(sim, stance, sim.settings.largest_step, stops, worn=worn(sim, stance), **more)  # type: ignore[arg-type]


def posed(turns: Turns, root: tuple[float, float, float] = (0.0, 0.0, 0.0), body: BodyModel = BODY) -> Pose:
    """The rest pose with some joints turned and the root moved by `root` m."""
    rotations = np.tile(quaternions.IDENTITY, (body.joint_count, 1))
    for name, vector in turns.items():
        rotations[body.index_of[name]] = Rotation.from_rotvec(vector, degrees=True).as_quat()
    return Pose(body.rest_joints[0] + np.array(root), rotations)


def mirrored(turns: Turns) -> Turns:
    """Both sides: what is given for the left is done by the right as in a mirror."""
    return turns | {
        name.replace("left_", "right_"): (x, -y, -z) for name, (x, y, z) in turns.items() if name.startswith("left_")
    }


def into(goal: Pose, begin: float, end: float, start: Pose = REST) -> Callable[[float], Pose]:
    """From one pose to another between two times [s], softly; before and after it stands."""
    return lambda t: Pose.interpolate(start, goal, ramp(t, begin, end))


def there_and_back(goal: Pose, seconds: float) -> tuple[Callable[[float], Pose], float]:
    """Into a pose in a quarter of the time, held for a quarter, back in another; and when it stands again [s]."""
    quarter = 0.22 * seconds

    def stance(t: float) -> Pose:
        return Pose.interpolate(REST, goal, ramp(t, 0.0, quarter) - ramp(t, 2 * quarter, 3 * quarter))

    return stance, 3 * quarter


def walked(stops: float, name: str = "walk") -> tuple[Callable[[float], Pose], float]:
    """Led into a motion of the demo, which plays until `stops` s and stops dead there; and that time."""
    motion = demo_motion(name, BODY)
    lead = blend_in(REST, motion, min(0.8, 0.5 * stops))

    def stance(t: float) -> Pose:
        t = min(t, stops)
        return lead.sample(t) if t < lead.duration else motion.sample(t - lead.duration, loop=True)

    return stance, stops
