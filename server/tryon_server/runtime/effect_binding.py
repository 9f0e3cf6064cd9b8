"""The effects of a garment that the solver simulates: which it is worn with, and how it comes to have others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, Protocol

import numpy as np
from scipy.spatial import cKDTree

from tryon_server.runtime.drape import CLOSE, Asked, Character, EffectTimes
from tryon_server.runtime.worn_garment import WornGarment
from tryon_solver.dressing.outfit import Outfit
from tryon_solver.effect_words.fields import EffectError
from tryon_solver.effect_words.gentle import POWERS, least_seconds
from tryon_solver.effect_words.ramps import Covers, as_it_comes, as_it_goes
from tryon_solver.effect_words.rules import LINED, Parameters, rows_of_garments, together, with_pieces
from tryon_solver.effect_words.table import WORDS, WORN_ON_BODY, live
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.named_lines import Cut
from tryon_solver.geometry.outfit import garments_of
from tryon_solver.rebind import settle_in, take_over, with_effects
from tryon_solver.redesign.parsed import parsed
from tryon_solver.scene import Adhesion, Pins
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import Simulation
from tryon_solver.stepping.clocked import calls_in_a_frame, in_a_frame, times_in_parts
from tryon_solver.value_ramps import ValueRamps
from tryon_solver.worn_effects import check, covers, elastic_lengths, has_values, in_place, spec_of, values_of

REPEATS = 5  # of a call that is measured, since frames wait for them
LOOKED_AT = 1000  # vertices and triangles, from which is told what a garment is like
MOST = 0.9  # of them have less than what is told of a tenth
G = 9.81  # m/s^2
PATIENT = PRESETS["live"].correction_iterations  # of a step: so many bring friction out
LEFT_BEHIND = "the room holds it: who walks on stretches it, and frames take long; pinned to the body it goes along"
ASTRAY = "what slides is too slow or too fast here, most of all over curves and on other cloth; the detail live helps"


class WornTogether(Protocol):
    """What is worn, the simulation of which may give way to another one of the same garments."""

    simulation: Simulation

    @property
    def garments(self) -> Sequence[WornGarment]:
        """From the innermost outwards."""

    def go_on_in(self, simulation: Simulation) -> None:
        """Be simulated by this one from here on."""


class SolverEffects:
    """The effects of what is worn.

    Attributes:
        asked: which it is worn with, as they were asked for.
        own: those that its patterns call for.
    """

    def __init__(self, worn: WornTogether, asked: Asked | None) -> None:
        self.own = own_of(worn.garments)
        self.asked: Asked = {**live(), **self.own} if asked is None else asked
        self._worn = worn
        self._cut: Cut | None = None
        self._ramps = ValueRamps()
        self._going_to = self.asked
        settle_in(worn.simulation, self.asked)
        for name in filter(has_values, self.asked):
            self._ramps.write(worn.simulation, name, values_of(name, self.asked[name], self.cut))

    @property
    def garments(self) -> tuple[str, ...]:
        """Names of what is worn, from the innermost outwards."""
        return tuple(one.worn.name for one in self._worn.garments)

    @property
    def caveats(self) -> Mapping[str, str]:
        """What few Newton iterations leave undone, of what is asked for more than cloth bears how much acts (METHOD.md
        section 6), and what a wearer who moves on is held back by."""
        settings, scene = self._worn.simulation.settings, self._worn.simulation.scene
        found = {} if settings.correction_iterations >= PATIENT else {"friction": ASTRAY}
        for effect in scene.effects:
            if isinstance(effect, Pins) and not effect.led and scene.body is not None:
                found["pins"] = LEFT_BEHIND
            if isinstance(effect, Adhesion) and (shear := effect.shear_in(scene)) < effect.strength:
                found["adhesion"] = f"it slips aside at {shear:.0f} Pa, more than which the fabric does not bear"
        return found

    def under_garments(self, name: str, parameters: Parameters) -> Parameters:
        """The effect's parameters with each piece called by its garment's name and its own."""
        cut = self.cut
        return with_pieces(name, parameters, lambda piece: piece if piece == WORN_ON_BODY else cut.full_name(piece))

    @property
    def cut(self) -> Cut:
        """What names of pieces and numbers of edges mean in it."""
        if self._cut is None:
            self._cut = cut_of(self._worn.garments)
        return self._cut

    def check(self, asked: Asked) -> None:
        """Raises EffectError where it can't be worn with these."""
        check(self._worn.simulation.scene, asked, self.cut)

    def write(self, asked: Asked) -> None:
        """Be worn with these, which differ from those that it is worn with by values alone."""
        self._lead({name: own for name, own in asked.items() if own != self.asked.get(name)})
        self.asked = self._going_to = asked
        self._worn.simulation.wake()

    def fade(self, wanted: Asked) -> float:
        """Have go gently what is not to act any more once ``wanted`` is bound, and what was to go and is wanted again
        come back; for how many simulated seconds some of it is still on its way."""
        if wanted != self._going_to:
            self._going_to = wanted
            self._lead(
                {name: as_it_goes(name, own, wanted.get(name), self._covers(name)) for name, own in self.asked.items()}
            )
        return self._ramps.left(self._worn.simulation)

    def before_frame(self, time: float) -> None:
        """To be called before each advance, with the simulation's time [s] after it."""
        self._ramps.before_frame(self._worn.simulation, time)

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
        new = {name: own for name, own in asked.items() if own != self.asked.get(name)}
        settle_in(made, new)
        was, self.asked = self.asked, asked
        self._going_to = asked
        self._worn.go_on_in(made)
        for name in filter(has_values, new):
            first = as_it_comes(name, new[name], was.get(name), self._covers(name))
            self._ramps.write(made, name, values_of(name, first, self.cut))
        self._lead(asked)

    def _unchanged(self, effect: Any, before: Mapping[type, Any], asked: Asked) -> bool:
        """Is it asked for as it is there already? Then the very same spec goes on, and what was written to it."""
        name = next((word.name for word in WORDS if word.home == type(effect).module), "")
        if type(effect) not in before:
            return False
        return name not in asked or (name in self.asked and asked[name] == self.asked[name])

    def _covers(self, name: str) -> Covers:
        """What tells of two entries of the effect's list whether the first acts on all that the second one does."""
        return lambda one, other: covers(name, one, other, self.cut)

    def _lead(self, asked: Asked) -> None:
        """Have the values of these effects go to what they are here, each in its own time, or as gently as it must."""
        simulation = self._worn.simulation
        lightest = min(fabric.areal_density for fabric in simulation.scene.fabric_of_garments())
        for name in filter(has_values, asked):
            values, now = values_of(name, asked[name], self.cut), self._ramps.now(simulation, name)
            lengths = elastic_lengths(asked[name], self.cut) if name == "elastic" else np.zeros(0)
            least = least_seconds(name, asked[name], now, values, lightest, lengths)
            seconds = max(asked[name].get("ramp", 0.0), least)
            self._ramps.lead(simulation, name, values, seconds, POWERS.get(name, 1.0))

    def times(self) -> Iterator[tuple[str, EffectTimes]]:
        """What each contribution to the plan takes, by its name; measured as it is asked."""
        simulation = self._worn.simulation
        for name, stages in times_in_parts(simulation, REPEATS):
            yield name, EffectTimes(stages, in_a_frame(stages, calls_in_a_frame(simulation)))

    def plan(self, times: Mapping[str, Mapping[str, float]]) -> str:
        """The stages of a step and who takes part in each, with those times."""
        return self._worn.simulation.plan.describe(times)

    def character(self) -> Character:
        """What is worn is like this now; of several garments what any of them is."""
        simulation = self._worn.simulation
        scene, patterns = simulation.scene, [one.pattern for one in self._worn.garments]
        cloth, garment = simulation.cloth_positions().astype(np.float64), scene.garment
        some = slice(None, None, max(len(cloth) // LOOKED_AT, 1))
        speed = np.linalg.norm(simulation.state.v.numpy()[: len(cloth)][some], axis=1)
        off = cKDTree(simulation.body_positions()).query(cloth[some])[0]
        stretch = _stretch(garment, cloth, slice(None, None, max(len(garment.faces) // LOOKED_AT, 1)))
        fabrics = scene.fabric_of_garments()
        return Character(
            speed=float(np.quantile(speed, MOST)),
            off_body=float(np.quantile(off, MOST)),
            close=float((off < CLOSE).mean()),
            stretch=float(np.quantile(stretch, MOST)),
            limit=min(fabric.strain_limit for fabric in fabrics),
            weight=min(fabric.areal_density for fabric in fabrics) * G,
            layered=any(pattern is not None and len(pattern.panels.laid.vertices) for pattern in patterns),
            closed=any(not boundary_loops(garment.faces) for garment in garments_of(scene.garment)),
        )


def _stretch(garment: Garment, x: np.ndarray, some: slice) -> np.ndarray:
    """Largest principal stretch of some triangles of the garment in positions x (N, 3) m: of F = sum_i x_i g_i^T."""
    f = np.einsum("tki,tkj->tij", x[garment.faces[some]], garment.corner_gradients()[some])
    return np.linalg.svd(f, compute_uv=False)[:, 0]


def cut_of(garments: Sequence[WornGarment]) -> Cut:
    """What names of pieces and numbers of edges mean in what is worn."""
    outfit = Outfit(tuple(one.worn for one in garments))
    return Cut.together(outfit.garment, [_cut_of_one(one) for one in garments])


def _cut_of_one(one: WornGarment) -> Cut:
    worn = one.worn
    if one.specification is None or worn.panels is None or worn.welded is None:
        return Cut.of_mesh(worn.garment, worn.piece_names, worn.name).made_of(worn.fabric.name)
    panels = parsed(one.specification).panels
    counts, clockwise = [len(panel.edges) for panel in panels], [panel.clockwise for panel in panels]
    cut = Cut.of_pattern(worn.garment, worn.panels, worn.welded, counts, worn.name, clockwise)
    return cut.made_of(worn.fabric.name)


def own_of(garments: Sequence[WornGarment]) -> Asked:
    """What the patterns of these garments call for, by the names that their pieces have together."""
    each: list[Asked] = []
    for one in garments:
        own: Asked = {} if one.specification is None else parsed(one.specification).effects
        if len(garments) > 1:
            alone = _cut_of_one(one)
            own = {name: with_pieces(name, parameters, alone.full_name) for name, parameters in own.items()}
        each.append(own)
    return together(each)


def in_other_garments(worn: SolverEffects, garments: Sequence[WornGarment]) -> dict[str, Parameters]:
    """Of what is worn with effects, what these garments can be worn with as well, others of them or in another cut:
    nothing along edges whose numbers may mean others, and nothing on pieces that are gone. What its patterns called for
    is as theirs have it."""
    own, after = own_of(garments), cut_of(garments)
    kept = {name: new for name, new in own.items() if worn.asked.get(name) == worn.own.get(name)}
    other = {garment for garment, _ in _edges_of(worn.cut).items() - _edges_of(after).items()}
    names = tuple(one.worn.name for one in garments)
    same_garments, gone = names == worn.garments, set(worn.garments) - set(names)
    for name, given in worn.asked.items():
        if name in worn.own:
            continue
        parameters = given
        if not same_garments:
            under = worn.under_garments(name, given)
            parameters = rows_of_garments(name, under, lambda named: not named & gone)
        if name in LINED and other & _garments_named(name, parameters, worn.cut):
            continue
        if name in LINED and not any(isinstance(rows, list) and rows for rows in parameters.values()):
            continue
        with suppress(EffectError):
            spec_of(name, parameters, after)
            kept[name] = parameters
    return kept


def _edges_of(cut: Cut) -> dict[str, tuple[tuple[str, int], ...]]:
    """Of each garment the names of its pieces, and how many edges each has."""
    return {
        garment: tuple((piece.name, len(piece.edges)) for piece in cut.pieces if piece.garment == garment)
        for garment in {piece.garment for piece in cut.pieces}
    }


def _garments_named(name: str, parameters: Parameters, cut: Cut) -> set[str]:
    """Those whose pieces the effect's parameters name."""
    found: list[str] = []

    def note(piece: str) -> str:
        found.append(cut.pieces[cut.panel(piece, "")].garment)
        return piece

    with_pieces(name, parameters, note)
    return set(found)
