"""A row of the array as a scene that can be played: what it is made of, and what is written while it runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from covered_cloths import RADIUS, Cloth, make_cloth
from covering_array import Row
from effect_factors import TWO
from small_scenes import icosphere, rigid_body
from worn_garment import demo_motion, led_into

from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose
from tryon_solver.dressing.untangle import untangle
from tryon_solver.geometry.enclosed import enclosed_volume
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.outfit import put_together
from tryon_solver.materials.fabric import FABRICS, Fabric
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
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import Simulation, build

Stance = Callable[[float], Pose | None]
AIR: dict[str, tuple[Effect, ...]] = {
    "none": (),
    "still": (AirDrag(),),
    "wind": (Wind((1.5, 0.0, 2.0)),),
    "sheltered": (Wind((3.0, 0.0, 1.0), shelter=0.8),),
    "gusts": (Wind((2.0, 0.0, -2.0), Gusts(0.3, seed=3)),),
}
STICKS = {"tape": (600.0, 0.4), "static cling": (5.0, 5e-4), "wet cling": (100.0, 0.05)}  # Pa, J/m^2
BLOWN = 15.0  # Pa, out and in again
FREE = 5.0  # m/s, the most that this gives to cloth that nothing slows: 15 Pa would give 119 m/s to silk, in a second
OPEN = ("sheet", "strip", "stack")  # pushed as one by a pressure, which on the others has no total
SOFT_PIN = 2000.0  # N/m
LED = 0.05  # m: radius of the circle on which pins are led, two seconds to a turn
AMBIENT = 101325.0  # Pa
PUMPED = 0.02  # of the gas, in and out again
STEEPER = 4.0  # times the fabric's own stiffness, of a curve's second part
OUTER = {"cotton_jersey": "denim", "denim": "silk_charmeuse", "silk_charmeuse": "cotton_jersey"}
"""What lies over it where two fabrics do: of another thickness, and of other friction with itself and the body."""


@dataclass(frozen=True)
class CoveredScene:
    """A `row` of the array, built at rest: the `cloth` that effects act on, the innermost garment, `sim`, how the body
    stands at a time [s], what was `written` last."""

    row: Row
    cloth: Cloth
    sim: Simulation
    stance: Stance
    written: dict[tuple[str, str], np.ndarray] = field(default_factory=dict)

    @cached_property
    def room(self) -> float:
        """m^3 within the first panel at the start."""
        garment = self.cloth.garment
        return enclosed_volume(self.cloth.x, garment.faces[garment.panel_of_face == 0])

    @cached_property
    def blown(self) -> float:
        """Pa: of open cloth in no air so much that its lightest fabric, let go, has FREE when it is blown in again."""
        row = self.row
        if row["cloth"] not in OPEN or row["air"] != "none":
            return BLOWN
        lightest = min(fabric.areal_density for fabric in self.sim.scene.fabric_of_garments())
        return min(BLOWN, FREE * lightest * np.pi / 2)

    @property
    def rate(self) -> float:
        """Frames a second."""
        return float(self.row["rate"])

    def write(self, time: float) -> None:
        """What is changed in the running scene by the time [s]; who sleeps is woken where that is something else."""
        for name, value, numbers in self._changes(time):
            wanted = np.asarray(numbers, np.float64)
            if not np.array_equal(wanted, self.written.get((name, value))):
                contribution = next(c for c in self.sim.plan.contributions if c.name == name)
                contribution.values[value].assign(wanted)
                self.written[name, value] = wanted
                self.sim.wake()

    def _changes(self, time: float) -> Iterator[tuple[str, str, np.ndarray | list[float]]]:
        """Contributions, their values and the numbers that are written into them."""
        row = self.row
        if row["elastic"] == "drawstring":
            yield "elastic", "ratio", [1.0 - 0.4 * min(time, 1.0)]
        if row["fasteners"] != "none":
            since = time - 2.0 if row["fasteners"] == "opened" and time > 1.0 else time
            share = min(1.0, since + 0.02) ** 2 if since > 0 else 0.0
            yield "fasteners", "closed", np.full(len(self.cloth.buttons), share)
        if row["pins"] != "none":
            turn = np.pi * time if row["pins"] == "led" else 0.0
            circle = LED * np.array([np.sin(turn), 1 - np.cos(turn), 0.0])
            yield "pins", "places", self.cloth.x[self.cloth.corners] + circle + self._carried(time)
        if row["creases"] == "pressed anew":
            yield "creases", "angles", np.full(len(self.cloth.along), 1.5 * np.cos(np.pi * time))
        if row["sewing"] != "none":
            yield "sewing", "share", [max(0.0, 1.0 - time)]
        if row["pressure"] == "blown":
            yield "pressure", "pressure", [self.blown * np.sin(np.pi * time)]
        if row["pressure"] == "gas":
            pumped = 1.0 + PUMPED * np.sin(np.pi * time)
            yield "gas", "amount", [pumped * AMBIENT * self.room]
        if row["adhesion"] == "wet cling":
            yield "adhesion", "share", [1.0 if time < 1.5 else 0.3]

    def acting_on(self, triangle: np.ndarray) -> list[str]:
        """Of the row, what pulls at a vertex of this triangle: its factors; "outer" where the other garment has it."""
        row, cloth = self.row, self.cloth
        if triangle.min() >= cloth.garment.vertex_count:
            return ["outer"]
        pulls = {
            "pins": cloth.corners,
            "fasteners": cloth.buttons,
            "sewing": cloth.dart,
            "elastic": cloth.across,
            "creases": cloth.along,
        }
        return [factor for factor, where in pulls.items() if row[factor] != "none" and np.isin(triangle, where).any()]

    def _carried(self, time: float) -> np.ndarray:
        """(3,) m by which a person has gone."""
        now, then = self.stance(time), self.stance(0.0)
        if self.cloth.worn is None or now is None or then is None:
            return np.zeros(3)
        return np.asarray(now.root - then.root)


def make_scene(row: Row, device: str = "cpu", deterministic: bool = False) -> CoveredScene:
    """Build what a row asks for."""
    cloth = plain = make_cloth(row["cloth"], row["fabric"])
    lies_on: tuple[np.ndarray, np.ndarray] | None = None
    if row["attached"] != "none":
        cloth, above, beneath = cloth.patched()
        lies_on = above, beneath
    body, stance = body_of(row, cloth)
    garment, x, fabrics = cloth.garment, cloth.x, (FABRICS[row["fabric"]],)
    if row["garments"] in TWO:
        outer_x = plain.lifted(patched=row["attached"] == "patch")
        garment, x = put_together(("inner", "outer"), (garment, plain.garment)), np.vstack([x, outer_x])
        outer = OUTER[row["fabric"]] if row["garments"] == "two of two fabrics" else row["fabric"]
        fabrics = (*fabrics, FABRICS[outer])
    effects = (*effects_of(row, cloth, garment, fabrics), *attached(lies_on))
    scene = Scene(garment, x, body, fabrics[0], effects, of_panels(garment, fabrics))
    surface = None if cloth.worn is None else cloth.worn.surface
    settings = replace(PRESETS[row["preset"]], deterministic=deterministic)
    twice = cloth.worn is not None and row["garments"] in TWO
    sim = build(scene, settings, device, stance(0.0), surface, tangled=twice)
    if twice:  # where what is worn is gathered, what is lifted off it may pass through it
        untangle(sim)
    return CoveredScene(row, cloth, sim, stance)


def of_panels(garment: Garment, fabrics: tuple[Fabric, ...]) -> tuple[Fabric, ...]:
    """The fabric of each panel where garments have different ones."""
    return tuple(
        fabric for layer, fabric in zip(garment.layers, fabrics) for _ in range(layer.panels.start, layer.panels.stop)
    )


def body_of(row: Row, cloth: Cloth) -> tuple[BodyModel | None, Stance]:
    """The body, and its stance at a time [s]."""
    if row["body"] == "none":
        return None, lambda _: None
    if cloth.worn is not None:
        body = cloth.worn.body
        return body, led_into(Pose.rest(body), demo_motion("walk", body))
    ball, faces = icosphere(RADIUS, 2)
    moving = row["body"] == "moving ball"

    def stance(time: float) -> Pose:
        """It swings to and fro and turns, from rest."""
        way = 0.5 * (1 - np.cos(2 * np.pi * time)) if moving else 0.0
        half = 0.4 * way
        return Pose(np.array([0.1 * way, 0.03 * way, 0.0]), np.array([[0.0, np.sin(half), 0.0, np.cos(half)]]))

    return rigid_body(ball, faces), stance


def effects_of(row: Row, cloth: Cloth, garment: Garment, fabrics: tuple[Fabric, ...]) -> Iterator[Effect]:
    """All but the patch, on the cloth, which is the first of the garments."""
    if row["gravity"] == "down":
        yield Gravity()
    if row["body contact"] == "on":
        yield BodyContact()
    if row["self contact"] == "on":
        yield SelfContact()
    if row["friction"] == "fabric":
        yield Friction()
    if row["friction"] == "pairs":
        yield by_pairs(garment.panel_count)
    yield from AIR[row["air"]]
    if row["damping"] != "none":
        yield FabricDamping()
    yield from stretching(row["stretch"], fabrics)
    if row["adhesion"] != "none":
        yield Adhesion(*STICKS[row["adhesion"]], cloth.taped if row["adhesion"] == "tape" else None)
    yield from worked(row, cloth)
    if row["sleep"] != "none":
        yield Sleep()


def worked(row: Row, cloth: Cloth) -> Iterator[Effect]:
    """What a tailor adds."""
    if row["pressure"] == "blown":
        yield Pressure(0.0)
    if row["pressure"] == "gas":
        yield Gas(panels=(0,))
    if row["elastic"] != "none":
        yield Elastic((ElasticLine(cloth.across, 0.8 if row["elastic"] == "band" else 1.0, 15.0),))
    if row["creases"] != "none":
        yield Creases(cloth.along, np.full(len(cloth.along), 1.5))
    if row["fasteners"] != "none":
        yield Fasteners(cloth.buttons, SOFT_PIN)
    if row["sewing"] != "none":
        yield Sewing(cloth.dart, SOFT_PIN)
    if row["pins"] != "none":
        yield Pins(cloth.corners, SOFT_PIN)


def by_pairs(panels: int) -> Friction:
    """Every pair of panels has coefficients of its own, and slides more easily than it sticks."""
    k = np.arange(panels + 1)
    static = 0.2 + 0.4 * np.abs(np.sin(k[:, None] + k[None]))
    return Friction(static=static, kinetic=0.7 * static)


def stretching(kind: str, fabrics: tuple[Fabric, ...]) -> Iterator[Effect]:
    """What the fabrics do beyond their own stiffness; a curve is one for all, and none may be stiffer than it."""
    if kind in ("limit", "both"):
        yield StrainLimit()
    if kind in ("curves", "both"):
        yield StretchCurves(
            *(
                ((0.05, 0.05 * k), (0.15, 0.05 * k + 0.1 * STEEPER * k))
                for k in (1.0001 * max(getattr(fabric, name) for fabric in fabrics) for name in ("k_warp", "k_weft"))
            )
        )


def attached(lies_on: tuple[np.ndarray, np.ndarray] | None) -> Iterator[Effect]:
    """The patch, sewn on at all its vertices."""
    if lies_on is None:
        return
    above, beneath = lies_on
    weights = np.tile([1.0, 0.0, 0.0], (len(above), 1))
    yield Attached(above, np.repeat(beneath[:, None], 3, axis=1), weights, 300.0)
