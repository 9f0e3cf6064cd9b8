"""One small scene for each effect, with it and without it: what it costs is the difference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from small_scenes import STILL, fabric, flattened, icosphere, layers, rigid_body, sheet

from tryon_solver.body.pose import Pose
from tryon_solver.contact import FOR_STEPS
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.lines import line_between
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
    Sleep,
    StrainLimit,
    StretchCurves,
    Wind,
)
from tryon_solver.simulation import Simulation, build

JERSEY = fabric()
EDGE = 0.01  # m, of a cell


@dataclass(frozen=True)
class EffectScene:
    """`own` are the modules that it alone imports; `made(n, with_it)` is the scene of n by n vertices; `shows` says
    what there is to see."""

    name: str
    own: tuple[str, ...]
    shows: str
    made: Callable[[int, bool], Scene]

    def built(self, n: int, with_it: bool, device: str = "cpu") -> tuple[Simulation, Pose | None]:
        """The simulation and the stance of its body."""
        scene = self.made(n, with_it)
        pose = None if scene.body is None else STILL
        return build(scene, None, device, pose), pose


def hung(n: int, *effects: Effect) -> Scene:
    """A square that hangs by its upper edge."""
    garment, flat = sheet(n, n, EDGE * (n - 1), EDGE * (n - 1))
    return by_its_top(n, garment, np.column_stack([flat[:, 0], -flat[:, 2], 0.02 * np.sin(40 * flat[:, 0])]), effects)


def hung_straight(n: int, *effects: Effect) -> Scene:
    """A square that hangs by its upper edge, in a plane from the start: it is at rest after a few frames."""
    garment, flat = sheet(n, n, EDGE * (n - 1), EDGE * (n - 1))
    return by_its_top(n, garment, np.column_stack([flat[:, 0], -flat[:, 2], 0.0 * flat[:, 0]]), effects)


def by_its_top(n: int, garment: Garment, x: np.ndarray, effects: tuple[Effect, ...]) -> Scene:
    top = np.arange(n * (n - 1), n * n, dtype=np.int32)
    return Scene(garment, x, None, JERSEY, (*effects, Pins(top)))


def draped(n: int, *effects: Effect) -> Scene:
    """A square that falls on a ball."""
    garment, x = sheet(n, n, EDGE * (n - 1), EDGE * (n - 1))
    ball, faces = icosphere(0.3 * EDGE * (n - 1), 2)
    return Scene(garment, x + [0, 0.3 * EDGE * (n - 1) + 3e-3, 0], rigid_body(ball, faces), JERSEY, effects)


def two(n: int, apart: float, *effects: Effect) -> Scene:
    """Two squares, one above the other, the lower pinned around."""
    garment, x = layers(2, n, n, EDGE * (n - 1), apart)
    half = x[: n * n]
    border = np.flatnonzero(np.abs(half[:, [0, 2]]).max(axis=1) > 0.499 * EDGE * (n - 1)).astype(np.int32)
    return Scene(garment, x, None, JERSEY, (*effects, Pins(border)))


def ball(_n: int, *effects: Effect) -> Scene:
    """A closed ball of cloth."""
    x, faces = icosphere(0.1, 3)
    corners = x[faces][:, :, :2]
    garment = Garment(faces, flattened(x, faces), np.zeros(len(faces), np.int32), len(x), spline_corners=corners)
    return Scene(garment, x, None, JERSEY, effects)


def added(scene: Callable[..., Scene], others: tuple[Effect, ...], effect: Callable[[int], Effect], *placed: float):
    """`made` of an EffectScene: the others, and the effect for n vertices a side."""

    def made(n: int, with_it: bool) -> Scene:
        return scene(n, *placed, *others, *((effect(n),) if with_it else ()))

    return made


def middle_line(n: int) -> np.ndarray:
    """The edges across a square of n by n vertices."""
    return line_between(sheet(n, n, EDGE * (n - 1), EDGE * (n - 1))[0], n * (n // 2), n * (n // 2) + n - 1)


def rows_of(n: int) -> np.ndarray:
    """(n, 2): the first row's vertices below and above."""
    return np.column_stack([np.arange(n), np.arange(n) + n * n]).astype(np.int32)


def attached(n: int) -> Attached:
    rows = rows_of(n)
    onto = np.repeat(rows[:, :1], 3, axis=1)
    onto[:, 1:] += [1, n]
    onto[-1] = [n - 1, n - 2, 2 * n - 1]
    return Attached(rows[:, 1], onto, np.tile([1.0, 0.0, 0.0], (n, 1)), 1e3)


def hem_weights(n: int) -> Effect:
    """Of the worked example, which is no part of the package (tests/examples)."""
    from hem_weights import HemWeights

    return HemWeights(np.arange(n, dtype=np.int32), np.full(n, 2e-3))


def ours(*modules: str) -> tuple[str, ...]:
    """Their whole names."""
    return tuple(f"tryon_solver.{module}" for module in modules)


def pulled(n: int) -> Elastic:
    return Elastic((ElasticLine(middle_line(n), 0.7, 20.0),))


def pleated(n: int) -> Creases:
    return Creases(middle_line(n), np.full(n - 1, 1.0))


CURVES = StretchCurves(((0.1, 25.0), (0.2, 100.0)), ((0.01, 2.0), (0.2, 100.0)))
GUSTY = Wind((1.0, 0.0, 2.0), Gusts())
TAPE = Adhesion(100.0, 0.05)
FALLING = (Gravity(),)
AIR = (Gravity(), AirDrag())
TOUCH = (*AIR, BodyContact())
BLOWN = (Gravity(), BodyContact(), Friction())
CLOSING = ("geometry.boundary_loops", "geometry.enclosed", "geometry.seams")  # by which gas finds what it is shut in by
CONTACT = (
    *(f"contact.{name}" for name in (*FOR_STEPS, "barrier", "ccd", "taking_over", "triangle_pairs")),
    *("linalg.slots", "stepping.arm_contact", "stepping.fly"),
)
SCENES = tuple(
    EffectScene(name, own, shows, made)
    for name, own, shows, made in (
        ("Gravity", ours("effects.gravity"), "hangs", added(hung, (AirDrag(),), lambda _: Gravity())),
        ("AirDrag", ours("effects.air_drag"), "hangs in still air", added(hung, FALLING, lambda _: AirDrag())),
        ("Wind", ours("effects.wind"), "flies in gusts", added(hung, FALLING, lambda _: GUSTY)),
        (
            "Wind, sheltered",
            ours("effects.wind"),
            "lies on a ball in the wind",
            added(draped, BLOWN, lambda _: Wind((2.0, 0.0, 0.0), shelter=0.8)),
        ),
        (
            "BodyContact",
            ours("effects.body_contact", *CONTACT),
            "falls on a ball",
            added(draped, AIR, lambda _: BodyContact()),
        ),
        (
            "SelfContact",
            ours("effects.self_contact", *CONTACT),
            "falls on cloth",
            added(two, AIR, lambda _: SelfContact(), 4e-3),
        ),
        (
            "Friction",
            ours("effects.friction", "effects.presliding", "effects.slip"),
            "stays on a ball",
            added(draped, TOUCH, lambda _: Friction()),
        ),
        (
            "Adhesion",
            ours("effects.adhesion", "effects.presliding", "effects.slip"),
            "sticks to a ball",
            added(draped, TOUCH, lambda _: TAPE),
        ),
        (
            "StrainLimit",
            ours("effects.strain_limit", "materials.strain_limit"),
            "hangs",
            added(hung, AIR, lambda _: StrainLimit()),
        ),
        (
            "StretchCurves",
            ours("effects.stretch_curves", "materials.stretch_curves"),
            "hangs",
            added(hung, AIR, lambda _: CURVES),
        ),
        (
            "FabricDamping",
            ours("effects.fabric_damping", "linalg.rated", "materials.strain_rate"),
            "swings",
            added(hung, AIR, lambda _: FabricDamping()),
        ),
        ("Pressure", ours("effects.pressure"), "a balloon", added(ball, (AirDrag(),), lambda _: Pressure(300.0))),
        ("Gas", ours("effects.gas", "linalg.dyad", *CLOSING), "a ball full of air", added(ball, AIR, lambda _: Gas())),
        ("Elastic", ours("effects.elastic"), "is drawn in along a line", added(hung, AIR, pulled)),
        ("Creases", ours("effects.creases"), "is pleated once", added(hung, AIR, pleated)),
        (
            "Fasteners",
            ours("effects.fasteners", "linalg.live_entries"),
            "hangs from buttons",
            added(two, AIR, lambda n: Fasteners(rows_of(n)), -0.01),
        ),
        ("Sewing", ours("effects.sewing"), "is sewn on", added(two, AIR, lambda n: Sewing(rows_of(n), 1e3), -0.01)),
        ("Attached", ours("effects.attached"), "is sewn on", added(two, AIR, attached, -0.01)),
        ("Pins", ours("effects.pins"), "is held at a point", added(ball, AIR, lambda _: Pins(np.zeros(1, np.int32)))),
        ("Sleep", ours("effects.sleep"), "sleeps after half a second", added(hung_straight, AIR, lambda _: Sleep())),
        ("Sleep, awake", ours("effects.sleep"), "swings, watched", added(hung, AIR, lambda _: Sleep())),
        ("HemWeights (below)", ("hem_weights",), "hangs", added(hung, AIR, hem_weights)),
    )
)
