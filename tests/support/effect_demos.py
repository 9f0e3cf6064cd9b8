"""A scene to look at for each effect, with it and without it: what there is to see is the difference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from small_scenes import STILL, fabric, flattened, icosphere, layers, rigid_body, sheet, slab, turn

from tryon_solver.body.model import BodyModel
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.lines import line_between
from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import (
    Adhesion,
    AirDrag,
    Attached,
    BodyContact,
    Creases,
    Effect,
    Elastic,
    ElasticLine,
    FabricDamping,
    Fasteners,
    Friction,
    Gas,
    Gravity,
    Gusts,
    Pins,
    Pressure,
    Scene,
    SelfContact,
    Sewing,
    StrainLimit,
    StretchCurves,
    Wind,
)
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import Simulation, build

N, SIDE = 13, 0.32  # vertices to a side of a square, and its length in m
JERSEY = fabric()
SOFT = fabric(k_warp=2.0, k_weft=2.0, k_shear=1.0, strain_limit=1.1)
STIFF = fabric(k_bend=1.5e-4)
HEAVY = fabric(areal_density=1.0, k_bend=1e-7)
FALLS = (Gravity(),)
AIR = (Gravity(), AirDrag())
TOUCHES = (*AIR, BodyContact())


@dataclass(frozen=True)
class Demo:
    """`made(with_it)` is played for so many `seconds` and drawn as seen from `azimuth` degrees right of +z; `shows`
    says what there is to see, without and with the effect."""

    name: str
    shows: str
    made: Callable[[bool], Scene]
    seconds: float = 1.5
    azimuth: float = 25.0

    def played(self, with_it: bool) -> Simulation:
        """The simulation at the end."""
        scene = self.made(with_it)
        pose = None if scene.body is None else STILL
        sim = build(scene, PRESETS["live"], "cpu", pose)
        seams = [c.values["share"] for c in sim.plan.contributions if c.name == "sewing"]
        for k in range(round(self.seconds * 60)):
            for share in seams:
                share.fill_(max(0.0, 1.0 - (k + 1) / 30))
            sim.advance(pose, (k + 1) / 60)
        return sim


def hung(effects: tuple[Effect, ...], cloth: Fabric = JERSEY) -> Scene:
    """A square that hangs from its upper edge."""
    garment, flat = sheet(N, N, SIDE, SIDE)
    x = np.column_stack([flat[:, 0], -flat[:, 2], 2e-3 * np.sin(20 * flat[:, 0])])
    top = np.arange(N * (N - 1), N * N, dtype=np.int32)
    return Scene(garment, x, None, cloth, (*effects, Pins(top)))


def level(effects: tuple[Effect, ...]) -> Scene:
    """A level square, two corners of which are held."""
    garment, x = sheet(N, N, SIDE, SIDE)
    return Scene(garment, x, None, JERSEY, (*effects, Pins(np.array([0, N * N - 1], np.int32))))


def over_a_ball(effects: tuple[Effect, ...], aside: float = 0.0) -> Scene:
    """A square above a ball."""
    garment, x = sheet(N, N, SIDE, SIDE)
    ball, faces = icosphere(0.09, 2)
    return Scene(garment, x + [aside, 0.095, 0.003], rigid_body(ball, faces), JERSEY, effects)


def stacked(effects: tuple[Effect, ...], apart: float) -> Scene:
    """Two squares, one above the other, the lower pinned at its border."""
    garment, x = layers(2, N, N, SIDE, apart)
    lower = x[: N * N]
    border = np.flatnonzero(np.abs(lower[:, [0, 2]]).max(axis=1) > 0.499 * SIDE).astype(np.int32)
    return Scene(garment, x @ turn((20, 0, 0)).T, None, JERSEY, (*effects, Pins(border)))


def on_a_plate(effects: tuple[Effect, ...]) -> Scene:
    """A square on a plate that stands."""
    plate, faces = slab(0.5, 0.5, 0.02, 0.05)
    garment, x = sheet(N, N, SIDE, SIDE)
    tilt = turn((90, 0, 0)).T
    body = rigid_body(plate @ tilt, faces)
    return Scene(garment, (x + [0.003, 3.2e-3, -0.05]) @ tilt, body, JERSEY, effects)


def ball_of_cloth(
    effects: tuple[Effect, ...], body: BodyModel | None = None, high: float = 0.0, cloth: Fabric = JERSEY
) -> Scene:
    """Closed, its middle so `high`."""
    x, faces = icosphere(0.1, 2)
    corners = x[faces][:, :, :2]
    panel = np.zeros(len(faces), np.int32)
    garment = Garment(faces, flattened(x, faces), panel, len(x), spline_corners=corners)
    return Scene(garment, x + [0, high, 0], body, cloth, effects)


def ground() -> BodyModel:
    """A plate whose top is at 0."""
    return rigid_body(*slab(0.4, 0.4, 0.02, 0.04))


def with_effect(effects: tuple[Effect, ...], effect: Effect, with_it: bool) -> tuple[Effect, ...]:
    """The effects, and the one if it is wanted."""
    return (*effects, effect) if with_it else effects


def line_across(row: int) -> np.ndarray:
    """(N - 1, 2) edges of a square along a row of its vertices."""
    return line_between(sheet(N, N, SIDE, SIDE)[0], N * row, N * row + N - 1)


def buttoned(with_it: bool) -> Scene:
    """Two squares edge to edge, the upper hangs."""
    garment, x = layers(2, N, N, SIDE / 2, 0.0)
    upper = np.arange(N * N) + N * N
    x = np.column_stack([x[:, 0], -x[:, 2], 0 * x[:, 0]])
    x[upper, 1] += SIDE / 2 + 3e-3
    top = (upper[-N:]).astype(np.int32)
    columns = np.array([0, N // 2, N - 1])
    pairs = np.column_stack([N * (N - 1) + columns, N * N + columns]).astype(np.int32)
    return Scene(garment, x, None, JERSEY, with_effect((*AIR, Pins(top)), Fasteners(pairs), with_it))


def darted(with_it: bool) -> Scene:
    """A hanging square with a dart in its middle."""
    middle = N // 2
    stitches = [[N * row + middle - k, N * row + middle + k] for row in range(6) for k in [max(1, 3 - row // 2)]]
    return hung(with_effect(AIR, Sewing(np.array(stitches, np.int32), 1e3), with_it))


def patched(with_it: bool) -> Scene:
    """A square that hangs, and a smaller one before it."""
    garment, flat = sheet(N, N, SIDE, SIDE)
    piece, small = sheet(7, 7, SIDE / 2, SIDE / 2)
    count = len(flat)
    both = Garment(
        np.vstack([garment.faces, piece.faces + count]),
        np.vstack([garment.uv_corners, piece.uv_corners]),
        np.append(garment.panel_of_face, piece.panel_of_face + 1),
        count + len(small),
    )
    x = np.vstack([flat, small + [0, 2.5e-3, 0]]) @ turn((90, 0, 0)).T
    beneath = np.array([[N * (row + 3) + column + 3] for row in range(7) for column in range(7)])
    sewn = np.arange(49)
    onto = np.repeat(beneath[sewn], 3, axis=1).astype(np.int32)
    weights = np.tile([1.0, 0.0, 0.0], (len(sewn), 1))
    top = np.flatnonzero(x[:count, 1] > 0.499 * SIDE).astype(np.int32)
    pocket = Attached((sewn + count).astype(np.int32), onto, weights, 300.0)
    return Scene(both, x, None, JERSEY, with_effect((*AIR, SelfContact(), Pins(top)), pocket, with_it))


def behind_a_ball(with_it: bool) -> Scene:
    """A square that hangs in the wind behind a ball."""
    garment, flat = sheet(N, N, SIDE, SIDE)
    x = np.column_stack([flat[:, 0], -flat[:, 2], 0.16 + 0 * flat[:, 0]])
    ball, faces = icosphere(0.12, 2)
    top = np.arange(N * (N - 1), N * N, dtype=np.int32)
    wind = Wind((0.0, 0.0, 1.7), shelter=0.95 if with_it else 0.0)
    return Scene(garment, x, rigid_body(ball, faces), JERSEY, (*FALLS, BodyContact(), wind, Pins(top)))


CURVES = StretchCurves(((0.1, 0.25), (0.2, 3.0)), ((0.1, 0.25), (0.2, 3.0)))
DEMOS = (
    Demo("Gravity", "held at two corners, flat at first", lambda on: level(with_effect((AirDrag(),), Gravity(), on))),
    Demo("AirDrag", "let go, after half a second", lambda on: ball_of_cloth(with_effect(FALLS, AirDrag(), on)), 0.5),
    Demo("Wind", "in gusts", lambda on: hung(with_effect(FALLS, Wind((0.4, 0, 1.7), Gusts()), on)), 1.5, 65.0),
    Demo("Wind, sheltered", "by the ball before it", behind_a_ball, 2.0, 90.0),
    Demo("BodyContact", "falls on a ball", lambda on: over_a_ball(with_effect(AIR, BodyContact(), on)), 0.6),
    Demo("SelfContact", "falls on another", lambda on: stacked(with_effect(AIR, SelfContact(), on), 0.03), 0.6),
    Demo("Friction", "lies on a ball, aside", lambda on: over_a_ball(with_effect(TOUCHES, Friction(), on), 0.03), 1.2),
    Demo("Adhesion", "sticks to a plate", lambda on: on_a_plate(with_effect(TOUCHES, Adhesion(40, 0.02), on)), 0.8, 60),
    Demo("StrainLimit", "of soft fabric", lambda on: hung(with_effect(AIR, StrainLimit(), on), SOFT), 1.5, 0.0),
    Demo("StretchCurves", "of soft fabric", lambda on: hung(with_effect(AIR, CURVES, on), SOFT), 1.5, 0.0),
    Demo("FabricDamping", "soft fabric 0.2 s after it was let go, damped by 0.1 s", lambda on: dropped(on), 0.2, 0.0),
    Demo("Pressure", "a heavy ball with 200 Pa in it", lambda on: lying(Pressure(200.0), on), 1.0, 0.0),
    Demo("Gas", "a heavy ball full of air", lambda on: lying(Gas(), on), 1.0, 0.0),
    Demo("Elastic", "a line drawn to half", lambda on: hung(with_effect(AIR, drawn_in(), on)), 1.5, 0.0),
    Demo("Creases", "pressed twice", lambda on: hung(with_effect(AIR, pressed(), on), STIFF), 1.5, 65.0),
    Demo("Fasteners", "three buttons", buttoned, 0.5, 0.0),
    Demo("Sewing", "a dart is closed", darted, 1.5, 0.0),
    Demo("Attached", "a pocket", patched, 0.4),
    Demo("Pins", "two vertices held", lambda on: pinned(on), 0.5),
)


def dropped(with_it: bool) -> Scene:
    """A square that is held by its upper edge and as long as its pattern."""
    garment, flat = sheet(N, N, SIDE, SIDE)
    x = np.column_stack([flat[:, 0], -flat[:, 2], 0 * flat[:, 0]])
    top = np.arange(N * (N - 1), N * N, dtype=np.int32)
    return Scene(garment, x, None, SOFT, with_effect((*FALLS, Pins(top)), FabricDamping(0.1), with_it))


def lying(effect: Effect, with_it: bool) -> Scene:
    """A ball of heavy cloth on the ground."""
    effects = (*AIR, BodyContact(), SelfContact(), Friction())
    return ball_of_cloth(with_effect(effects, effect, with_it), ground(), 0.104, HEAVY)


def drawn_in() -> Elastic:
    return Elastic((ElasticLine(line_across(N // 2), 0.5, 60.0),))


def pressed() -> Creases:
    lines = np.vstack([line_across(N // 3), line_across(2 * N // 3)])
    return Creases(lines, np.repeat([2.2, -2.2], N - 1))


def pinned(with_it: bool) -> Scene:
    """A square held by two of its corners, or by none."""
    garment, flat = sheet(N, N, SIDE, SIDE)
    x = np.column_stack([flat[:, 0], -flat[:, 2], 2e-3 * np.sin(20 * flat[:, 0])])
    corners = np.array([N * (N - 1), N * N - 1], np.int32)
    return Scene(garment, x, None, JERSEY, with_effect(AIR, Pins(corners), with_it))
