"""Another outfit where one is worn, between two frames: without some of its garments, or with one in another cut.

What stays keeps its places and velocities, and what its contacts remember. What is taken off leaves a state that is
free as it is; a new cut is carried over from the old one (carry_over.py) with all else around it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tryon_solver.build_in_parts import build_in_parts
from tryon_solver.dressing.carry_over import ROOM, ROUNDS, freed_where_worn, laid_over
from tryon_solver.dressing.new_cut import NewCut
from tryon_solver.dressing.outfit import Outfit, Worn, WornOutfit
from tryon_solver.dressing.stitching_on import without_stitches
from tryon_solver.dressing.untangle import Tangle
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.materials.fabric import Fabric
from tryon_solver.redesign.slack import Slack
from tryon_solver.scene import Effect
from tryon_solver.simulation import Simulation


@dataclass(frozen=True)
class Recut:
    """An outfit with one garment in another cut, the slack that the rest shape of that is to begin with, and how far
    its cloth went at most [m]."""

    outfit: WornOutfit
    slack: Slack | None
    went: float


def without(
    worn: WornOutfit, *names: str, more: Iterable[object] = (), effects: Sequence[Effect] | None = None
) -> Iterator[WornOutfit | None]:
    """Take the garments of these names off, in parts, None after each but the last, between which the outfit may be
    advanced; `more` are parts of something else, `effects` those of what is left, the worn ones if none are given. The
    new simulation's clock begins at 0.

    Raises ValueError where the outfit has no such garments, or no other.
    """
    outfit, before = worn.outfit.without(*names), worn.simulation
    spans = [layer.vertices for layer in worn.outfit.layers if layer.name not in names]
    kept = np.concatenate([np.arange(span.start, span.stop) for span in spans])
    for simulation in _built(worn, outfit, before.cloth_positions()[kept].astype(np.float64), effects, more):
        if simulation is None:
            yield None
            continue
        _start(simulation, before, before.cloth_positions()[kept].astype(np.float64))
        simulation.state.v.assign(before.state.v.numpy()[kept])
        _remember(simulation, before, kept)
        yield WornOutfit(outfit, simulation, worn.pose)


def recut(
    worn: WornOutfit,
    name: str,
    cut: NewCut,
    before: Callable[[], PanelMesh],
    fabric: Fabric,
    more: Iterable[object] = (),
    effects: Sequence[Effect] | None = None,
) -> Iterator[Recut | None]:
    """Put the new cut of the garment of this name on, of this fabric, where it is worn, as `without` in parts; `before`
    tells its mesh as it is worn then, and is asked for the last part.

    Raises CarryError where it can't be put on so, GarmentError as `build`.
    """
    sim, layers = worn.simulation, worn.outfit.layers
    number = [layer.name for layer in layers].index(name)
    own, first = layers[number], layers[number].vertices.start
    new = Worn.of_pattern(name, cut.mesh, cut.welded, fabric)
    outfit = Outfit(tuple(new if one.name == name else one for one in worn.outfit.worn))

    def with_cut(places: np.ndarray, values: np.ndarray) -> np.ndarray:
        return np.vstack([values[:first], places, values[own.vertices.stop :]]).astype(np.float64)

    flat = cut.welded.mean_of_vertices(cut.mesh.placed)
    tangle: Tangle | None = None
    for simulation in _built(worn, outfit, with_cut(flat, sim.cloth_positions()), effects, more):
        if simulation is None:
            yield None
            continue
        tangle = Tangle(simulation, ROUNDS)
        yield None
        x, v = sim.cloth_positions(), sim.state.v.numpy()
        faces = worn.outfit.garment.faces[own.faces] - first
        where = x[own.vertices], v[own.vertices]
        laid = laid_over(cut, before(), faces, where, fabric, ROOM * fabric.thickness)
        _start(simulation, sim, with_cut(laid.x, x))
        freed_where_worn(tangle, outfit.piece_names)
        simulation.state.v.assign(with_cut(laid.v, v).astype(np.float32))
        own_now = slice(first, first + cut.garment.vertex_count)
        drawn = laid.drawn_to(simulation.cloth_positions()[own_now])
        yield Recut(WornOutfit(outfit, simulation, worn.pose), *drawn)


def _built(
    worn: WornOutfit, outfit: Outfit, x: np.ndarray, effects: Sequence[Effect] | None, more: Iterable[object]
) -> Iterator[Simulation | None]:
    """The outfit's simulation, at x (N, 3) m, which counts for nothing yet, on the body that the worn one is on."""
    before = worn.simulation
    assert before.body is not None
    own = without_stitches(before.scene.effects if effects is None else tuple(effects))
    scene = outfit.scene(x, before.scene.body, own)
    return build_in_parts(
        scene, before.settings.by_budget(), before.device, before.body.pose, None, before.dt, None, more
    )


def _start(simulation: Simulation, before: Simulation, x: np.ndarray) -> None:
    """Be at x (N, 3) m, on the body as the one before has it now."""
    assert before.body is not None
    simulation.start_at(x, before.body_positions().astype(np.float64), before.body.pose)


def _remember(simulation: Simulation, before: Simulation, kept: np.ndarray) -> None:
    """Let contacts between what is left, the vertices `kept` (K,) and the body, begin with what they had given."""
    number = np.full(before.all_count, -1)
    number[kept] = np.arange(len(kept))
    number[before.cloth_count :] = len(kept) + np.arange(before.body_count)
    terms = {own.name: own.contact for own in before.plan.contributions}
    for own in simulation.plan.contributions:
        old, new = terms.get(own.name), own.contact
        if old is None or new is None:
            continue
        ids, given = old.kept()
        renumbered = number[ids]
        there = (renumbered >= 0).all(axis=1)
        new.restore(renumbered[there].astype(np.int32), given[there])
