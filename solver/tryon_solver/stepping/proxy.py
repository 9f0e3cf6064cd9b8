"""The contact proxy: pairs within reach at the feasible state and the barrier's quadratic model there.

Bp(x; x*) = B(x*) + grad B . (x - x*) + 1/2 |x - x*|^2_HB with x* the feasible state (Li et al. 2023).
Linearising there, and not closer to the trial, keeps a garment at rest exactly at rest: x* is then the solution.
The pairs stay those of the feasible state until the correction begins there. Friction's model is made at the slip of
the last velocity: what slid goes on sliding, what stuck sticks.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.contact import coasting, pairs
from tryon_solver.linalg.device_loop import keeps_graphs
from tryon_solver.stepping.gradient import add_contact_gradient, elastic_gradient, invert_diagonal_blocks
from tryon_solver.stepping.record import as_one
from tryon_solver.stepping.search import list_holds, search_along

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def find_pairs(sim: Simulation, counted: bool) -> None:
    """Collect the pairs within reach at x_feasible. If they need not be `counted`, a GPU collects as many as there is
    room for, and nobody waits: the correction will know whether there are more, and the proxy can do without them."""
    if not sim.touching:
        return
    if not sim.listed:
        sim.work.direction.zero_()
        if not list_holds(sim, sim.state.x_feasible, sim.work.direction):
            search_along(sim, sim.state.x_feasible, sim.work.direction, 1.0)
    if keeps_graphs(sim.device) and sim.pairs.size and not counted:
        x = sim.state.x_feasible
        as_one(sim, "find_pairs", lambda: pairs.look_for(sim.pairs, sim.candidates, sim.contact, x))
    else:
        pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x_feasible)
    for term in sim.stages.contact:
        term.make_room(sim.pairs)


def build_contact_proxy(sim: Simulation) -> None:
    """Freeze the model of the pairs at x_feasible for the step, and set the gradient at the current trial."""
    state, work = sim.state, sim.work
    if sim.pairs.size:
        wp.copy(sim.x_searched, state.x_feasible)
        wp.copy(work.total, state.x_feasible)
        coasting.coast(state.x_start, state.v, state.dt, work.total)
        for term in sim.stages.contact:
            term.prepare(sim.pairs, state, work.total, None)
    invert_diagonal_blocks(sim)
    work.direction.zero_()
    project_locally(sim)


def project_locally(sim: Simulation) -> None:
    """The local step: every term's projection at the trial, in parallel, and with it the gradient of the next cycle."""
    elastic_gradient(sim, sim.state.x, sim.work.gradient)
    add_contact_gradient(sim, sim.state.x_feasible, sim.state.x, sim.work.gradient[: sim.cloth_count])
