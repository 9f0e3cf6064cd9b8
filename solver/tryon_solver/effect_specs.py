"""What a scene may ask for: one frozen class of numbers for each effect. Importing this imports no effect, nor what
only some of them are checked with.

A spec refuses what no step could do anything with: what is not of its field's type (checks.py), not finite, of the
wrong sign, or by its meaning impossible, as a share beyond 1 or a fold through itself. How large a quantity with a unit
may be it does not say: 1e6 Pa is a slip for a garment and none for a membrane of a pressure vessel, and no unit tells
which. What is more than steps can follow is told by their reports (`error`, `retries`, `max_stretch`, `advice`), and
penetrates nothing. What garments and wearers call for has bounds in effect_words/table.py, which sessions are held to.

All acts in full from the first step on. 200 Pa, by themselves, send jersey 1.2 m away in a step of 1/30 s: whoever adds
what is strong leads its values there over time (value_ramps.py, and effect_words/gentle.py for how long), as sessions
do, or makes shorter steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tryon_solver.checks import (
    check_indices,
    check_number,
    check_numbers,
    check_pairs,
    check_share,
    check_signed,
    check_vector,
    check_whole,
    check_wholes,
    told,
)
from tryon_solver.effect_spec import EffectSpec, check_panels, check_vertices

if TYPE_CHECKING:
    from tryon_solver.geometry.garment import Garment
    from tryon_solver.scene import Scene

MOST_DAMPED = 1e5  # s: of more, float32 does not hold the cloth's own stiffness beside its damping
FLAT = 1e-9  # times its area to the power of 3/2, a piece encloses nothing but rounding
FIRMER = 2.0  # times cloth at its limit a bond may be; tried of 1, 2 and 4 in two scenes: METHOD.md section 6


@dataclass(frozen=True)
class Gravity(EffectSpec):
    """Uniform gravity; `acceleration` m/s^2, also the contribution's value (1,) vec3, which may be written."""

    module: ClassVar[str] = "tryon_solver.effects.gravity"
    acts_by: ClassVar[tuple[str, ...]] = ("acceleration",)

    acceleration: tuple[float, float, float] = (0.0, -9.81, 0.0)

    def __post_init__(self) -> None:
        check_vector("gravity: acceleration", self.acceleration)


@dataclass(frozen=True)
class BodyContact(EffectSpec):
    """Contact between cloth and the body's collision surface."""

    module: ClassVar[str] = "tryon_solver.effects.body_contact"

    def check(self, scene: Scene) -> None:
        """Raises ValueError for a scene without a body."""
        if scene.body is None:
            raise ValueError("effects: BodyContact needs a body; give the scene one or leave the effect out")


@dataclass(frozen=True)
class SelfContact(EffectSpec):
    """Contact between cloth and cloth."""

    module: ClassVar[str] = "tryon_solver.effects.self_contact"


@dataclass(frozen=True)
class Friction(EffectSpec):
    """Coulomb friction on every contact the scene has; coefficients come from the fabric, unless they are given here.
    Between two garments it is the geometric mean of their fabrics'.

    `static` (P + 1, P + 1), without unit: coefficients between the garment's P panels, each of its own material, and
    the body, which is last; `kinetic` (P + 1, P + 1), without unit: of what slides, nowhere more than `static`, which
    it is where it is not given.

    A contact gives by up to `presliding` m before it slides, and its force grows smoothly with that; it keeps what it
    has given from step to step, so that what sticks stays.
    """

    module: ClassVar[str] = "tryon_solver.effects.friction"

    presliding: float = 1e-4
    static: np.ndarray | None = None
    kinetic: np.ndarray | None = None

    def __post_init__(self) -> None:
        check_number("friction: presliding", self.presliding, above=True)
        if self.static is None:
            if self.kinetic is None:
                return
            raise ValueError("friction: kinetic coefficients without static ones; give both")
        for name, table in (("static", self.static), ("kinetic", self.kinetic)):
            if table is None:
                continue
            check_numbers(f"friction: {name}", table, "P + 1", "P + 1")
            if table.shape[0] != table.shape[1] or len(table) != len(self.static):
                raise ValueError(f"friction: {name} has shape {table.shape}; give a square table, both alike")
            if odd := np.argwhere((table < 0) | (table != table.T)).tolist():
                raise ValueError(f"friction: {name} must be symmetric, of numbers of at least 0, unlike at {odd[0]}")
        if self.kinetic is not None and (self.kinetic > self.static).any():
            i, j = np.argwhere(self.kinetic > self.static)[0]
            raise ValueError(
                f"friction: what slides resists more than what sticks at [{i}, {j}]: kinetic {self.kinetic[i, j]} over "
                f"static {self.static[i, j]}; lower it"
            )

    def check(self, scene: Scene) -> None:
        """Raises ValueError for a table of another number of materials than the garment's panels and the body."""
        panels = int(scene.garment.panel_of_face.max()) + 1
        if self.static is not None and len(self.static) != panels + 1:
            raise ValueError(
                f"friction: static is for {len(self.static)} materials; the garment has {panels} panels, and the body "
                "is one more"
            )

    def idle(self, scene: Scene) -> str:
        """Where there is no contact."""
        touching = any(isinstance(effect, (BodyContact, SelfContact)) for effect in scene.effects)
        return "" if touching else "nothing touches: list BodyContact or SelfContact for it to act"


@dataclass(frozen=True)
class StrainLimit(EffectSpec):
    """Stiffens the fabric beyond its strain limit; `stiffness` N/m acts on the excess."""

    module: ClassVar[str] = "tryon_solver.effects.strain_limit"
    acts_by: ClassVar[tuple[str, ...]] = ("stiffness",)

    stiffness: float = 20000.0

    def __post_init__(self) -> None:
        check_number("strain limit: stiffness", self.stiffness)


@dataclass(frozen=True)
class StretchCurves(EffectSpec):
    """Measured curves of a fabric that stiffens as it is stretched: along `warp` and `weft` points of strain [-] and
    tension [N/m], from a strip's tensile test, rising; from (0, 0) to the first and between them it is linear, and
    beyond the last it goes on as before it. Along a direction without points, and in compression, the fabric's own
    stiffness holds.
    """

    module: ClassVar[str] = "tryon_solver.effects.stretch_curves"

    warp: tuple[tuple[float, float], ...] = ()
    weft: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        for name, points in (("warp", self.warp), ("weft", self.weft)):
            check_pairs(f"stretch curves: {name}", points, "a strain and a tension, as (0.05, 12.5)")
            for k, ((strain, tension), (next_strain, next_tension)) in enumerate(pairwise(((0.0, 0.0), *points))):
                if not (next_strain > strain and next_tension >= tension):
                    raise ValueError(f"stretch curves: {name} does not rise to point {k}; order the points by strain")

    def idle(self, scene: Scene) -> str:  # noqa: ARG002
        """Without points."""
        return "" if self.warp or self.weft else "there is no curve: give points of warp or weft"


@dataclass(frozen=True)
class AirDrag(EffectSpec):
    """Air at rest slows the cloth's motion through it; `coefficient` N s/m^3: force per area and speed.

    A plate broadside on feels 1/2 rho c_d v per speed: with c_d 1.2 to 2 that is 1.0 to 1.7 N s/m^3 at walking speed,
    1.4 m/s. A hem swings more slowly, but to and fro, for which c_d is several times as large (Keulegan and Carpenter
    1958). So the default is the most that steady air has: with it a dress comes to rest soonest (docs/measured.md).
    """

    module: ClassVar[str] = "tryon_solver.effects.air_drag"
    acts_by: ClassVar[tuple[str, ...]] = ("coefficient",)

    coefficient: float = 1.7

    def __post_init__(self) -> None:
        check_number("air drag: coefficient", self.coefficient)


@dataclass(frozen=True)
class Gusts:
    """Turbulence of the wind along its direction: von Karman's spectrum as a sum of sines (effects/wind.py).

    `intensity` is the speed's standard deviation over its mean, at most 1: 0.1 to 0.3 near the ground, and beyond 1 the
    wind would blow backwards every sixth moment, eddies that are borne past by it no more. `length` m is how large
    eddies are; `seed` draws phases.
    """

    intensity: float = 0.2
    length: float = 5.0
    seed: int = 0

    def __post_init__(self) -> None:
        check_number("wind: gusts.intensity", self.intensity)
        if self.intensity > 1.0:
            share = "the speed's standard deviation over its mean"
            raise ValueError(f"wind: gusts.intensity {self.intensity!r} is {share}; give 1 at most, 0.2 for 20 %")
        check_number("wind: gusts.length", self.length, above=True)
        check_whole("wind: gusts.seed", self.seed)


@dataclass(frozen=True)
class Wind(EffectSpec):
    """Air that moves at `velocity` m/s, or stands still, and presses on each triangle by the square of the speed
    between them. It takes the place of AirDrag, which is linear.

    `broadside` and `along` are the coefficients of force for air that meets a triangle straight on and that strokes it,
    by 1/2 `density` (kg/m^3) times area and speed squared: a plate has about 1.2 and 0.01 (Hoerner 1965). Where the
    body is upwind the wind has the share 1 - `shelter` of its speed, and wins back the rest over `shelter_length` m.
    The contribution's value "velocity" (1,) vec3 m/s may be written between steps.
    """

    module: ClassVar[str] = "tryon_solver.effects.wind"
    acts_by: ClassVar[tuple[str, ...]] = ("density", "broadside")

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gusts: Gusts | None = None
    shelter: float = 0.0
    shelter_length: float = 1.0
    density: float = 1.2
    broadside: float = 1.2
    along: float = 0.01

    def __post_init__(self) -> None:
        check_vector("wind: velocity", self.velocity)
        for name in ("density", "broadside", "along"):
            check_number(f"wind: {name}", getattr(self, name))
        if self.along > self.broadside:
            raise ValueError(f"wind: along {self.along} exceeds broadside {self.broadside}; lower it")
        check_share("wind: shelter", self.shelter)
        check_number("wind: shelter_length", self.shelter_length, above=True)
        if not isinstance(self.gusts, Gusts | None):
            raise ValueError(f"wind: gusts is {told(self.gusts)}; give Gusts(0.2) for 20 %, or None for none")
        if self.gusts is not None and not any(self.velocity):
            raise ValueError("wind: gusts are a share of the wind's speed, which is 0; give it a velocity")

    def check(self, scene: Scene) -> None:
        """Raises ValueError beside AirDrag, in gusts beside Sleep, or for a body's shelter where there is none."""
        kinds = [type(effect) for effect in scene.effects]
        if AirDrag in kinds:
            raise ValueError("effects: Wind and AirDrag are two laws of the same air; list one of them")
        if self.gusts is not None and Sleep in kinds:
            raise ValueError("effects: cloth that is asleep feels no gusts; leave Sleep out, or the gusts")
        if self.shelter and scene.body is None:
            raise ValueError("wind: shelter needs a body; give the scene one or set shelter to 0")


@dataclass(frozen=True)
class FabricDamping(EffectSpec):
    """Damping within the fabric; `time` s is beta of the force -beta H v (effects/fabric_damping.py).

    A mode of frequency f is damped by the ratio pi f beta of critical: 5 ms is 13 % at 8 Hz and 3 % at 2 Hz, at which
    cloth swings. That is what tensile tests of fabrics say: a cycle that gives back 55 to 70 % of its work has the loss
    factor 0.05 to 0.07, 2 pi f beta.
    """

    module: ClassVar[str] = "tryon_solver.effects.fabric_damping"
    acts_by: ClassVar[tuple[str, ...]] = ("time",)

    time: float = 5e-3

    def __post_init__(self) -> None:
        check_number("fabric damping: time", self.time)
        if self.time > MOST_DAMPED:
            raise ValueError(
                f"fabric damping: time is {self.time!r} s; give {MOST_DAMPED:g} s at most, a day, with which no cloth "
                "is seen to give, or hold it with Pins"
            )


@dataclass(frozen=True)
class Pressure(EffectSpec):
    """Inflated pieces: `pressure` Pa more behind the cloth than before it, on the triangles of `panels`, all if none is
    named. It pushes to the front, which is outside where a closed piece is seen counter-clockwise from there.

    The contribution's value "pressure" (1,) Pa may be written between steps.
    """

    module: ClassVar[str] = "tryon_solver.effects.pressure"

    pressure: float
    panels: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        check_signed("pressure: pressure", self.pressure)
        check_wholes("pressure: panels", self.panels)

    def check(self, scene: Scene) -> None:
        """Raises ValueError for a panel that the garment does not have."""
        check_panels("pressure", self.panels, scene)


@dataclass(frozen=True)
class Gas(EffectSpec):
    """Gas shut in by the `panels`, all if none is named: together one piece, seen counter-clockwise from outside, whose
    openings count as closed by flat caps. It has `volume` m^3 at the pressure around it, `ambient` Pa, and keeps its
    temperature: its pressure is `ambient` times `volume` over the volume that is left to it. None: as much as the piece
    has room for at the start. Without any gas, at 0 m^3, what is around would press the piece flat: that is refused.

    The contribution's values may be written between steps: "amount" (1,) float64 J, pressure times volume, more where
    gas is pumped in; "share" (1,) float64 of that amount, 1 at the start; "ambient" (1,) float64 Pa.
    """

    module: ClassVar[str] = "tryon_solver.effects.gas"

    volume: float | None = None
    ambient: float = 101325.0
    panels: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if self.volume is not None:
            check_number("gas: volume", self.volume, above=True)
        check_number("gas: ambient", self.ambient, above=True)
        check_wholes("gas: panels", self.panels)

    def check(self, scene: Scene) -> None:
        """Raises ValueError for a panel that the garment does not have, or a piece that encloses nothing."""
        from tryon_solver.geometry.enclosed import area_of, closed_by_caps, enclosed_volume

        check_panels("gas", self.panels, scene)
        faces = closed_by_caps(self.faces_of(scene.garment))
        found = enclosed_volume(scene.x_start, faces)
        if found <= FLAT * area_of(scene.x_start, faces) ** 1.5:
            raise ValueError(
                f"gas: at the start the piece encloses {found:.3g} m^3; give a piece with room in it, its triangles "
                "counter-clockwise as seen from outside"
            )

    def faces_of(self, garment: Garment) -> np.ndarray:
        """(F, 3) int32: the triangles that shut the gas in."""
        return garment.faces[np.isin(garment.panel_of_face, self.panels)] if self.panels else garment.faces


@dataclass(frozen=True)
class Adhesion(EffectSpec):
    """Contacts that stick: tape, hook and loop, static or wet cling. Each m^2 in contact resists being pulled off with
    up to `strength` Pa, and takes `work` J/m^2 to part; what is parted sticks again when it is pressed on again. It
    resists being pushed aside with up to `shear` Pa, and gives by up to `presliding` m before it slips. None:
    `strength`, as far as the fabric bears it (`shear_in`).

    `vertices` (K,) int32 are the sticky ones, all of the cloth if None. The contribution's value "share" (1,) float32,
    1 at the start, may be written between steps: what dries sticks less. Orders of magnitude: static cling 5 Pa and
    5e-4 J/m^2, wet cloth on skin 100 Pa and 0.05 J/m^2, tape 1 kPa and 1 J/m^2.
    """

    module: ClassVar[str] = "tryon_solver.effects.adhesion"

    strength: float
    work: float
    vertices: np.ndarray | None = None
    shear: float | None = None
    presliding: float = 1e-4

    def __post_init__(self) -> None:
        check_number("adhesion: strength", self.strength)
        check_number("adhesion: work", self.work)
        if self.vertices is not None:
            check_indices("adhesion: vertices", self.vertices, "K")
        if self.shear is not None:
            check_number("adhesion: shear", self.shear)
        check_number("adhesion: presliding", self.presliding, above=True)

    def check(self, scene: Scene) -> None:
        """Raises ValueError where there is no contact to stick to, or no such vertex."""
        if not any(isinstance(effect, (BodyContact, SelfContact)) for effect in scene.effects):
            raise ValueError("adhesion: nothing is touched; list BodyContact or SelfContact, or leave Adhesion out")
        if self.vertices is not None:
            check_vertices("adhesion: vertices", self.vertices, scene)

    def idle(self, scene: Scene) -> str:  # noqa: ARG002
        """Where nothing sticks, whatever it resists being pushed aside with."""
        if self.strength == 0 or self.work == 0:
            return f"nothing sticks at {self.strength:g} Pa and {self.work:g} J/m^2: give more than 0 of both"
        return "no vertex is sticky" if self.vertices is not None and len(self.vertices) == 0 else ""

    def shear_in(self, scene: Scene) -> float:
        """Pa that it resists being pushed aside with in this scene: `shear`, or else `strength` up to FIRMER times
        k (limit - 1)/h, of the fabric that bears most, with its stiffness k [N/m], the stretch up to which it goes, and
        h the mesh's mean edge length [m].

        One row of cells that stick, h wide, then carries so many times the tension that the fabric has at its limit: no
        more is felt of a bond by cloth that is not torn. Ours.
        """
        if self.shear is not None:
            return self.shear
        fabrics = scene.panel_fabrics or (scene.fabric,)
        tension = max(max(one.k_warp, one.k_weft) * (one.strain_limit - 1.0) for one in fabrics)
        return min(self.strength, FIRMER * tension / scene.garment.mean_edge_length())


@dataclass(frozen=True)
class Sleep(EffectSpec):
    """Cloth that hangs still on a body that stands still is left as it is until something moves.

    It falls asleep when for `time` s the cloth was no faster than `speed` m/s RMS, and no vertex of cloth or collision
    surface faster than `fastest` m/s, and where it is no faster in the end than it was in the first half of that: what
    begins to fall is slow, too. It wakes when a point of the skin is more than `shift` m from where it was then.
    Whoever changes something else, such as a contribution's values, wakes the simulation (Simulation.wake).
    """

    module: ClassVar[str] = "tryon_solver.effects.sleep"
    acts_by: ClassVar[tuple[str, ...]] = ("speed", "fastest")

    speed: float = 1e-3
    fastest: float = 2.5e-3
    time: float = 0.5
    shift: float = 1e-4

    def __post_init__(self) -> None:
        for name in ("speed", "fastest", "time", "shift"):
            check_number(f"sleep: {name}", getattr(self, name))
