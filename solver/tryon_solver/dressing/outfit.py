"""What is worn together, from the innermost garment outwards, and the scene that simulates it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tryon_solver.body.on_device import WornBody
from tryon_solver.dressing.stitching_on import stitched_on
from tryon_solver.geometry.garment import Garment, Layer
from tryon_solver.geometry.outfit import put_together
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.weld import WeldedMesh
from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import Attached, Effect, Pins, Scene
from tryon_solver.simulation import Simulation

HOLD = 4e3  # N/m^3, per area of what is beneath: half a millimetre of its weight


@dataclass(frozen=True, eq=False)
class Worn:
    """One garment of an outfit, under a name that no other there has: what is simulated of it and its fabric; the
    meshed pieces and how they are sewn, where it was made of a pattern; the names of its pieces."""

    name: str
    garment: Garment
    fabric: Fabric
    piece_names: tuple[str, ...]
    panels: PanelMesh | None = None
    welded: WeldedMesh | None = None

    @staticmethod
    def of_pattern(name: str, panels: PanelMesh, welded: WeldedMesh, fabric: Fabric) -> Worn:
        """The pieces, sewn as `welded`."""
        return Worn(name, welded.garment(), fabric, panels.panel_names, panels, welded)

    def stitches(self) -> tuple[Attached, ...]:
        """What holds pieces of it that lie on others, if there are such."""
        if self.panels is None or self.welded is None:
            return ()
        found = stitched_on(self.panels, self.welded.welded_of_vertex, self.fabric)
        return tuple(effect for effect in found if isinstance(effect, Attached))


@dataclass(frozen=True, eq=False)
class Outfit:
    """Garments that are worn together, from the innermost outwards; at least one."""

    worn: tuple[Worn, ...]

    @cached_property
    def garment(self) -> Garment:
        """All of them as one. Raises ValueError for a name that comes twice."""
        return put_together([one.name for one in self.worn], [one.garment for one in self.worn])

    @property
    def layers(self) -> tuple[Layer, ...]:
        """Where in the outfit each garment is."""
        garment = self.garment
        if garment.layers:
            return garment.layers
        everything = slice(0, garment.vertex_count), slice(0, len(garment.faces)), slice(0, garment.panel_count)
        return (Layer(self.worn[0].name, *everything),)

    @property
    def piece_names(self) -> tuple[str, ...]:
        """Of all panels; where there are several garments, with the garment's name and a slash before each."""
        if len(self.worn) == 1:
            return self.worn[0].piece_names
        return tuple(f"{one.name}/{piece}" for one in self.worn for piece in one.piece_names)

    def panel_fabrics(self) -> tuple[Fabric, ...]:
        """The fabric of each panel; () of a garment alone."""
        if len(self.worn) == 1:
            return ()
        return tuple(one.fabric for one in self.worn for _ in range(one.garment.panel_count))

    def stitches(self) -> tuple[Attached, ...]:
        """The stitches that hold pockets and patches of all garments, as stiff as the stiffest fabric asks for."""
        found = [(layer.vertices.start, spec) for layer, one in zip(self.layers, self.worn) for spec in one.stitches()]
        if not found:
            return ()
        return (
            Attached(
                np.concatenate([first + spec.vertices for first, spec in found]),
                np.concatenate([first + spec.onto for first, spec in found]),
                np.concatenate([spec.weights for _, spec in found]),
                max(spec.stiffness for _, spec in found),
            ),
        )

    def scene(self, x: np.ndarray, body: WornBody | None, effects: Sequence[Effect]) -> Scene:
        """The outfit with its vertices at x (N, 3) m; `effects` besides the stitches that its patterns call for."""
        every = (*effects, *self.stitches())
        return Scene(self.garment, x, body, self.worn[0].fabric, every, self.panel_fabrics())

    def with_outermost(self, one: Worn) -> Outfit:
        """The outfit with this garment over all others."""
        return Outfit((*self.worn, one))

    def without(self, *names: str) -> Outfit:
        """The outfit without the garments of these names, at least one. Raises ValueError where that leaves none, or
        there is none of a name."""
        left = tuple(one for one in self.worn if one.name not in names)
        if not left or not set(names) <= {one.name for one in self.worn}:
            worn, off = (", ".join(each) for each in ([one.name for one in self.worn], map(repr, names)))
            raise ValueError(f"of the outfit of {worn}, {off} can't be taken off")
        return Outfit(left)


@dataclass(frozen=True, eq=False)
class WornOutfit:
    """An outfit that is simulated, and the body's stance in which it was put on: a Pose, or a Moment of a sequence."""

    outfit: Outfit
    simulation: Simulation
    pose: Any


@dataclass(frozen=True, eq=False)
class Beneath:
    """What a garment is put on over: the outfit, with its vertices at x (N, 3) m, and the body's collision surface
    (B, 3) m as it presses it in."""

    outfit: Outfit
    x: np.ndarray
    surface: np.ndarray

    @staticmethod
    def of(worn: WornOutfit) -> Beneath:
        """As it hangs now."""
        x, surface = worn.simulation.cloth_positions(), worn.simulation.body_positions()
        return Beneath(worn.outfit, x.astype(np.float64), surface.astype(np.float64))

    def held(self) -> Pins:
        """What keeps it about where it hangs while there is no gravity: springs as weak as its weight is."""
        area = self.outfit.garment.vertex_areas().mean()
        return Pins(np.arange(len(self.x), dtype=np.int32), HOLD * area)
