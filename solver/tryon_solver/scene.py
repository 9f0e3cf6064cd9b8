"""What is to be simulated: garment, fabric, body, and the effects the scene calls for. No device arrays here."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from tryon_solver.checks import check_numbers, check_tuple, told
from tryon_solver.effect_spec import EffectSpec
from tryon_solver.effect_specs import (
    Adhesion,
    AirDrag,
    BodyContact,
    FabricDamping,
    Friction,
    Gas,
    Gravity,
    Gusts,
    Pressure,
    SelfContact,
    Sleep,
    StrainLimit,
    StretchCurves,
    Wind,
)
from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import FABRICS, Fabric
from tryon_solver.sewn_specs import (
    SHARPEST_CREASE,
    Attached,
    Creases,
    Elastic,
    ElasticLine,
    Fasteners,
    Pins,
    Sewing,
)

if TYPE_CHECKING:
    from tryon_solver.body.on_device import WornBody

__all__ = [
    "LIVE",
    "SHARPEST_CREASE",
    "WORN",
    "Adhesion",
    "AirDrag",
    "Attached",
    "BodyContact",
    "Creases",
    "Effect",
    "EffectSpec",
    "Elastic",
    "ElasticLine",
    "FabricDamping",
    "Fasteners",
    "Friction",
    "Gas",
    "Gravity",
    "Gusts",
    "Pins",
    "Pressure",
    "Scene",
    "SelfContact",
    "Sewing",
    "Sleep",
    "StrainLimit",
    "StretchCurves",
    "Wind",
]

Effect = EffectSpec

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


FARTHEST_START = 2.0**14
"""m from the origin along an axis. Beyond, float32 resolves no more than 2 mm, the gap at which contact begins to act:
nothing is between far and touching."""


@dataclass(frozen=True)
class Scene:
    """A garment on a body.

    `garment` welded triangles; `x_start` (N, 3) float64 m, an intersection-free position of its vertices, best within a
    few metres of the origin and no farther than FARTHEST_START; `body` a posed body's model, a sequence of meshes, or
    None; `effects` what the scene calls for: what is not listed costs nothing. `panel_fabrics`: the fabric of each
    panel where they differ; thickness and friction are `fabric`'s in all, or one for each garment of an outfit
    (geometry/outfit.py). Raises ValueError for what suits no scene, or not this one, by field, place and remedy.
    """

    garment: Garment
    x_start: np.ndarray
    body: WornBody | None = None
    fabric: Fabric = field(default_factory=lambda: FABRICS["cotton_jersey"])
    effects: tuple[Effect, ...] = WORN
    panel_fabrics: tuple[Fabric, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.garment, Garment):
            raise ValueError(f"garment is {told(self.garment)}; give a Garment")
        self._check_start()
        if self.body is not None and not hasattr(self.body, "on_device"):
            raise ValueError(f"body is {told(self.body)}; give a body's model, a sequence of meshes, or None for none")
        if not isinstance(self.fabric, Fabric):
            raise ValueError(f'fabric is {told(self.fabric)}; give a Fabric, as FABRICS["denim"]')
        self._check_panel_fabrics()
        check_tuple("effects", self.effects, EffectSpec, "Gravity()")
        kinds = [type(effect) for effect in self.effects]
        for kind in kinds:
            if kinds.count(kind) > 1:
                raise ValueError(f"effects: {kind.__name__} is listed twice; list it once")
        for effect in self.effects:
            effect.check(self)

    def _check_start(self) -> None:
        check_numbers("x_start", self.x_start, self.garment.vertex_count, 3)
        if np.abs(self.x_start).max() > FARTHEST_START:  # along rows it takes a hundred times as long
            far = np.abs(self.x_start).max(axis=1)
            bad = int(far.argmax())
            raise ValueError(
                f"x_start: vertex {bad} is {far[bad]:.6g} m from the origin along an axis, where float32 is too coarse "
                f"for contact; put garment and body within {FARTHEST_START:g} m of it, better within a few"
            )

    def _check_panel_fabrics(self) -> None:
        check_tuple("panel_fabrics", self.panel_fabrics, Fabric, 'FABRICS["denim"]')
        panels = self.garment.panel_count
        if len(self.panel_fabrics) not in (0, panels):
            count = len(self.panel_fabrics)
            raise ValueError(f"panel_fabrics: {count} fabrics for {panels} panels; give one for each")
        layers = self.garment.layers
        first = [layer.panels.start for layer in layers for _ in range(layer.panels.start, layer.panels.stop)]
        for panel, fabric in enumerate(self.panel_fabrics):
            common = self.panel_fabrics[first[panel]] if layers else self.fabric
            for name in ("thickness", "mu_body", "mu_self"):
                own, all_ = getattr(fabric, name), getattr(common, name)
                if own != all_:
                    whose = "the first panel of its garment" if layers else "the scene's fabric"
                    raise ValueError(
                        f"panel_fabrics: {name} of panel {panel} is {own}, {whose} has {all_}; contact knows one for "
                        "all panels of a garment"
                    )

    def fabric_of_garments(self) -> list[Fabric]:
        """The fabric of each garment, from the innermost outwards, as contact knows it: one of a garment alone."""
        layers = self.garment.layers
        if not layers or not self.panel_fabrics:
            return [self.fabric] * max(1, len(layers))
        return [self.panel_fabrics[layer.panels.start] for layer in layers]

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
