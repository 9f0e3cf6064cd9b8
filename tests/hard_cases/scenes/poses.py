"""Bodies that pinch cloth, cross themselves, or move faster than people mostly do."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from harness.kit import ramp, strip
from harness.scene import Ask, HardScene, Run
from harness.wearer import (
    BODY,
    COMES_TO_REST,
    REST,
    Turns,
    into,
    mirrored,
    moving,
    posed,
    put_on,
    there_and_back,
    walked,
)
from scipy.spatial.transform import Rotation
from worn_garment import demo_motion

from tryon_solver.body.motion import blend_in
from tryon_solver.body.pose import Pose
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.scene import LIVE, WORN, Pins, Scene
from tryon_solver.simulation import build

ARMS_IN = mirrored({"left_upper_arm": (0, 0, -62)})
ARMS_AGAINST = mirrored({"left_upper_arm": (0, 0, -51)})  # as deep as a pinched surface may stay behind
SKIRT_MOVES, SKIRT_SECONDS = 0.25, 14.5  # share of so long a time for which a skirt's wearer moves, to see it at rest
CLASPED = mirrored({"left_upper_arm": (-11, -6, -41), "left_forearm": (26, -66, 8)})
LEGS_CROSSED = mirrored({"left_thigh": (0, 0, -16)})
ARMS_CROSSED = mirrored({"left_clavicle": (0, -30, 0), "left_upper_arm": (-60, -95, -20)})


def into_pose(garment: str, turns: Turns, share: float = 1.0) -> Callable[[Ask], Run]:
    """Into the pose, held, and back, and a while at rest, in a share of the time."""

    def set_up(ask: Ask) -> Run:
        stance, stops = there_and_back(posed(turns), share * ask.seconds)
        return moving(put_on(ask, garment), stance, stops, pinches=True, quiet=stops + COMES_TO_REST[garment])

    return set_up


def held_in_pose(turns: Turns) -> Callable[[Ask], Run]:
    """A T-shirt on a body that goes into the pose and stays there: what is pinched has to come to rest pinched."""

    def set_up(ask: Ask) -> Run:
        stops = 0.3 * ask.seconds
        stance = into(posed(turns), 0.0, stops)
        quiet = stops + COMES_TO_REST["tshirt"]
        return moving(put_on(ask, "tshirt"), stance, stops, squeezed=True, quiet=quiet)

    return set_up


def between_legs(ask: Ask) -> Run:
    """Cloth held by its upper edge hangs between the thighs, which go through each other, and back."""
    garment, x, columns, _ = strip(ask.vertices, 0.21, 0.36)
    x = np.column_stack([np.zeros(len(x)), x[:, 1] - x[:, 1].max() + 0.72, x[:, 0] - x[:, 0].mean() + 0.045])
    held = np.flatnonzero(x[:, 1] > 0.72 - 1e-6).astype(np.int32)
    assert len(held) == columns
    effects = (*WORN, Pins(held, 50.0))
    stance, stops = there_and_back(posed(LEGS_CROSSED), ask.seconds)
    sim = build(Scene(garment, x, BODY, FABRICS["cotton_jersey"], effects), ask.settings, ask.device, REST)
    return Run(sim, stance, sim.settings.largest_step, stops, parts=True, pinches=True)


def in_motion(garment: str, name: str, share: float, **more: object) -> Callable[[Ask], Run]:
    """The garment in a motion of the demo for a share of the time."""

    def set_up(ask: Ask) -> Run:
        stance, stops = walked(share * ask.seconds, name)
        return moving(put_on(ask, garment), stance, stops, quiet=stops + COMES_TO_REST[garment], **more)

    return set_up


def root_path(garment: str, path: Callable[[float, float], Pose], share: float = 0.6) -> Callable[[Ask], Run]:
    """The body as a whole along path(t, end), which ends after a share of the time."""

    def set_up(ask: Ask) -> Run:
        stops = share * ask.seconds
        quiet = stops + COMES_TO_REST[garment]
        return moving(put_on(ask, garment), lambda t: path(min(t, stops), stops), stops, quiet=quiet)

    return set_up


def turned_root(angle: float, axis: int, shift: np.ndarray) -> Pose:
    """The rest pose turned about its root by an angle [rad] and moved."""
    rotations = REST.rotations.copy()
    rotations[0] = Rotation.from_rotvec(angle * np.eye(3)[axis]).as_quat()
    return Pose(REST.root + shift, rotations)


def jumping(t: float, end: float) -> Pose:
    """Jumps of 2.4 m/s, half a second in the air each, that start and land within a frame."""
    air = 2 * 2.4 / 9.81
    count = max(1, int(end / (air + 0.2)))
    phase = t % (air + 0.2) if t < count * (air + 0.2) else air
    height = max(0.0, 2.4 * phase - 0.5 * 9.81 * phase**2) if phase < air else 0.0
    return turned_root(0.0, 1, np.array([0, height, 0]))


def cartwheel(t: float, end: float) -> Pose:
    """Once round about the axis that points forwards, and 2.4 m to the side."""
    share = ramp(t, 0.1 * end, min(end, 0.1 * end + 1.4))
    return turned_root(-2 * np.pi * share, 2, np.array([2.4 * share, 0, 0]))


def spinning(t: float, end: float) -> Pose:
    """Two turns a second, reached in half a second, stopped in a fifth of one."""
    begin, brake = 0.5, 0.2
    speed = 4 * np.pi
    full = end - begin - brake
    angle = speed * (0.5 * min(t, begin) ** 2 / begin + np.clip(t - begin, 0, full))
    rest = np.clip(t - begin - full, 0, brake)
    return turned_root(angle + speed * (rest - 0.5 * rest**2 / brake), 1, np.zeros(3))


def swung(t: float, end: float) -> Pose:
    """The left arm to and fro about the shoulder, the hand at 10 m/s where it is fastest."""
    hand, shoulder = (BODY.rest_joints[BODY.index_of[name]] for name in ("left_hand", "left_upper_arm"))
    reach = float(np.linalg.norm((hand - shoulder)[1:]))  # from the axis, the world's x
    amplitude = np.radians(55)
    rate = 10.0 / reach / amplitude
    cycles = max(1, int(end * rate / (2 * np.pi)))
    angle = amplitude * np.sin(rate * t) if t < cycles * 2 * np.pi / rate else 0.0
    return posed({"left_upper_arm": (-np.degrees(angle), 0, 0)})


def stood_still(garment: str) -> Callable[[Ask], Run]:
    """A second and a half of walking, then the body stands."""
    return lambda ask: moving(put_on(ask, garment), *walked(1.5), quiet=1.5 + COMES_TO_REST[garment])


def woken(ask: Ask) -> Run:
    """Walks, stands until the garment sleeps, and sets off again after three quarters of the time."""
    there, stops = walked(1.0)
    again = 0.75 * ask.seconds
    onwards = blend_in(there(stops), demo_motion("walk", BODY), 0.8)

    def stance(t: float) -> Pose:
        return there(t) if t < again else onwards.sample(min(t - again, onwards.duration))

    return moving(put_on(ask, "tshirt", effects=LIVE), stance, ask.seconds, rests=False, wakes=True)


SCENES = (
    HardScene(
        "arms_pressed_in",
        "a T-shirt between arms and trunk that cross",
        into_pose("tshirt", ARMS_IN),
        seconds=8.0,
    ),
    HardScene(
        "hands_clasped",
        "hands clasped and forearms pressed together before the belly",
        into_pose("tshirt", CLASPED),
        seconds=8.0,
    ),
    HardScene("arms_held_in", "the arms stay in the trunk, the T-shirt between them", held_in_pose(ARMS_AGAINST)),
    HardScene("hands_held_clasped", "hands and forearms stay pressed together", held_in_pose(CLASPED)),
    HardScene(
        "legs_crossed",
        "thighs and shins through each other under a skirt, which goes around both",
        into_pose("skirt", LEGS_CROSSED, 1.3 * SKIRT_MOVES),
        seconds=SKIRT_SECONDS,
    ),
    HardScene(
        "cloth_between_legs",
        "cloth that hangs between thighs and shins which go through each other",
        between_legs,
        seconds=6.0,
    ),
    HardScene(
        "arms_through_each_other",
        "both sleeves led into each other, as deep as the arms go",
        into_pose("tshirt", ARMS_CROSSED),
        seconds=8.0,
    ),
    HardScene(
        "deep_squat",
        "a skirt between thighs and belly",
        in_motion("skirt", "squat", SKIRT_MOVES, pinches=True),
        seconds=SKIRT_SECONDS,
    ),
    HardScene("wrist_10ms", "an arm swung to and fro, the hand at 10 m/s", root_path("tshirt", swung), seconds=7.0),
    *(
        HardScene(name, stresses, root_path("skirt", path, SKIRT_MOVES), seconds=SKIRT_SECONDS)
        for name, path, stresses in (
            ("jump", jumping, "jumps of 2.4 m/s that start and land within a frame, in a skirt"),
            ("cartwheel", cartwheel, "once round sideways in 1.4 s, in a skirt"),
            ("spin", spinning, "two turns a second, stopped in a fifth of one, in a skirt"),
        )
    ),
    HardScene(
        "standing_60s",
        "a T-shirt on a body that stands still for a minute after walking",
        stood_still("tshirt"),
        vertices=600,
        seconds=61.5,
    ),
    HardScene(
        "skirt_standing_12s",
        "a skirt on a body that stands still after walking: all motion has gone after ten seconds",
        stood_still("skirt"),
        vertices=600,
        seconds=13.5,
    ),
    HardScene(
        "asleep_and_woken",
        "a T-shirt that falls asleep on a body that stands, and is woken by its first step",
        woken,
        seconds=10.0,
    ),
)
