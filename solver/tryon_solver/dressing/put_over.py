"""Putting a garment on over what is worn: its pieces are placed outside of that, sewn around it and welded, with all
that is worn simulated along; then all of it settles. Every state on the way is free of penetration.

What is put on later lies outside. What is beneath gives while the pieces are drawn together, without gravity; weak
springs keep it about where it hung. What is too tight so is let out, put on and taken in again (take_in.py): a skirt's
waist goes on over a shirt that way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_solver.body.on_device import WornBody
from tryon_solver.dressing.dress import ROUNDS, Progress, Sewn, place, settle, sew, tell_nobody, told_as
from tryon_solver.dressing.fit import CrumpledError, TightError, check_rest, unforeseen_refused, with_mesh
from tryon_solver.dressing.outfit import Beneath, Outfit, Worn, WornOutfit
from tryon_solver.dressing.take_in import ALL_BUT_ON, LET_OUT, TakenIn, meets_more_cloth, no_room, take_in
from tryon_solver.dressing.untangle import untangle
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.placement import PlacementError
from tryon_solver.geometry.proximity import Surface
from tryon_solver.geometry.size import in_size
from tryon_solver.geometry.weld import weld
from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import WORN, Effect, Gravity
from tryon_solver.settings import Settings
from tryon_solver.simulation import Simulation, build


def put_over(
    worn: WornOutfit,
    name: str,
    panels: PanelMesh,
    fabric: Fabric,
    effects: tuple[Effect, ...] = WORN,
    settle_seconds: float = 1.0,
    progress: Progress = tell_nobody,
) -> WornOutfit:
    """Put the garment on over the outfit `worn`, which hangs on a body in the stance for that, and let all settle.

    The outfit that is given stays as it is. `name` is one that no other garment of it has. Raises PlacementError,
    GarmentError or DressingError with advice, as `dress`, a TightError of how much room is missing; ValueError for a
    name that comes twice.
    """
    over = _Over(worn, name, panels, fabric, effects, settle_seconds, progress)
    with unforeseen_refused("the pieces can't be sewn over what is worn"):
        simulation = over.on()
    progress("dressed", 1.0)
    return WornOutfit(over.outfit(panels), simulation, worn.pose)


class NotLetOutError(Exception):
    """In no larger size a garment was sewn over what is worn."""


@dataclass(frozen=True, eq=False)
class _Over:
    """The garment that is put on; arguments as those of put_over."""

    worn: WornOutfit
    name: str
    panels: PanelMesh
    fabric: Fabric
    effects: tuple[Effect, ...]
    settle_seconds: float
    progress: Progress

    @property
    def body(self) -> WornBody:
        """Whom it is put on."""
        body = self.worn.simulation.scene.body
        assert body is not None
        return body

    @property
    def settings(self) -> Settings:
        """How it is solved."""
        return self.worn.simulation.settings.by_budget()

    def outfit(self, panels: PanelMesh) -> Outfit:
        """All that is worn with it, which is made of these pieces."""
        return self.worn.outfit.with_outermost(Worn.of_pattern(self.name, panels, weld(panels), self.fabric))

    def on(self) -> Simulation:
        """All of it at rest: sewn in its own size, or let out for it and taken in again. What is most likely to go on
        is tried first: a size that does not takes longest, pressed against cloth until the end."""
        if meets_more_cloth(self.panels, Beneath.of(self.worn), self.body.faces):
            try:
                return self.let_out_and_taken_in()
            except NotLetOutError:
                return self.in_its_own_size()
        try:
            return self.in_its_own_size()
        except TightError as refused:
            try:
                return self.let_out_and_taken_in()
            except NotLetOutError:
                raise self._no_room(refused, np.inf) from refused

    def in_its_own_size(self) -> Simulation:
        """All of it at rest, sewn as it is worn."""
        sewn = self.sewn(self.panels)
        return self.settled(np.vstack([sewn.beneath, sewn.x]), sewn.surface, sewn.fault)

    def sewn(self, panels: PanelMesh) -> Sewn:
        """The pieces, these or those of another size, sewn over what is worn."""
        body, settings, device = self.body, self.settings, self.worn.simulation.device
        beneath = Beneath.of(self.worn)
        self.progress("placing", 0.0)
        thickest = max(self.fabric.thickness, *(one.fabric.thickness for one in self.worn.outfit.worn))
        clearance = settings.body_offset + 0.5 * thickest + settings.d_hat
        x_start = place(panels, beneath.surface, body.faces, clearance, surfaces_of(beneath))
        pose = self.worn.pose
        return sew(panels, weld(panels), x_start, body, pose, self.fabric, settings, device, self.progress, beneath)

    def settled(self, x: np.ndarray, surface: np.ndarray, fault: CrumpledError | None) -> Simulation:
        """All of it at rest, from x (N, 3) m and the body's surface (B, 3) m, which may cross because of the fault."""
        outfit = self.outfit(self.panels)
        with told_as(fault):
            simulation = self._free(outfit, x, surface, fault, self.effects)
            settle(simulation, self.worn.pose, self.settle_seconds, self.progress)
            check_rest(simulation, outfit.piece_names)
        return simulation

    def let_out_and_taken_in(self) -> Simulation:
        """All of it at rest, sewn in a larger size first. Raises TightError where there is no room for it,
        NotLetOutError where it can't be sewn in a larger size either."""
        refused, bears, too_tight = None, np.inf, 0.0
        for size in LET_OUT:
            if size < too_tight:
                continue
            try:
                taken_in = self._taken_in(size)
            except (TightError, PlacementError):
                too_tight = size
                continue
            try:
                return self.settled(taken_in.x, taken_in.surface, None)
            except TightError as error:
                if taken_in.bears <= bears:
                    refused, bears = error, taken_in.bears
            if bears > ALL_BUT_ON:
                break
        if refused is None:
            raise NotLetOutError
        raise self._no_room(refused, bears) from refused

    def _taken_in(self, size: float) -> TakenIn:
        """Sewn in this size over its own and taken in from there, without gravity: one holds a skirt up by its waist
        as one closes it. Where it falls meanwhile, what is heavier comes as far as the hips, which are too wide."""
        wide = in_size(self.panels, size)
        sewn, outfit = self.sewn(wide), self.outfit(wide)
        held = tuple(effect for effect in self.effects if not isinstance(effect, Gravity))
        x = np.vstack([sewn.beneath, sewn.x])
        with told_as(sewn.fault):
            simulation = self._free(outfit, x, sewn.surface, sewn.fault, held)
            return take_in(simulation, self.worn.pose, outfit.layers[-1].faces, size, self.progress)

    def _free(
        self,
        outfit: Outfit,
        x: np.ndarray,
        surface: np.ndarray,
        fault: CrumpledError | None,
        effects: tuple[Effect, ...],
    ) -> Simulation:
        """The outfit's simulation, which begins there, freed of what crosses because of the fault."""
        scene = outfit.scene(x, self.body, effects)
        tangled = fault is not None
        simulation = build(scene, self.settings, self.worn.simulation.device, self.worn.pose, surface, tangled)
        if tangled:
            untangle(simulation, rounds=ROUNDS)
        return simulation

    def _no_room(self, error: TightError, bears: float) -> TightError:
        """What to say of one that no less than this size over its own goes on."""
        own = self.outfit(self.panels).worn[-1]
        told = no_room(error, own, Beneath.of(self.worn), bears, self.body.faces)
        return with_mesh(told, self.fabric, own.garment.mean_edge_length())


def surfaces_of(beneath: Beneath) -> tuple[Surface, ...]:
    """Each garment of it as a surface that pieces are placed clear of."""
    garment, layers = beneath.outfit.garment, beneath.outfit.layers
    return tuple(Surface(beneath.x, garment.faces[layer.faces]) for layer in layers)
