"""Other effects, or other settings, for a garment that is being worn: Algorithm 2's edit where the plan changes and the
mesh stays.

A plan's arrays, matrices and recorded graphs are of the effects and settings it was bound with, so another set of them
is another simulation. It is built beside the one that goes on, in parts between its frames, and takes over its state
between two of them: positions, velocities, how far each contact has given, the body's stance and the clock. What is not
of the effects stays, the subspace's basis among it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np
import warp as wp

from tryon_solver.build_in_parts import build_in_parts
from tryon_solver.geometry.carried import carried_by
from tryon_solver.geometry.enclosed import closed_by_caps, enclosed_volume
from tryon_solver.plan import Contribution
from tryon_solver.reshape import reshape
from tryon_solver.scene import Effect, Gas, Pins
from tryon_solver.settings import Settings
from tryon_solver.simulation import Simulation
from tryon_solver.stepping.clocked import calls_of

HANGS_BY = ("d_hat", "body_offset", "pressure_stiffness", "skin_stiffness", "skin_hold", "skin_firmness")
"""Settings by which a garment hangs where it does: with others it would jump, or lie inside of what it may not touch.
All presets have the same."""
ROUNDED = 1e-9  # of a number of steps, and of one's length: times of frames are off in their last bits


def with_effects(worn: Simulation, effects: tuple[Effect, ...]) -> Iterator[Simulation | None]:
    """A simulation of the worn garment under these effects, in parts, None after each but the last; `worn` may be
    advanced meanwhile, and `take_over` is to follow. What it calls is called once, so that no kernel is left to load.

    Raises ValueError, naming field, place and remedy, for effects that don't suit the scene or each other, and then
    nothing was built.
    """
    yield from _rebound(worn, effects, worn.settings)


def with_settings(worn: Simulation, settings: Settings) -> Iterator[Simulation | None]:
    """The same under these settings, but for the accuracy and the deadline, which stay those that were bought, and for
    the mesh, which stays as it is.

    Raises ValueError where they have the garment hang elsewhere (HANGS_BY), and then nothing was built.
    """
    for name in HANGS_BY:
        here, there = getattr(worn.settings, name), getattr(settings, name)
        if here != there:
            what = f"settings.{name} is {here} in the simulation of the garment that is worn, which {there} would move"
            raise ValueError(f"{what}; leave it as it is, or dress the garment anew")
    yield from _rebound(worn, worn.scene.effects, settings)


def _rebound(worn: Simulation, effects: tuple[Effect, ...], settings: Settings) -> Iterator[Simulation | None]:
    scene = replace(worn.scene, effects=effects, x_start=worn.cloth_positions().astype(np.float64))
    pose = None if worn.body is None else worn.body.pose
    surface = worn.body_positions().astype(np.float64)
    dt = _step_under(settings, worn)
    basis = worn.basis if settings.subspace_spacing == worn.settings.subspace_spacing else None
    for simulation in build_in_parts(scene, settings, worn.device, pose, surface, dt, basis):
        if simulation is not None:
            for contribution in simulation.plan.contributions:
                for call in calls_of(simulation, contribution).values():
                    call()
                yield None
        yield simulation


def _step_under(settings: Settings, worn: Simulation) -> float:
    """Length of the steps [s] into which these settings cut a call of `advance` as the last one was, so that the next
    one need not wait for matrices of another: longer ones than the settings have are asked for where they were."""
    call, whole = worn.bridged or worn.whole, worn.whole
    asked_for = whole if whole > (1 + ROUNDED) * worn.settings.largest_step else 0.0
    return call / math.ceil(call / max(settings.largest_step, asked_for) - ROUNDED)


def take_over(simulation: Simulation, worn: Simulation) -> None:
    """Be where the garment `worn` is now, as if these effects and settings had been its own from here on; awake.

    An effect that both have, the very same spec, goes on with the values that were written to it.
    """
    if simulation.scene.garment is not worn.scene.garment:  # it was edited meanwhile
        reshape(simulation, worn.scene.garment)
    ours, theirs = simulation.state, worn.state
    for name in ("x", "x_committed", "x_start", "x_feasible", "v", "skin", "hold"):
        wp.copy(getattr(ours, name), getattr(theirs, name))
    for places in (simulation.x_searched, simulation.x_carried):
        wp.copy(places, theirs.x)
    if simulation.touching:
        wp.copy(simulation.x_listed, theirs.x)
    if simulation.touching and worn.touching:
        wp.copy(simulation.solved, worn.solved)
        if simulation.lead is not None:
            simulation.lead.begin_as(worn.lead)
    simulation.went_back, simulation.stood = worn.went_back, worn.stood
    if simulation.halving is not None and worn.halving is not None:
        simulation.halving.times = worn.halving.times
    if simulation.flight is not None and worn.flight is not None:
        simulation.flight.begin_as(worn.flight, worn.pairs)
    ours.time = theirs.time
    simulation.wake()
    if simulation.body is not None and worn.body is not None:
        simulation.body.pose, simulation.body.reached = worn.body.pose, worn.body.reached
        for name in ("skin_now", "skin_next", "felt"):
            wp.copy(getattr(simulation.body, name), getattr(worn.body, name))
    simulation.hurried, simulation.reported = worn.hurried, worn.reported  # by which it is known what iterations take
    simulation.buy(worn.settings.accuracy, worn.settings.deadline)
    _keep_values(simulation, worn)


def settle_in(simulation: Simulation, names: Collection[str]) -> None:
    """Have newly bound effects of these names begin from where the garment hangs now, which is not where it hung when
    they were bound: air is shut in as the volume is, pins are set where their vertices are."""
    bound = {contribution.name: contribution for contribution in simulation.plan.contributions}
    garment, x = simulation.scene.garment, simulation.cloth_positions().astype(np.float64)
    for effect in simulation.scene.effects:
        name = type(effect).module.rpartition(".")[2]
        if name not in names or name not in bound:
            continue
        values = bound[name].values
        if isinstance(effect, Gas):
            room = enclosed_volume(x, closed_by_caps(effect.faces_of(garment)))
            values["amount"].assign(np.array([effect.ambient * room]))
        elif isinstance(effect, Pins) and effect.led:
            assert simulation.scene.body is not None
            surface = simulation.body_positions().astype(np.float64)
            onto, offsets = carried_by(x[effect.vertices], surface, np.asarray(simulation.scene.body.faces))
            values["onto"].assign(onto + np.int32(garment.vertex_count))
            values["offsets"].assign(offsets.astype(np.float32))
        elif isinstance(effect, Pins):
            values["places"].assign(x[effect.vertices].astype(np.float32))


def _keep_values(simulation: Simulation, worn: Simulation) -> None:
    """What contributions have that the scene does not say: contacts' slips, and values written since."""
    before = {c.name: c for c in worn.plan.contributions}
    same = {type(effect) for effect in simulation.scene.effects if any(effect is other for other in worn.scene.effects)}
    names = {kind.module.rpartition(".")[2] for kind in same}
    for contribution in simulation.plan.contributions:
        other: Contribution | None = before.get(contribution.name)
        if other is None:
            continue
        if contribution.contact is not None and other.contact is not None:
            contribution.contact.restore(*other.contact.kept())
        if contribution.name in names:
            for name, value in contribution.values.items():
                wp.copy(value, other.values[name])
