"""Cloth that touches itself alone goes as one to where forces balance, before a step looks for contact and at its end.

A motion that all vertices have in common brings no two of them nearer, and changes nothing of what they do to each
other: of the incremental potential E along it there is left what acts from outside, inertia, drag and what holds
vertices in place, with the sum d of these on the diagonal of the step's matrices. So the cloth goes from x by

    c = -sum_i dE/dx_i / sum_i d_i,

Newton's step, exact but for wind, whose d is an upper bound: E never rises. What rests where forces balance stays.

At the start it goes from where a body that it does not touch may have carried it; the region's anchors go along. Cloth
that falls freely goes a decimetre in a step; with the region in which candidates are known left behind, every vertex is
granted that way to any side, all pairs of triangles are candidates, and what is not granted is lost to the fall. Not
where c is within the SHARE of what the search has to spare anyhow.

At the end, since contact stops vertices one by one, and what a budget then leaves undone is momentum that comes from
nowhere: two cloths that stick to each other went off at 170 m/s.

Not where cloth may touch a body, which does not come along: beside one, a piece of it flies, as does each of several
(fly.py). Ours.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tryon_solver.stepping.gradient import elastic_gradient
from tryon_solver.stepping.record import as_one
from tryon_solver.stepping.search import follow, search_slack, touches_itself_alone

if TYPE_CHECKING:
    import warp as wp

    from tryon_solver.simulation import Simulation

SHARE = 0.5  # of the search's slack


def coast(sim: Simulation) -> None:
    """Take x_feasible as one to where forces balance, when these are known for the step."""
    if touches_itself_alone(sim) and not sim.rests:
        go_to_balance(sim, sim.state.x_feasible, sim.coasting.way, least=SHARE * search_slack(sim))


def keep_momentum(sim: Simulation) -> None:
    """Take x as one to where forces balance, where a correction has ended further off than its tolerance. Not where
    nothing was near in the step: no contact has stopped anything."""
    if not touches_itself_alone(sim) or (sim.listed and sim.candidates.idle):
        return
    slowest = sim.settings.correction_tolerance
    as_one(sim, "keep_momentum", lambda: go_to_balance(sim, sim.state.x, sim.coasting.way_at_end, slowest=slowest))
    follow(sim, near=False)


def go_to_balance(sim: Simulation, x: wp.array, way: wp.array, least: float = 0.0, slowest: float = 0.0) -> None:
    """Move the cloth in x (A,) by c, and the region's anchors, if that is longer than `least` [m] and faster than
    `slowest` [m/s]; the `way` (1,) m is that, or none."""
    work, count, coasting = sim.work, sim.cloth_count, sim.coasting
    elastic_gradient(sim, x, work.gradient)
    scratch = work.total[:count]
    coasting.find_way(work.gradient, work.diagonal, scratch, sim.state.dt, least, slowest, way)
    coasting.go_along(way, count, x, sim.region.anchor)
