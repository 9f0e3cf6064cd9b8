"""What contact with one surface takes in a step, by what is done: measured when it is asked for (clocked.py).

The search for contact, the barrier's terms and the time of impact are the step's own, not a contribution's; here the
same functions are called on lists and in a region of their own, with one surface alone, at the state as it is: what
takes no step before has no region yet, and around its zeros every triangle would be near every other.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.contact import broad_phase
from tryon_solver.contact import pairs as contact_pairs
from tryon_solver.contact.candidates import Candidates
from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.contact.region import Region
from tryon_solver.contact.surfaces import Surface
from tryon_solver.contact.verify import violations
from tryon_solver.stepping.search import accompany, scope
from tryon_solver.stepping.take import prove_free

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

FIRST_ROOM = 1024  # candidates and pairs; both grow


def contact_calls(sim: Simulation, surface: Surface) -> dict[str, Callable[[], None]]:
    """One call of each thing that contact with `surface` has done: `detection` (broad phase), once a step or as often
    as the cloth leaves the region; `assembly` (pairs, gradient, diagonal), once a Newton iteration; `product`, once an
    iteration of its conjugate gradients; `time_of_impact` (deflection and continuous collision detection of the last
    step's way), once a Newton iteration; `verification` in float64, once a step. What they write nobody reads.
    """
    device, x = sim.device, sim.state.x
    beside = copy(sim)
    beside.candidates, beside.pairs = Candidates.allocate(FIRST_ROOM, device), ContactPairs.allocate(FIRST_ROOM, device)
    cloth = sim.cloth.apart()
    of_this = cloth if surface is sim.cloth else surface.apart()
    beside.cloth, beside.touching, beside.region = cloth, (of_this,), Region.allocate(sim.all_count, device)
    beside.graphs = {}  # those of the step are of its own lists
    way = wp.zeros_like(x)
    wp.copy(way, wp.array(sim.dt * sim.state.v.numpy(), dtype=wp.vec3, device=device), count=sim.cloth_count)
    direction, sums, numbers = wp.zeros_like(x), wp.zeros_like(x), wp.zeros_like(sim.work.blocks)
    accompany(sim, beside.region, x, direction, share=1.0)
    wp.copy(beside.region.anchor, beside.region.centre)
    find(beside)
    contact_pairs.collect(beside.pairs, beside.candidates, beside.contact, x)
    distances = wp.clone(beside.candidates.distance)

    def assemble() -> None:
        contact_pairs.collect(beside.pairs, beside.candidates, beside.contact, x)
        contact_pairs.add_gradient(beside.pairs, x, x, sums, sim.sums)
        sim.sums.settle(sums)
        contact_pairs.add_diagonal(beside.pairs, numbers, sim.sums)

    def time_of_impact() -> None:
        wp.copy(beside.candidates.distance, distances)  # bounds that every call would lower
        wp.copy(direction, way)
        prove_free(beside, direction)

    def verify() -> None:
        violations(beside.candidates, sim.cloth_count, sim.contact.sizes, x, beside.work.hits)

    calls = {"detection": lambda: find(beside), "assembly": assemble}
    if beside.pairs.size:
        calls["product"] = lambda: contact_pairs.add_product(beside.pairs, way, sums, sim.sums)
    if beside.candidates.size:
        calls |= {"time_of_impact": time_of_impact, "verification": verify}
    return calls


def find(sim: Simulation) -> None:
    """Fill the candidates anew for the region."""
    broad_phase.find(sim.candidates, scope(sim, sim.state.x))
