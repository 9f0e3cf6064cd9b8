"""Moves of the correction: the way that is taken of a direction is proven free of contact (METHOD.md, section 8)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.contact import bounds, candidates, deflect
from tryon_solver.linalg.launch import launch
from tryon_solver.stepping.search import a_few_edges, follow, search_around, search_further, searches_left

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})


@wp.kernel
def move_kernel(
    direction: wp.array(dtype=wp.vec3),
    alpha: wp.array(dtype=wp.float32),
    x_out: wp.array(dtype=wp.vec3),
    moved_out: wp.array(dtype=wp.vec3),
):
    """x += alpha direction"""
    i = wp.tid()
    moved = alpha[i] * direction[i]
    x_out[i] = x_out[i] + moved
    moved_out[i] = moved


def take(sim: Simulation, direction: wp.array) -> None:
    """Move x by `direction`, as far as it is proven free of contact; searches further for it where it must."""
    work = sim.work
    work.alpha.fill_(1.0)
    if sim.touching and searches_left(sim) > 0:
        leaving = bounds.leaving(sim.state.x, direction, work.alpha, sim.region, work.hits)
        if leaving:
            search_further(sim, direction, work.alpha, a_few_edges(sim, leaving))
    take_within_region(sim, direction)


def take_within_region(sim: Simulation, direction: wp.array) -> None:
    """Move x by `direction`, as far as it is proven free by the candidates that there are; `total` is the move."""
    sim.work.alpha.fill_(1.0)
    if sim.touching:
        prove_free(sim, direction)
    move(sim, direction)
    if sim.touching:
        follow(sim, near=True)


def move(sim: Simulation, direction: wp.array) -> None:
    """Move x by `alpha` times `direction`; `total` is the move."""
    work = sim.work
    launch(move_kernel, sim.all_count, [direction, work.alpha], [sim.state.x, work.total], device=sim.device)


def prove_free(sim: Simulation, direction: wp.array) -> None:
    """Turn `direction` aside where it closes gaps, then set `alpha` so that what is left of it is free of contact.

    Where candidates are idle, all of the region is. A move of cloth that shuts in gas is turned aside as its volume
    allows, and shortened with all else as one; what was free only beside or behind it is looked at again.
    """
    state, work, settings, sizes = sim.state, sim.work, sim.settings, sim.contact.sizes
    if not sim.candidates.idle:
        list_near(sim, direction, settled=False)
        for dyad in sim.stages.dyads:
            dyad.note(direction)
        deflect.deflect(
            sim.candidates,
            True,
            sim.cloth_count,
            sizes,
            state.x,
            direction,
            sim.filtering.changed,
            sim.deflection,
            sim.filtering.passes,
            settings.deflection_passes,
            each_its_own=True,
        )
        for dyad in sim.stages.dyads:
            dyad.restore(direction)
        list_near(sim, direction, settled=True)
    bounds.stay_in_region(state.x, direction, sim.region, work.alpha)
    wp.copy(sim.holding.allowed, work.alpha)
    if not sim.candidates.idle:
        shorten(sim, direction)
    for dyad in sim.stages.dyads:
        dyad.level(work.alpha, sim.holding.allowed)
    if sim.stages.dyads and not sim.candidates.idle:
        shorten(sim, direction)


def shorten(sim: Simulation, direction: wp.array) -> None:
    """Shrink `alpha` until the move by `direction` is free of the candidates that are listed as near it."""
    filtering = sim.filtering
    bounds.shorten(
        sim.candidates,
        True,
        sim.cloth_count,
        sim.contact.sizes,
        sim.state.x,
        direction,
        sim.work.alpha,
        filtering.alpha_before,
        filtering.changed,
        filtering.passes,
    )


def list_near(sim: Simulation, direction: wp.array, settled: bool) -> None:
    """List the candidates that a move from x by `direction` concerns, at any fractions."""
    sizes = sim.contact.sizes
    candidates.measure_travel(direction, sim.filtering.travel)
    candidates.list_near(sim.candidates, sim.state.x, sim.filtering.travel, sim.cloth_count, sizes, settled)


def proven_free(sim: Simulation, displacement: np.ndarray) -> bool:
    """Is the straight move of the cloth by `displacement` (N, 3) m from x free of contact? Nothing is moved."""
    state, work = sim.state, sim.work
    work.direction.zero_()
    wp.copy(work.direction, wp.array(displacement, dtype=wp.vec3, device=sim.device), count=sim.cloth_count)
    sim.searches = 0
    search_around(sim, state.x, work.direction)
    work.alpha.fill_(1.0)
    bounds.shorten(
        sim.candidates,
        False,
        sim.cloth_count,
        sim.contact.sizes,
        state.x,
        work.direction,
        work.alpha,
        sim.filtering.alpha_before,
        sim.filtering.changed,
        sim.filtering.passes,
    )
    return sim.filtering.passes.taken() == 0
