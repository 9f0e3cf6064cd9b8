"""What is stepped in both precisions: garments in motion, near the origin and far from it, scenes with contact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from contact_scenes import DT, SCENES
from harness.scene import Ask
from scenes import named
from small_scenes import STILL
from worn_garment import WornGarment, demo_motion, dressed_demo

from tryon_solver.body.motion import Motion, blend_in
from tryon_solver.body.pose import Pose
from tryon_solver.scene import Scene
from tryon_solver.settings import PRESETS, Settings

EDGE = 0.0285  # m, for about 1,000 vertices of the T-shirt
LEAD_IN = 1.0  # s from the rest pose into the motion, before anything is compared
SECONDS = 1.0  # of the motion
WINDOWS = {"walk": 0.5, "squat": 0.5, "jumping_jack": 0.3}  # s, where each asks most
LENGTHS = {"square": 60, "damped square": 60, "strip below mu": 40, "strip above mu": 40, "sleeve": 50, "sheets": 40}
LAYERS = 60  # steps of the stack: it falls, and lands


@dataclass(frozen=True)
class Case:
    """Steps `first` to `last` of a run, each `dt` s, are taken in both precisions; the run itself is in float32."""

    name: str
    scene: Scene
    settings: Settings
    stance_at: Callable[[int], Any]  # the body's at the end of a step; at 0 the one to start in
    first: int
    last: int
    dt: float
    surface: np.ndarray | None = None


@cache
def worn_tshirt() -> WornGarment:
    """The demo's, of 999 vertices."""
    return dressed_demo("tshirt", EDGE)


def tshirt(motion: str, preset: str, away: float = 0.0) -> Case:
    """In a demo's motion, `away` m from the origin along x."""
    worn, settings = worn_tshirt(), PRESETS[preset]
    shift, dt = np.array([away, 0.0, 0.0]), settings.largest_step
    whole = demo_motion(motion, worn.body)
    begin = round(WINDOWS[motion] / whole.dt)
    clip = Motion(whole.roots[begin:] + shift, whole.rotations[begin:], whole.dt, motion)
    rest = Pose.rest(worn.body)
    start = Pose(rest.root + shift, rest.rotations)
    into = blend_in(start, clip, LEAD_IN)

    def stance_at(step: int) -> Pose:
        t = step * dt
        return into.sample(t) if t < LEAD_IN else clip.sample(t - LEAD_IN)

    place = f", {away:g} m off" if away else ""
    scene = Scene(worn.garment, worn.x + shift, worn.body, worn.fabric)
    first, last = round(LEAD_IN / dt) + 1, round((LEAD_IN + SECONDS) / dt)
    name = f"T-shirt {motion.replace('_', ' ')}, {preset}{place}"
    return Case(name, scene, settings, stance_at, first, last, dt, worn.surface + shift)


def of_reference(key: str) -> Case:
    """A scene of `python tests/reference`, at preset live."""
    case = SCENES[key]()
    return Case(case.name, case.scene, PRESETS["live"], case.pose_at, 1, LENGTHS[key], DT)


def ten_layers() -> Case:
    """Ten sheets that fall onto a table together: a hard case."""
    run = named("ten_layers_dropped").set_up(Ask(1000))
    return Case("ten layers dropped", run.sim.scene, run.sim.settings, lambda _: STILL, 1, LAYERS, run.dt)


CASES: dict[str, Callable[[], Case]] = {
    **{key.replace(" ", "_"): partial(of_reference, key) for key in SCENES},
    **{f"{motion}_{preset}": partial(tshirt, motion, preset) for motion in WINDOWS for preset in ("live", "draft")},
    "walk_4m": partial(tshirt, "walk", "live", 4.0),
    "walk_8m": partial(tshirt, "walk", "live", 8.0),
    "jumping_jack_8m": partial(tshirt, "jumping_jack", "live", 8.0),
    "ten_layers": ten_layers,
}
