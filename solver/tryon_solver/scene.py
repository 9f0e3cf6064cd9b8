"""What is to be simulated: garment, fabric, body, and the effects the scene calls for. No device arrays here."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tryon_solver.body.on_device import WornBody
from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import FABRICS, Fabric


@dataclass(frozen=True)
class Gravity:
    """Uniform gravity; `acceleration` m/s^2."""

    acceleration: tuple[float, float, float] = (0.0, -9.81, 0.0)


@dataclass(frozen=True)
class BodyContact:
    """Contact between cloth and the body's collision surface."""


@dataclass(frozen=True)
class SelfContact:
    """Contact between cloth and cloth."""


@dataclass(frozen=True)
class Friction:
    """Coulomb friction on every contact the scene has; coefficients come from the fabric.

    A contact gives by up to `presliding` m before it slides, and its force grows smoothly with that; it keeps what it
    has given from step to step, so that what sticks stays.
    """

    presliding: float = 1e-4


@dataclass(frozen=True)
class StrainLimit:
    """Stiffens the fabric beyond its strain limit; `stiffness` N/m acts on the excess."""

    stiffness: float = 20000.0


@dataclass(frozen=True)
class AirDrag:
    """Air at rest slows the cloth's motion through it; `coefficient` N s/m^3: force per area and speed.

    A plate broadside on feels 1/2 rho c_d v per speed: with c_d 1.2 to 2 that is 1.0 to 1.7 N s/m^3 at walking speed,
    1.4 m/s. A hem swings more slowly, but to and fro, for which c_d is several times as large (Keulegan and Carpenter
    1958). So the default is the most that steady air has: with it a dress comes to rest soonest (docs/measured.md).
    """

    coefficient: float = 1.7


@dataclass(frozen=True)
class FabricDamping:
    """Damping within the fabric; `time` s is beta of the force -beta H v (effects/fabric_damping.py).

    A mode of frequency f is damped by the ratio pi f beta of critical: 5 ms is 13 % at 8 Hz and 3 % at 2 Hz, at which
    cloth swings. That is what tensile tests of fabrics say: a cycle that gives back 55 to 70 % of its work has the loss
    factor 0.05 to 0.07, 2 pi f beta.
    """

    time: float = 5e-3


@dataclass(frozen=True)
class Sewing:
    """Open seams being drawn together while a garment is dressed.

    `stitches` (S, 2) int32 vertex pairs, each held by a spring of `stiffness` N/m at `share` of the way it was apart at
    the start; the contribution's value "share" (1,) is lowered from 1 to 0.
    """

    stitches: np.ndarray
    stiffness: float


@dataclass(frozen=True)
class Attached:
    """Cloth sewn flat onto other cloth, as a pocket is: each of `vertices` (K,) int32 is drawn by a spring of
    `stiffness` N/m to the place on the cloth beneath that `weights` (K, 3) of the vertices `onto` (K, 3) int32 say.

    How far it stays off, the contact between the two says.
    """

    vertices: np.ndarray
    onto: np.ndarray
    weights: np.ndarray
    stiffness: float


@dataclass(frozen=True)
class Pins:
    """Cloth held or led by springs: `vertices` (K,) int32, each once, held where they start by `stiffness` N/m.

    The contribution's value "places" (K,) vec3 m may be written between steps: the vertices follow.
    """

    vertices: np.ndarray
    stiffness: float = 2e4

    def __post_init__(self) -> None:
        if not 0 <= self.stiffness < float("inf"):
            raise ValueError(f"pins: stiffness must be a finite number of at least 0 N/m, not {self.stiffness!r}")
        once, count = np.unique(self.vertices, return_counts=True)
        if (count > 1).any():
            raise ValueError(f"pins: vertex {int(once[np.argmax(count)])} is listed twice; list it once")


@dataclass(frozen=True)
class Sleep:
    """Cloth that hangs still on a body that stands still is left as it is until something moves.

    It falls asleep when for `time` s the cloth was no faster than `speed` m/s RMS, and no vertex of cloth or collision
    surface faster than `fastest` m/s. It wakes when a point of the skin is more than `shift` m from where it was then.
    Whoever changes something else, such as a contribution's values, wakes the simulation (Simulation.wake).
    """

    speed: float = 1e-3
    fastest: float = 2.5e-3
    time: float = 0.5
    shift: float = 1e-4


Effect = (
    Gravity
    | BodyContact
    | SelfContact
    | Friction
    | StrainLimit
    | AirDrag
    | FabricDamping
    | Sewing
    | Attached
    | Pins
    | Sleep
)

WORN: tuple[Effect, ...] = (
    Gravity(),
    BodyContact(),
    SelfContact(),
    Friction(),
    StrainLimit(),
    AirDrag(),
    FabricDamping(),
)

LIVE: tuple[Effect, ...] = (*WORN, Sleep())
"""What is worn, and left alone while nothing moves."""


@dataclass(frozen=True)
class Scene:
    """A garment on a body.

    `garment` welded triangles; `x_start` (N, 3) float64 m, an intersection-free position of its vertices; `body` a
    posed body's model, a sequence of meshes, or None; `effects` what the scene calls for: what is not listed costs
    nothing. `panel_fabrics`: the fabric of each panel where they differ; thickness and friction are `fabric`'s in all.
    """

    garment: Garment
    x_start: np.ndarray
    body: WornBody | None = None
    fabric: Fabric = field(default_factory=lambda: FABRICS["cotton_jersey"])
    effects: tuple[Effect, ...] = WORN
    panel_fabrics: tuple[Fabric, ...] = ()

    def __post_init__(self) -> None:
        if self.x_start.shape != (self.garment.vertex_count, 3):
            raise ValueError(
                f"x_start has shape {self.x_start.shape}, the garment has {self.garment.vertex_count} vertices"
            )
        if not np.isfinite(self.x_start).all():
            bad = int(np.flatnonzero(~np.isfinite(self.x_start).all(axis=1))[0])
            raise ValueError(f"x_start: vertex {bad} is not a finite position")
        self._check_panel_fabrics()
        for effect in self.effects:
            if isinstance(effect, Pins) and len(effect.vertices):
                first, last = int(effect.vertices.min()), int(effect.vertices.max())
                if first < 0 or last >= self.garment.vertex_count:
                    bad = first if first < 0 else last
                    raise ValueError(f"pins: there is no vertex {bad}; the garment has {self.garment.vertex_count}")
        kinds = [type(effect) for effect in self.effects]
        for kind in kinds:
            if kinds.count(kind) > 1:
                raise ValueError(f"effects: {kind.__name__} is listed twice; list it once")
        if self.body is None and BodyContact in kinds:
            raise ValueError("effects: BodyContact needs a body; give the scene one or leave the effect out")

    def _check_panel_fabrics(self) -> None:
        panels = int(self.garment.panel_of_face.max()) + 1
        if len(self.panel_fabrics) not in (0, panels):
            count = len(self.panel_fabrics)
            raise ValueError(f"panel_fabrics: {count} fabrics for {panels} panels; give one for each")
        for panel, fabric in enumerate(self.panel_fabrics):
            for name in ("thickness", "mu_body", "mu_self"):
                own, all_ = getattr(fabric, name), getattr(self.fabric, name)
                if own != all_:
                    raise ValueError(
                        f"panel_fabrics: {name} of panel {panel} is {own}, the scene's fabric has {all_}; contact "
                        "knows one for all panels"
                    )

    def fabric_of_face(self) -> list[Fabric]:
        """(F,) each triangle's fabric."""
        if not self.panel_fabrics:
            return [self.fabric] * len(self.garment.faces)
        return [self.panel_fabrics[panel] for panel in self.garment.panel_of_face]

    def of_fabrics(self, *names: str) -> np.ndarray:
        """(F, len(names)) float64: these numbers of each triangle's fabric."""
        fabrics = self.panel_fabrics or (self.fabric,)
        values = np.array([[getattr(fabric, name) for name in names] for fabric in fabrics], np.float64)
        panels = self.garment.panel_of_face if self.panel_fabrics else np.zeros(len(self.garment.faces), np.int64)
        return values[panels]

    def vertex_masses(self) -> np.ndarray:
        """(N,) kg, a third of the mass of the triangles around each vertex."""
        garment = self.garment
        if not self.panel_fabrics:
            return self.fabric.areal_density * garment.vertex_areas()
        density = self.of_fabrics("areal_density")[:, 0]
        return np.bincount(
            garment.faces.ravel(), np.repeat(density * garment.signed_areas() / 3, 3), garment.vertex_count
        )
