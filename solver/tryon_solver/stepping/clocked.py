"""What each contribution takes in each of its stages, measured when it is asked for and at no other time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.read_back import read
from tryon_solver.plan import ContactTerm, Contribution
from tryon_solver.stepping.clocked_contact import contact_calls
from tryon_solver.stepping.repeat import TAKEN

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

LOOKS = 4  # of a correction at where it may begin and at where it has come to, beside one an iteration
MEASURED = 2  # gradients that tell how good a cycle's end and a step are
IN_CORRECTION = (
    "project_in_correction",
    "add_velocity_gradient_in_correction",
    "add_triangle_hessian",
    "add_hessian",
    "contact",
    "assembly",
)
"""Stages of which a look around has one call."""


def contribution_times(sim: Simulation, repeats: int = 20) -> dict[str, dict[str, float]]:
    """By contribution and stage, ms of one call at the state as it is, the mean of `repeats` after one that is not
    counted. Waits for the device, and allocates what calls write to. Changes nothing that the next step goes by: what a
    call keeps for a step the next step's own replaces, and values that a call moves on are put back.

    Those of the constant matrices are never called: they have no times. Contact with a surface has those of
    clocked_contact.py instead. How often a frame calls each tells `calls_in_a_frame`.
    """
    return dict(times_in_parts(sim, repeats))


def times_in_parts(sim: Simulation, repeats: int = 20) -> Iterator[tuple[str, dict[str, float]]]:
    """`contribution_times`, a contribution with each `next`: the simulation may be advanced in between."""
    for contribution in sim.plan.contributions:
        kept = {name: wp.clone(value) for name, value in contribution.values.items()}
        calls = calls_of(sim, contribution)
        times = {stage: clocked(sim, call, repeats) for stage, call in calls.items()}
        for name, value in kept.items():
            wp.copy(contribution.values[name], value)
        yield contribution.name, times


def calls_in_a_frame(sim: Simulation) -> dict[str, int]:
    """By stage, how often about the last call of `advance` had one of a contribution: once a step; once an iteration of
    Newton's, of the cycle, or of both, and some more (LOOKS, MEASURED) in each step; or once an iteration of the
    conjugate gradients, as many as the last of Newton's had. Waits for the device."""
    counters = sim.counters
    cycles, *_ = read(sim.cycles)
    steps = counters.steps
    looks = counters.newton_iterations + LOOKS * steps
    gradients = int(cycles[TAKEN]) + looks + MEASURED * steps if steps else 0
    by_stage = dict.fromkeys(("start_step", "add_diagonal", "add_acceleration", "detection", "verification"), steps)
    by_stage |= dict.fromkeys(("project", "add_gradient", "add_velocity_gradient"), gradients)
    by_stage |= dict.fromkeys(IN_CORRECTION, looks)
    return by_stage | {
        "time_of_impact": counters.newton_iterations,
        "product": counters.newton_iterations * sim.cg.taken(),
    }


def in_a_frame(times: Mapping[str, float], calls: Mapping[str, int]) -> float:
    """ms: what a contribution's stages took a call, by how often a frame calls them."""
    return sum(taken * calls[stage] for stage, taken in times.items())


def calls_of(sim: Simulation, contribution: Contribution) -> dict[str, Callable[[], None]]:
    """One call of each of its stages, with outputs that nobody reads."""
    state, x = sim.state, sim.state.x
    vectors, numbers = wp.zeros_like(sim.work.gradient), wp.zeros_like(sim.work.diagonal)
    corners = wp.zeros_like(sim.work.corner_gradient)
    arguments: dict[str, tuple[object, ...]] = {
        "start_step": (state,),
        "add_diagonal": (state, numbers),
        "add_acceleration": (vectors[: sim.cloth_count],),
        "project": (x, corners),
        "project_in_correction": (x, corners),
        "add_gradient": (x, vectors),
        "add_velocity_gradient": (state, x, vectors),
        "add_velocity_gradient_in_correction": (state, x, vectors),
        "add_triangle_hessian": (x, sim.triangle_hessian.hessians),  # cleared before it is summed the next time; so are
        "add_hessian": (x, sim.hessian_rows),  # these
    }
    calls: dict[str, Callable[[], None]] = {}
    for stage, given in arguments.items():
        call = getattr(contribution, stage)
        if call is not None:
            calls[stage] = bound(call, given)
    for name in contribution.touches:
        calls |= contact_calls(sim, dict(zip(sim.plan.touches, sim.touching))[name])
    if contribution.contact is not None and sim.pairs.size:
        calls["contact"] = contact_call(sim, contribution.contact, vectors)
    return calls


def bound(call: Callable[..., None], given: tuple[object, ...]) -> Callable[[], None]:
    """The call with what it is given."""
    return lambda: call(*given)


def contact_call(sim: Simulation, term: ContactTerm, vectors: wp.array) -> Callable[[], None]:
    """All that an iteration asks of a contact term."""

    def call() -> None:
        term.prepare(sim.pairs, sim.state, sim.state.x, sim.x_searched)
        term.add_gradient(sim.pairs, sim.state, sim.state.x, vectors)
        sim.sums.settle(vectors)
        term.add_stiffness(sim.pairs)

    return call


def clocked(sim: Simulation, call: Callable[[], None], repeats: int) -> float:
    """ms."""
    call()
    wp.synchronize_device(sim.device)
    begun = time.perf_counter()
    for _ in range(repeats):
        call()
    wp.synchronize_device(sim.device)
    return 1e3 * (time.perf_counter() - begun) / repeats
