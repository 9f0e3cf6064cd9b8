"""The effects of a garment that the solver simulates: which it is worn with, and how it comes to have others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any, Protocol

import numpy as np
from scipy.spatial import cKDTree

from tryon_server.runtime.drape import Asked, Character
from tryon_server.runtime.worn_pattern import WornPattern
from tryon_solver.effect_words.fields import EffectError
from tryon_solver.effect_words.rules import LINED, Parameters
from tryon_solver.effect_words.table import live
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.weld import weld
from tryon_solver.rebind import take_over, with_effects
from tryon_solver.redesign.parsed import parsed
from tryon_solver.simulation import Simulation
from tryon_solver.stepping.clocked import times_in_parts
from tryon_solver.worn_effects import VALUES, Cut, check, in_place, spec_of, values_of

REPEATS = 5  # of a call that is measured, since frames wait for them
LOOKED_AT = 1000  # vertices, from which how loosely a garment hangs is told


class Worn(Protocol):
    """A garment whose simulation may give way to another one of the same garment."""

    simulation: Simulation
    worn_pattern: WornPattern | None

    def go_on_in(self, simulation: Simulation) -> None:
        """Be simulated by this one from here on."""


class SolverEffects:
    """The effects of one garment.

    Attributes:
        asked: which it is worn with, as they were asked for.
        own: those that its pattern calls for.
    """

    def __init__(self, worn: Worn, panel_names: tuple[str, ...], asked: Asked | None) -> None:
        pattern = worn.worn_pattern
        self.own: Asked = {} if pattern is None else parsed(pattern.specification).effects
        self.asked: Asked = {**live(), **self.own} if asked is None else asked
        self._worn = worn
        self._names = panel_names
        self._cut: Cut | None = None
        self._write(worn.simulation, self.asked)

    @property
    def cut(self) -> Cut:
        """What names of pieces and numbers of edges mean in it."""
        if self._cut is None:
            pattern, garment = self._worn.worn_pattern, self._worn.simulation.scene.garment
            self._cut = cut_of(garment, self._names, pattern)
        return self._cut

    def check(self, asked: Asked) -> None:
        """Raises EffectError where it can't be worn with these."""
        check(self._worn.simulation.scene, asked, self.cut)

    def write(self, asked: Asked) -> None:
        """Be worn with these, which differ from those that it is worn with by values alone."""
        self._write(self._worn.simulation, {name: own for name, own in asked.items() if own != self.asked.get(name)})
        self.asked = asked
        self._worn.simulation.wake()

    def rebind(self, asked: Asked) -> Iterator[None]:
        """Come to be worn with these, in parts, between which it may be advanced; it is after the last.

        Raises EffectError, and then nothing has changed.
        """
        scene = self._worn.simulation.scene
        effects = check(scene, asked, self.cut)
        before = {type(effect): effect for effect in scene.effects}
        unchanged = [before[type(e)] if self._unchanged(e, before, asked) else e for e in effects]
        made: Simulation | None = None
        try:
            for part in with_effects(self._worn.simulation, tuple(unchanged)):
                made = part
                yield None
        except ValueError as error:
            raise in_place(error) from error
        assert made is not None
        take_over(made, self._worn.simulation)
        self._write(made, {name: own for name, own in asked.items() if own != self.asked.get(name)})
        self.asked = asked
        self._worn.go_on_in(made)

    def _unchanged(self, effect: Any, before: Mapping[type, Any], asked: Asked) -> bool:
        """Is it asked for as it is there already? Then the very same spec goes on, and what was written to it."""
        name = type(effect).module.rpartition(".")[2]
        if type(effect) not in before:
            return False
        return name not in asked or (name in self.asked and asked[name] == self.asked[name])

    def _write(self, simulation: Simulation, asked: Asked) -> None:
        valued = [name for name in asked if name in VALUES]
        if not valued:
            return
        bound = {contribution.name: contribution for contribution in simulation.plan.contributions}
        for name in valued:
            if name in bound:
                for value, numbers in values_of(name, asked[name], self.cut).items():
                    bound[name].values[value].assign(numbers)

    def times(self) -> Iterator[tuple[str, Mapping[str, float]]]:
        """What each contribution to the plan takes: its name, and ms of a call by stage; measured as it is asked."""
        return times_in_parts(self._worn.simulation, REPEATS)

    def plan(self, times: Mapping[str, Mapping[str, float]]) -> str:
        """The stages of a step and who takes part in each, with those times."""
        return self._worn.simulation.plan.describe(times)

    def character(self) -> Character:
        """What the garment is like now."""
        simulation = self._worn.simulation
        garment, pattern = simulation.scene.garment, self._worn.worn_pattern
        v = simulation.state.v.numpy().astype(np.float64)
        cloth, body = simulation.cloth_positions(), simulation.body_positions()
        some = cloth[:: max(len(cloth) // LOOKED_AT, 1)]
        return Character(
            speed=float(np.sqrt((v**2).sum(1).mean())),
            off_body=float(np.median(cKDTree(body).query(some)[0])),
            stretch=simulation.reported.max_stretch,
            limit=simulation.scene.fabric.strain_limit,
            layered=pattern is not None and bool(len(pattern.panels.laid.vertices)),
            closed=not boundary_loops(garment.faces),
        )


def cut_of(garment: Garment, panel_names: tuple[str, ...], pattern: WornPattern | None) -> Cut:
    """What names of pieces and numbers of edges mean in a garment that was made of this pattern, or of none."""
    if pattern is None:
        return Cut(garment, panel_names)
    counts = tuple(len(panel.edges) for panel in parsed(pattern.specification).panels)
    return Cut(garment, panel_names, counts, pattern.panels, weld(pattern.panels).welded_of_vertex)


def in_another_cut(worn: SolverEffects, after: Cut, own: Asked) -> dict[str, Parameters]:
    """Of what a garment is worn with, what another cut of it can be worn with as well: nothing along edges whose
    numbers may mean others, and nothing on pieces that are gone. What its pattern called for is as the pattern of the
    other cut has it, its `own`."""
    before = worn.cut
    same = before.panel_names == after.panel_names and before.edge_counts == after.edge_counts
    kept = {name: new for name, new in own.items() if worn.asked.get(name) == worn.own.get(name)}
    for name, parameters in worn.asked.items():
        if name not in worn.own and (same or name not in LINED):
            with suppress(EffectError):
                spec_of(name, parameters, after)
                kept[name] = parameters
    return kept
