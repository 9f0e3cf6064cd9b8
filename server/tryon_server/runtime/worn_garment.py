"""One garment of what a session wears: what is simulated of it, the pattern that it was made of, and its edits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from tryon_server.runtime.drape import GarmentPart
from tryon_server.runtime.worn_pattern import Shapes, WornPattern
from tryon_solver.dressing.outfit import Outfit, Worn
from tryon_solver.geometry.garment import Garment, Layer
from tryon_solver.geometry.outfit import taken_out
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.size import in_size
from tryon_solver.geometry.weld import weld
from tryon_solver.live_edit import LiveEdit
from tryon_solver.redesign.drag import Drag
from tryon_solver.simulation import Simulation


@dataclass(eq=False)
class WornGarment:
    """As it was put on; `pattern` is None of a mesh. A `drag` is made ready with it, or not; `edit` and `shapes` once
    somebody has asked for them. `shown` is the pattern, plain JSON, whose shape it has or is on its way to."""

    worn: Worn
    pattern: WornPattern | None
    drag: Drag | None = None
    edit: LiveEdit | None = None
    shapes: Shapes | None = None
    shown: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        self.shown = self.shown or self.specification

    @property
    def specification(self) -> Mapping[str, Any] | None:
        """The pattern that its mesh was made of, plain JSON."""
        return None if self.pattern is None else self.pattern.specification

    def drag_in_parts(self) -> Iterator[None]:
        """Make its drag ready, if it has a pattern."""
        if self.pattern is not None:
            for drag in self.pattern.drag_in_parts(self.worn.fabric.thickness):
                self.drag = drag
                yield None

    def begun_edit(self, sim: Simulation, layer: Layer | None) -> LiveEdit:
        """Its edit, begun if it was not; `layer` is where in an outfit it is."""
        if self.edit is None:
            assert self.pattern is not None
            if self.drag is None:
                for _ in self.drag_in_parts():
                    pass
            assert self.drag is not None
            self.edit = LiveEdit(sim, self.drag, self.pattern.size, layer)
        return self.edit

    def shape_of(self) -> Shapes:
        """What finds the shapes of other patterns in its mesh, in any process."""
        if self.shapes is None:
            assert self.pattern is not None
            self.shapes = self.pattern.shapes(self.worn.fabric.thickness)
        return self.shapes

    def mesh_now(self) -> PanelMesh:
        """Its mesh as it is worn now, in the size that is worn."""
        assert self.pattern is not None
        return self.pattern.panels if self.edit is None else in_size(self.edit.now, self.pattern.size)

    def mesh_wanted(self) -> PanelMesh:
        """The same, as it is wanted."""
        assert self.pattern is not None
        return self.pattern.panels if self.edit is None else in_size(self.edit.wanted, self.pattern.size)

    def arrived(self, garment: Garment, layer: Layer | None) -> WornGarment:
        """In its shape of now, as one that was made so: of the `garment` that is simulated, where its edit stands."""
        if self.edit is None:
            return self
        own = garment if layer is None else taken_out(garment, layer)
        worn = replace(self.worn, garment=own, panels=self.mesh_now())
        assert self.pattern is not None
        assert self.shown is not None
        return WornGarment(worn, replace(self.pattern, panels=self.mesh_now(), specification=self.shown))


def alone(sim: Simulation, names: tuple[str, ...], pattern: WornPattern | None, name: str = "") -> WornGarment:
    """The only garment that is simulated; `names` of its pieces."""
    scene = sim.scene
    panels = None if pattern is None else pattern.panels
    welded = None if panels is None else weld(panels)
    return WornGarment(Worn(name, scene.garment, scene.fabric, names, panels, welded), pattern)


def in_shape(garments: Sequence[WornGarment]) -> Outfit:
    """All of these, in the shapes that they have by now."""
    panels = (None if one.pattern is None else one.mesh_now() for one in garments)
    return Outfit(tuple(replace(one.worn, panels=mesh) for one, mesh in zip(garments, panels)))


def piece_names_of(garments: Sequence[WornGarment]) -> tuple[str, ...]:
    """As clients are told them."""
    return Outfit(tuple(one.worn for one in garments)).piece_names


def told_of(garments: Sequence[WornGarment]) -> tuple[GarmentPart, ...]:
    """What clients are told of each; () of garments without names."""
    if not all(one.worn.name for one in garments):
        return ()
    layers = Outfit(tuple(one.worn for one in garments)).layers
    return tuple(GarmentPart(one.worn.fabric.name, layer) for one, layer in zip(garments, layers))
