"""A garment that the solver simulates, as the server's worker drives it: moved, given other shapes and other cuts, and
put away."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from tryon_server.runtime.coming_by import WAITS, comes_by
from tryon_server.runtime.coming_to import ComingTo
from tryon_server.runtime.cutting import Cut, Cutting
from tryon_server.runtime.drape import Asked, Outfit
from tryon_server.runtime.effect_binding import SolverEffects, cut_of, in_other_garments
from tryon_server.runtime.worn_garment import WornGarment, in_shape, piece_names_of, told_of
from tryon_server.runtime.worn_pattern import Shapes, WornPattern
from tryon_solver.body.mesh_sequence import MeshSequence
from tryon_solver.body.model import BodyModel
from tryon_solver.build_in_parts import build_in_parts
from tryon_solver.drawn import drawing, drawn_with, in_both, let_go, without_draw
from tryon_solver.dressing.carry_over import CarryError, prepare, put_on
from tryon_solver.dressing.change_outfit import recut, without
from tryon_solver.dressing.opening import Opening
from tryon_solver.dressing.outfit import Outfit as Together
from tryon_solver.dressing.outfit import Worn, WornOutfit
from tryon_solver.dressing.returned import REACHES, Hung
from tryon_solver.geometry.garment import GarmentError, Layer
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.piece_meshes import keep, kept
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.rebind import take_over, with_settings
from tryon_solver.redesign.drag import Shape
from tryon_solver.redesign.parsed import parsed
from tryon_solver.redesign.remesh import Remesh
from tryon_solver.redesign.slack import Slack
from tryon_solver.redesign.structure import difference
from tryon_solver.reshape import OtherStructureError
from tryon_solver.results import StepReport
from tryon_solver.scene import Effect, Scene
from tryon_solver.settings import PRESETS, Settings, preset_of
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
        garments: Sequence[WornGarment],
        body: BodyModel,
        notes: tuple[str, ...] = (),
        opening: Opening | None = None,
        size: float | None = None,
        asked: Asked | None = None,
    ) -> None:
        """`pose` is the stance in which it was dressed; `garments` what is worn, from the innermost outwards; `body`
        the body as told to clients; `notes` and `size` as in Outfit; `opening` the one by which the garment hangs,
        where it hangs by one; `asked` the effects that it is worn with, where they are not the usual ones and those of
        its patterns."""
        self.simulation = simulation
        self._dressed_at = simulation.state.time
        garment = simulation.scene.garment
        self.outfit = Outfit(
            vertex_count=garment.vertex_count,
            faces=garment.faces,
            uv=garment.uv_corners if garment.spline_corners is None else garment.spline_corners,
            panel_of_face=garment.panel_of_face,
            panel_names=piece_names_of(garments),
            body=body,
            fit="" if opening is None else opening.advice,
            fitting_size=None if opening is None else opening.advised_size,
            notes=notes,
            size=size,
            garments=told_of(garments),
        )
        self.garments = tuple(garments)
        self.edited = self.garments[0].worn.name
        self.pose = pose
        self.own_motion: MeshSequence | None = None
        self.origin = np.zeros(3)
        self.outgrown = self.not_carried = ""
        self.waiting, self.went = False, 0.0
        self._stance, self._time = pose, 0.0  # of the last advance
        self._coming_to: ComingTo | None = None
        self.effects = SolverEffects(self, asked)

    @property
    def notes(self) -> tuple[str, ...]:
        """How garment and body were read, and what there is to say of the fit, for people."""
        return (*self.outfit.notes, f"fit: {self.outfit.fit}") if self.outfit.fit else self.outfit.notes

    @property
    def names(self) -> tuple[str, ...]:
        """Of the garments that are worn, from the innermost outwards."""
        return tuple(one.worn.name for one in self.garments)

    @property
    def own(self) -> WornGarment:
        """The garment that is edited."""
        return self.garments[self.names.index(self.edited)]

    @property
    def specification(self) -> Mapping[str, Any] | None:
        """The pattern that its mesh was made of, of the garment that is edited."""
        return self.own.specification

    @property
    def specifications(self) -> Mapping[str, Mapping[str, Any] | None]:
        """The pattern of each garment, by name."""
        return {one.worn.name: one.specification for one in self.garments}

    def size_of(self, name: str) -> float | None:
        """In which the pattern of the garment of this name is worn, over its own; None of a mesh."""
        pattern = self.garments[self.names.index(name)].pattern
        return None if pattern is None else pattern.size

    def edit_garment(self, name: str) -> None:
        """Edits are of this garment from now on."""
        assert name in self.names, name
        self.edited = name

    @property
    def stance(self) -> Any:
        """Where the body is, as the last ``advance`` had it."""
        return self._stance

    @property
    def seconds(self) -> float:
        """Simulated, until the last ``advance``, since it was dressed [s]."""
        return self._time

    def stay(self) -> None:
        """Be as one that was dressed just now, where it is."""
        self.pose, self._dressed_at, self._time = self._stance, self.simulation.state.time, 0.0

    def layer_of(self, name: str) -> Layer | None:
        """Where in an outfit the garment of this name is; None where it is alone."""
        return next((layer for layer in self.simulation.scene.garment.layers if layer.name == name), None)

    def reshape(self, specification: Mapping[str, Any], shape: Shape | Remesh | None = None) -> str:
        """Take on the pattern's shape, which `shape_of` found if it is given; why that needs another mesh, or ""."""
        own, self.outgrown = self.own, ""
        assert own.specification is not None
        if isinstance(shape, Remesh):
            return shape.message
        if shape is None and own.edit is None:
            structure = difference(parsed(own.specification), parsed(specification))
            if structure is not None:  # told without what a drag begins with, which takes longer than a frame
                return structure.message
        edit = own.begun_edit(self.simulation, self.layer_of(self.edited))
        remesh = edit.want(parsed(specification)) if shape is None else edit.want_mesh(edit.drag.mesh_in(shape))
        if remesh is not None:
            return remesh.message
        own.shown = specification
        return ""

    @property
    def overstretched(self) -> float:
        """Share of the edited garment's triangles that are stretched by more than their fabric bears."""
        sim, layer = self.simulation, self.layer_of(self.edited)
        beyond = sim.stretches() > sim.scene.of_fabrics("strain_limit")[:, 0]
        return float(np.mean(beyond if layer is None else beyond[layer.faces]))

    @property
    def on_the_way(self) -> bool:
        """Has a garment yet to come to the shape that it was last told to take on?"""
        return any(one.edit is not None and not one.edit.there for one in self.garments)

    @property
    def shape_of(self) -> Shapes:
        """What finds the shapes of other patterns in the edited garment's mesh, in any process."""
        return self.own.shape_of()

    def arrive(self, specification: Mapping[str, Any]) -> None:
        """Have the pattern's shape at once, which its mesh has had before."""
        why = self.reshape(specification)
        assert not why, why
        assert self.own.edit is not None
        self.own.edit.arrive()

    def cutting(self, specification: Mapping[str, Any], fabric: str) -> Cutting:
        """What makes the pattern's mesh, beside the simulation, to be worn of this fabric."""
        own = self.own
        assert own.pattern is not None
        spacing, before = self.simulation.settings.subspace_spacing, own.mesh_wanted()
        return Cutting(specification, before, own.pattern.edge_length, own.pattern.size, spacing, fabric, kept())

    def recut(self, cut: Cut, hung: PackedDrape | None = None) -> Iterator[SolverDrape | None]:
        """That mesh put on from where this garment is worn, in parts; none where it can't be. `hung` is how that
        pattern was worn before: cloth of which nothing is worn now is put where it hung."""
        own = self.own
        assert own.pattern is not None
        keep(cut.pieces)
        panels, fabric = cut.made.mesh, FABRICS[cut.fabric]
        pattern = replace(own.pattern, specification=cut.specification, panels=panels)
        new = WornGarment(Worn.of_pattern(self.edited, panels, cut.made.welded, fabric), pattern)
        garments = [new if one is own else one for one in self.garments]
        asked = in_other_garments(self.effects, garments)
        effects = effects_of(asked, cut_of(garments))
        try:
            recut = partial(self._recut_alone, hung) if len(garments) == 1 else self._recut_among
            for made in recut(cut, new, effects):
                yield None if made is None else self._recut_as(*made, garments, asked)
        except (CarryError, GarmentError) as error:
            logger.info("the garment can't be carried over: %s", error)
            self.not_carried = str(error)

    def _recut_alone(
        self, hung: PackedDrape | None, cut: Cut, new: WornGarment, effects: tuple[Effect, ...]
    ) -> Iterator[tuple[Simulation, Slack | None, float] | None]:
        prepared = None
        for made in prepare(self.simulation, cut.made, new.worn.fabric, new.drag_in_parts(), effects):
            prepared = made
            yield None
        assert prepared is not None
        there = None if hung is None else hung.hung
        came_by = True
        for waits in reversed(range(WAITS + 1)):
            for reach in REACHES:
                try:
                    carried = put_on(prepared, self.simulation, self.own.mesh_now(), there, reach)
                    yield carried.simulation, carried.slack, carried.went
                    return
                except CarryError as error:
                    as_hung = error.as_hung and there is not None and came_by and waits > 0
                    if not as_hung and (reach == REACHES[-1] or not error.came_back):
                        raise
                if as_hung:
                    break
                yield None
            if there is not None:
                came_by = yield from comes_by(self, prepared.simulation, there)

    def _recut_among(
        self, cut: Cut, new: WornGarment, effects: tuple[Effect, ...]
    ) -> Iterator[tuple[Simulation, Slack | None, float] | None]:
        worn, fabric, more = self.worn_outfit(), new.worn.fabric, new.drag_in_parts()
        for made in recut(worn, self.edited, cut.made, self.own.mesh_now, fabric, more, effects):
            yield None if made is None else (made.outfit.simulation, made.slack, made.went)

    def worn_outfit(self) -> WornOutfit:
        """All that is worn, in the shapes that their meshes were made in."""
        return WornOutfit(Together(tuple(one.worn for one in self.garments)), self.simulation, self._stance)

    def take_off(self, *names: str) -> Iterator[SolverDrape | None]:
        """The others worn on without the garments of these names, in parts as those of ``recut``."""
        yield from self._taken_off(names)

    def _taken_off(self, names: Sequence[str], towards: SolverDrape | None = None) -> Iterator[SolverDrape | None]:
        """The same, with what is left about to be drawn `towards` where another drape has it."""
        shaped = self.shaped()
        together = Together(tuple(one.worn for one in shaped))
        left = [one for one in shaped if one.worn.name not in names]
        asked = in_other_garments(self.effects, left)
        effects = effects_of(asked, cut_of(left))
        if towards is not None:
            outfit = together.without(*names)
            effects = drawn_with(effects, outfit.garment, in_both(outfit, in_shape(towards.garments)).vertices)
        for made in without(WornOutfit(together, self.simulation, self._stance), *names, effects=effects):
            yield None if made is None else self._gone_on(made.simulation, left, asked)

    def shaped(self) -> list[WornGarment]:
        """What is worn, each garment in the shape that it has taken on, as if it had been made in that: for another
        simulation of it."""
        for one in self.garments:
            if one.edit is not None:
                one.edit.arrive()
        garment = self.simulation.scene.garment
        return [one.arrived(garment, self.layer_of(one.worn.name)) for one in self.garments]

    def _gone_on(self, simulation: Simulation, garments: Sequence[WornGarment], asked: Asked) -> SolverDrape:
        """What is worn from now on, where this was, with these effects."""
        old = self.outfit
        drape = SolverDrape(simulation, self._stance, garments, old.body, old.notes, size=old.size, asked=asked)
        drape.edited = self.edited if self.edited in drape.names else drape.names[-1]
        drape.outfit = replace(drape.outfit, fit=old.fit, fitting_size=old.fitting_size)
        drape.own_motion, drape.origin = self.own_motion, self.origin
        drape._dressed_at, drape._time = -self._time, self._time
        return drape

    def _recut_as(
        self, simulation: Simulation, slack: Slack | None, went: float, garments: Sequence[WornGarment], asked: Asked
    ) -> SolverDrape:
        """The same where the garment that is edited is in a new cut, which begins with this slack and went so far [m]
        to be put on."""
        drape = self._gone_on(simulation, garments, asked)
        drape.went = went
        if slack is not None:
            drape.own.begun_edit(simulation, drape.layer_of(drape.edited)).begin_with(slack)
        return drape

    def packed(self) -> PackedDrape:
        """Itself, as it is worn."""
        sim = self.simulation
        assert sim.body is not None
        garment = sim.scene.garment
        for one in self.garments:
            garment = garment if one.edit is None else one.edit.taken_back(garment)
        x, effects = sim.cloth_positions().astype(np.float64), without_draw(sim.scene.effects)
        scene = replace(sim.scene, garment=garment, x_start=x, effects=effects)
        pose, surface = sim.body.pose, sim.body_positions().astype(np.float64)
        worn = tuple((one.worn, one.pattern, one.shown) for one in self.garments)
        mesh = None if self.own.pattern is None else self.own.mesh_now()
        more = self.outfit, self.own_motion, worn, mesh, self.edited, self.origin, self.effects.asked
        return PackedDrape(scene, sim.settings.by_budget(), sim.device, pose, surface, *more)

    def go_on_in(self, simulation: Simulation) -> None:
        """Be simulated by this one from here on, which is where the one before is."""
        self.simulation = simulation
        for one in self.garments:
            if one.edit is not None:
                one.edit.go_on_in(simulation)

    def leap(self, by: npt.NDArray[np.float64]) -> None:
        """Be elsewhere by (3,) whole metres: nothing changes but where the solver's origin lies."""
        self.origin = self.origin + by
        if self._coming_to is not None:
            self._coming_to.other.leap(by)

    def buy(self, accuracy: float | None, deadline: float | None) -> None:
        """Solve so from the next ``advance`` on: to an error of ``accuracy`` [m], in ``deadline`` [s]."""
        if (self.simulation.settings.accuracy, self.simulation.settings.deadline) != (accuracy, deadline):
            self.simulation.buy(accuracy, deadline)

    @property
    def preset(self) -> str:
        """By which it is solved."""
        return preset_of(self.simulation.settings)

    def solve_as(self, preset: str) -> Iterator[None]:
        """Come to be solved by this preset, in parts, between which it may be advanced; it is after the last."""
        made: Simulation | None = None
        for part in with_settings(self.simulation, PRESETS[preset]):
            made = part
            yield None
        assert made is not None
        take_over(made, self.simulation)
        self.go_on_in(made)

    def come_along(self) -> None:
        """In the next ``advance`` go with the body as if the room moved."""
        self.simulation.come_along()

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
        for one in self.garments:
            if one.edit is not None and not self.outgrown:
                try:
                    one.edit.before_frame(self._dressed_at + t)
                except (GarmentError, OtherStructureError) as error:
                    self.outgrown = str(error)
        self.effects.before_frame(self._dressed_at + t)
        if self._coming_to is not None:
            self._coming_to.before_frame(self, pose, t - self._time)
        report = self.simulation.advance(moving.moved(pose, -self.origin), self._dressed_at + t, longest_step)
        self._stance, self._time = pose, t
        return report

    def come_to(self, other: SolverDrape, way: Iterator[None], off: Sequence[str] = ()) -> Iterator[SolverDrape | None]:
        """What both wear drawn to where `other` has it, once that has come its `way` to where the body is."""
        if off:
            yield from self._come_to_without(other, way, off)
            return
        common = in_both(in_shape(self.garments), in_shape(other.garments))
        if len(common.vertices) == 0:
            yield from way
            return
        made: Simulation | None = None
        for part in drawing(self.simulation, common.vertices):
            made = part
            yield None
        assert made is not None
        yield from way
        before = self.simulation.scene.effects
        take_over(made, self.simulation)
        self.go_on_in(made)
        coming = self._coming_to = ComingTo(other, common)
        try:
            yield from coming.parts()
        finally:
            self._coming_to = None
            if not coming.is_there:  # nobody waits for the other any more: this one is worn on
                self.go_on_in(let_go(self.simulation, before))

    def come_at_once(self) -> None:
        """Be with the next part where `come_to` draws it, if it does, however far that is."""
        if self._coming_to is not None:
            self._coming_to.be_there()

    def _come_to_without(
        self, other: SolverDrape, way: Iterator[None], off: Sequence[str]
    ) -> Iterator[SolverDrape | None]:
        """The other goes along while what is left is made, which is drawn from its first frame on: what a waist was
        held off by is gone at once, and it would snap to the skin."""
        yield from way
        left: SolverDrape | None = None
        along = self._coming_to = ComingTo(other)
        try:
            for left in self._taken_off(off, other):
                if left is None:
                    yield None
                    along.check()
        finally:
            self._coming_to = None
        assert left is not None
        coming = left._coming_to = ComingTo(other, in_both(in_shape(left.garments), in_shape(other.garments)))
        yield left
        try:
            yield from coming.parts()
        finally:
            left._coming_to = None

    def cloth_positions(self) -> npt.NDArray[np.float32]:
        """(N, 3) positions of the cloth [m], from ``origin``."""
        return self.simulation.cloth_positions()

    def body_positions(self) -> npt.NDArray[np.float32]:
        """(B, 3) positions of the body's simulated surface [m], from ``origin``."""
        return self.simulation.body_positions()


@dataclass(frozen=True, eq=False)
class PackedDrape:
    """A worn garment as plain values: what its simulation is built of, `pose` and `surface` (B, 3) m those of the body
    as seen from `origin` (3,) m, and what the drape has besides. Its shape is the one that its mesh was made in; each
    garment of `worn` comes with the pattern that it is made of, and the one whose shape it had taken on; `mesh` is that
    of the one that is edited, None of one without a pattern, in that shape, in the size that is worn."""

    scene: Scene
    settings: Settings
    device: str
    pose: Any
    surface: npt.NDArray[np.float64]
    outfit: Outfit
    own_motion: MeshSequence | None
    worn: tuple[tuple[Worn, WornPattern | None, Mapping[str, Any] | None], ...]
    mesh: PanelMesh | None
    edited: str
    origin: npt.NDArray[np.float64]
    asked: Asked

    @property
    def hung(self) -> Hung | None:
        """The cloth as it hung, of one garment that was made of a pattern; None of others."""
        if self.mesh is None or len(self.worn) > 1:
            return None
        return Hung(self.mesh, self.scene.garment.faces, self.scene.x_start, self.surface, self.pose)

    def solved_as(self, preset: str) -> PackedDrape:
        """The same, solved by this preset once it is unpacked."""
        return replace(self, settings=PRESETS[preset])

    def unpacking(self, specification: Mapping[str, Any] | None = None) -> Iterator[SolverDrape | None]:
        """The garment, at rest, in parts, None after each but the last; in this shape, if its mesh has had it, or in
        the one that it had taken on.

        Raises GarmentError as `build`.
        """
        garments = [WornGarment(worn, pattern) for worn, pattern, _ in self.worn]
        shown = {worn.name: pattern for worn, _, pattern in self.worn}
        shown[self.edited] = specification or shown[self.edited]
        edited = next(one for one in garments if one.worn.name == self.edited)
        step, more = self.settings.largest_step, edited.drag_in_parts()
        parts = build_in_parts(self.scene, self.settings, self.device, self.pose, self.surface, step, None, more)
        for simulation in parts:
            if simulation is None:
                yield None
                continue
            assert simulation.body is not None
            stance = simulation.body.moving.moved(self.pose, self.origin)
            drape = SolverDrape(simulation, stance, garments, self.outfit.body, asked=self.asked)
            for name, pattern in shown.items():
                drape.edit_garment(name)
                if pattern is not None and pattern != drape.specification:
                    drape.arrive(pattern)
            drape.edited = self.edited
            drape.outfit, drape.own_motion, drape.origin = self.outfit, self.own_motion, self.origin
            yield drape
