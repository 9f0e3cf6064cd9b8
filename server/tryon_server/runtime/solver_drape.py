"""A garment that the solver simulates, as the server's worker drives it: moved, given other shapes and other cuts, and
put away."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tryon_server.runtime.cutting import Cut, Cutting
from tryon_server.runtime.drape import Asked, Outfit
from tryon_server.runtime.effect_binding import SolverEffects, cut_of, in_another_cut
from tryon_server.runtime.worn_pattern import Shapes, WornPattern
from tryon_solver.body.mesh_sequence import MeshSequence
from tryon_solver.body.model import BodyModel
from tryon_solver.build_in_parts import build_in_parts
from tryon_solver.dressing.carry_over import CarryError, prepare, put_on
from tryon_solver.dressing.opening import Opening
from tryon_solver.geometry.garment import GarmentError
from tryon_solver.geometry.piece_meshes import keep, kept
from tryon_solver.geometry.size import in_size
from tryon_solver.live_edit import LiveEdit
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.redesign.drag import Drag, Shape
from tryon_solver.redesign.parsed import parsed
from tryon_solver.redesign.remesh import Remesh
from tryon_solver.redesign.structure import difference
from tryon_solver.reshape import OtherStructureError
from tryon_solver.results import StepReport
from tryon_solver.scene import Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import Simulation
from tryon_solver.worn_effects import effects_of

logger = logging.getLogger(__name__)

FARTHEST = 8.0
"""Where the solver's origin is moved along [m]: a root this far from it along an axis. METHOD.md section 13."""


class SolverDrape:
    """A garment dressed by the solver, as the server's worker drives it."""

    def __init__(
        self,
        simulation: Simulation,
        pose: Any,
        panel_names: tuple[str, ...],
        body: BodyModel,
        notes: tuple[str, ...] = (),
        opening: Opening | None = None,
        size: float | None = None,
        worn: WornPattern | None = None,
        asked: Asked | None = None,
    ) -> None:
        """`pose` is the stance in which it was dressed; `body` the body as told to clients; `notes` and `size` as in
        Outfit; `opening` the one by which the garment hangs, where it hangs by one; `worn` the pattern, if there is
        one; `asked` the effects that it is worn with, where they are not the usual ones and those of its pattern."""
        self.simulation = simulation
        self._dressed_at = simulation.state.time
        garment = simulation.scene.garment
        fit = "" if opening is None else opening.advice
        self.outfit = Outfit(
            vertex_count=garment.vertex_count,
            faces=garment.faces,
            uv=garment.uv_corners if garment.spline_corners is None else garment.spline_corners,
            panel_of_face=garment.panel_of_face,
            panel_names=panel_names,
            body=body,
            fit=fit,
            fitting_size=None if opening is None else opening.advised_size,
            notes=notes,
            size=size,
        )
        self.pose = pose
        self.own_motion: MeshSequence | None = None
        self.origin = np.zeros(3)
        self.specification = None if worn is None else worn.specification
        self.outgrown = ""
        self.worn_pattern = self._worn = worn
        self._drag: Drag | None = None  # made ready with the garment, or not
        self._edit: LiveEdit | None = None
        self._shapes: Shapes | None = None  # of which somebody has asked
        self._stance, self._time = pose, 0.0  # of the last advance
        self.effects = SolverEffects(self, panel_names, asked)

    @property
    def notes(self) -> tuple[str, ...]:
        """How garment and body were read, and what there is to say of the fit, for people."""
        outfit = self.outfit
        return (*outfit.notes, f"fit: {outfit.fit}") if outfit.fit else outfit.notes

    def reshape(self, specification: Mapping[str, Any], shape: Shape | Remesh | None = None) -> str:
        """Take on the pattern's shape, which `shape_of` found if it is given; why that needs another mesh, or ""."""
        assert self._worn is not None
        self.outgrown = ""
        if isinstance(shape, Remesh):
            return shape.message
        if shape is None and self._edit is None:
            structure = difference(parsed(self._worn.specification), parsed(specification))
            if structure is not None:  # told without what a drag begins with, which takes longer than a frame
                return structure.message
        edit = self._begun_edit(self._worn)
        remesh = edit.want(parsed(specification)) if shape is None else edit.want_mesh(edit.drag.mesh_in(shape))
        return "" if remesh is None else remesh.message

    def _begun_edit(self, worn: WornPattern) -> LiveEdit:
        if self._edit is None:
            drag = self._drag
            if drag is None:
                *_, drag = worn.drag_in_parts(self.simulation.scene.fabric.thickness)
            assert drag is not None
            self._edit = LiveEdit(self.simulation, drag, worn.size)
        return self._edit

    @property
    def shape_of(self) -> Shapes:
        """What finds the shapes of other patterns in this garment's mesh, in any process."""
        if self._shapes is None:
            assert self._worn is not None
            self._shapes = self._worn.shapes(self.simulation.scene.fabric.thickness)
        return self._shapes

    def arrive(self, specification: Mapping[str, Any]) -> None:
        """Have the pattern's shape at once, which its mesh has had before."""
        why = self.reshape(specification)
        assert not why, why
        assert self._edit is not None
        self._edit.arrive()

    def cutting(self, specification: Mapping[str, Any], fabric: str) -> Cutting:
        """What makes the pattern's mesh, beside the simulation, to be worn of this fabric."""
        worn = self._worn
        assert worn is not None
        before = worn.panels if self._edit is None else in_size(self._edit.wanted, worn.size)
        spacing = self.simulation.settings.subspace_spacing
        return Cutting(specification, before, worn.edge_length, worn.size, spacing, fabric, kept())

    def recut(self, cut: Cut) -> Iterator[SolverDrape | None]:
        """That mesh put on from where this garment is worn, in parts; none where it can't be."""
        worn = self._worn
        assert worn is not None
        keep(cut.pieces)
        panels, fabric = cut.made.mesh, FABRICS[cut.fabric]
        drag: list[Drag | None] = [None]
        own = replace(worn, specification=cut.specification, panels=panels)
        cut_after = cut_of(cut.made.garment, panels.panel_names, own)
        asked = in_another_cut(self.effects, cut_after, parsed(cut.specification).effects)

        def made_ready() -> Iterator[None]:
            for drag[0] in own.drag_in_parts(fabric.thickness):
                yield None

        try:
            prepared = None
            for made in prepare(self.simulation, cut.made, fabric, made_ready(), effects_of(asked, cut_after)):
                prepared = made
                yield None
            assert prepared is not None
            before = worn.panels if self._edit is None else in_size(self._edit.now, worn.size)
            carried = put_on(prepared, self.simulation, before)
        except (CarryError, GarmentError) as error:
            logger.info("the garment can't be carried over: %s", error)
            return
        old, names = self.outfit, panels.panel_names
        drape = SolverDrape(
            carried.simulation, self._stance, names, old.body, old.notes, size=old.size, worn=own, asked=asked
        )
        drape.outfit = replace(drape.outfit, fit=old.fit, fitting_size=old.fitting_size)
        drape.own_motion, drape.origin = self.own_motion, self.origin
        drape._dressed_at, drape._time, drape._drag = -self._time, self._time, drag[0]
        yield drape

    def packed(self) -> PackedDrape:
        """Itself, as it is worn."""
        sim, edit = self.simulation, self._edit
        assert sim.body is not None
        garment = sim.scene.garment if edit is None else edit.first
        scene = replace(sim.scene, garment=garment, x_start=sim.cloth_positions().astype(np.float64))
        pose, surface = sim.body.pose, sim.body_positions().astype(np.float64)
        more = self.outfit, self.own_motion, self._worn, self.origin, self.effects.asked
        return PackedDrape(scene, sim.settings.by_budget(), sim.device, pose, surface, *more)

    def go_on_in(self, simulation: Simulation) -> None:
        """Be simulated by this one from here on, which is where the one before is."""
        self.simulation = simulation
        if self._edit is not None:
            self._edit.go_on_in(simulation)

    def leap(self, by: npt.NDArray[np.float64]) -> None:
        """Be elsewhere by (3,) whole metres: nothing changes but where the solver's origin lies."""
        self.origin = self.origin + by

    def buy(self, accuracy: float | None, deadline: float | None) -> None:
        """Solve so from the next ``advance`` on: to an error of ``accuracy`` [m], in ``deadline`` [s]."""
        settings = self.simulation.settings
        if (settings.accuracy, settings.deadline) != (accuracy, deadline):
            self.simulation.buy(accuracy, deadline)

    def advance(self, pose: Any, t: float, longest_step: float = 0.0) -> StepReport:
        """Simulate from the last pose's time to ``pose`` at time ``t`` [s], counted from the dressing."""
        assert self.simulation.body is not None
        moving = self.simulation.body.moving
        place = moving.place(pose) - self.origin
        far = np.abs(place) > FARTHEST
        if far.any():
            by = np.where(far, np.round(place), 0.0)
            self.simulation.move_origin(by)
            self.origin = self.origin + by
        if self._edit is not None and not self.outgrown:
            try:
                self._edit.before_frame(self._dressed_at + t)
            except (GarmentError, OtherStructureError) as error:
                self.outgrown = str(error)
        report = self.simulation.advance(moving.moved(pose, -self.origin), self._dressed_at + t, longest_step)
        self._stance, self._time = pose, t
        return report

    def cloth_positions(self) -> npt.NDArray[np.float32]:
        """(N, 3) positions of the cloth [m], from ``origin``."""
        return self.simulation.cloth_positions()

    def body_positions(self) -> npt.NDArray[np.float32]:
        """(B, 3) positions of the body's simulated surface [m], from ``origin``."""
        return self.simulation.body_positions()


@dataclass(frozen=True, eq=False)
class PackedDrape:
    """A worn garment as plain values: what its simulation is built of, `pose` and `surface` (B, 3) m those of the body
    as seen from `origin` (3,) m, and what the drape has besides. Its shape is the one that its mesh was made in."""

    scene: Scene
    settings: Settings
    device: str
    pose: Any
    surface: npt.NDArray[np.float64]
    outfit: Outfit
    own_motion: MeshSequence | None
    worn: WornPattern | None
    origin: npt.NDArray[np.float64]
    asked: Asked

    def unpacking(self, specification: Mapping[str, Any] | None = None) -> Iterator[SolverDrape | None]:
        """The garment, at rest, in parts, None after each but the last; in this shape, if its mesh has had it.

        Raises GarmentError as `build`.
        """
        drag: list[Drag | None] = [None]

        def made_ready() -> Iterator[None]:
            if self.worn is not None:
                for drag[0] in self.worn.drag_in_parts(self.scene.fabric.thickness):
                    yield None

        step, more = self.settings.largest_step, made_ready()
        parts = build_in_parts(self.scene, self.settings, self.device, self.pose, self.surface, step, None, more)
        for simulation in parts:
            if simulation is None:
                yield None
                continue
            assert simulation.body is not None
            stance = simulation.body.moving.moved(self.pose, self.origin)
            names, body = self.outfit.panel_names, self.outfit.body
            drape = SolverDrape(simulation, stance, names, body, worn=self.worn, asked=self.asked)
            drape.outfit, drape.own_motion, drape.origin = self.outfit, self.own_motion, self.origin
            drape._drag = drag[0]
            if specification is not None and specification != drape.specification:
                drape.arrive(specification)
            yield drape
