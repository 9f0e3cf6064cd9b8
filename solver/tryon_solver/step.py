"""Algorithm 1 and Algorithm 2: how a worn garment goes from one pose to the next.

Read from top to bottom; every verb is one idea and has a file of its own in stepping/.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tryon_solver.results import StepReport
from tryon_solver.stepping.coast import coast
from tryon_solver.stepping.contact_free import solve_without_contact
from tryon_solver.stepping.correct import correct_penetration
from tryon_solver.stepping.descend import descend_in_subspace, forget_search_history
from tryon_solver.stepping.estimate import estimate_error
from tryon_solver.stepping.leap import go_along
from tryon_solver.stepping.move_body import move_body
from tryon_solver.stepping.passes import contact_passes
from tryon_solver.stepping.predict import predict_positions
from tryon_solver.stepping.proxy import build_contact_proxy, find_pairs, project_locally
from tryon_solver.stepping.record import recorded, unrecorded
from tryon_solver.stepping.remember import remember_contacts
from tryon_solver.stepping.repeat import repeat_until
from tryon_solver.stepping.smooth import smooth_in_full_space
from tryon_solver.stepping.velocity import update_velocity
from tryon_solver.stepping.verify_commit import verify_commit

if TYPE_CHECKING:
    from tryon_solver.body.pose import Pose
    from tryon_solver.simulation import Simulation

Verb = Callable[["Simulation"], None]


@dataclass(frozen=True)
class Scheme:
    """How the proxy problem is solved: verbs run once a step, then a cycle of verbs repeated until nothing moves, and
    whether a GPU can run all of them as one graph."""

    prepare: tuple[Verb, ...]
    cycle: tuple[Verb, ...]
    run: Callable[[Simulation, Verb], None]


def subspace_lbfgs() -> Scheme:
    """Li et al. 2023: reduced L-BFGS with a prefactorised first Hessian, smoothing, local step."""
    return Scheme(
        prepare=(forget_search_history,),  # L-BFGS pairs live for one step
        cycle=(descend_in_subspace, smooth_in_full_space, project_locally),
        run=recorded,
    )


def contact_coarse() -> Scheme:
    """Ours: conjugate gradients on two levels, the coarse one exact and aware of the contacts."""
    from tryon_solver.stepping.two_level import assemble_coarse_level, solve_on_two_levels  # for who asks for it alone

    return Scheme(
        prepare=(assemble_coarse_level,),
        cycle=(solve_on_two_levels, project_locally),
        run=unrecorded,  # it is factored on the host
    )


SCHEMES = {scheme.__name__: scheme for scheme in (subspace_lbfgs, contact_coarse)}


def advance(sim: Simulation, pose: Pose | None, time: float, longest_step: float = 0.0) -> StepReport:
    """Algorithm 2 without an edit: from the last simulated pose time to `time` [s] at `pose`. METHOD.md section 1."""
    sim.start_report()
    for interval in sim.awake(sim.pose_intervals(pose, time, longest_step)):  # none longer than the largest step
        sim.use_time_step(interval.dt, interval.whole)
        sim.timed(move_body, interval, solve_freely)  # carry, kinematic sub-steps: a feasible state at the new pose
        step(sim)
        go_along(sim)  # with the body's speed, where it was to come along
        sim.commit(interval)
    return sim.report()


def step(sim: Simulation) -> None:
    """Algorithm 1: advance the garment by the time step on the body as it stands. METHOD.md section 2."""
    scheme = sim.scheme  # the paper's unless the settings name another
    recorded(sim, solve_freely, done=sim.under_way)  # prediction, one global step there, unless a GPU is at it already
    for _ in contact_passes(sim):  # one, unless the settings ask for more
        sim.timed(find_pairs, scheme.run is unrecorded)  # within reach at the feasible state
        scheme.run(sim, solve_proxy)  # their quadratic proxy, and the scheme's cycles: the trial
        sim.timed(correct_penetration, conclude)  # Newton-PCG on the full potential, every iterate proven free
        sim.timed(verify_commit)  # float64 on what is near; else the pass is void and x goes back
    recorded(sim, conclude, done=sim.concluded)  # as a GPU has by itself where all has gone as it should


def solve_freely(sim: Simulation) -> None:
    """Where the cloth would go if nothing were in its way."""
    sim.timed(predict_positions)  # x_hat = x + dt v + dt^2 M^-1 f_ext
    sim.timed(coast)  # cloth that touches itself alone goes as one
    sim.timed(solve_without_contact)  # one global step at x_hat


def conclude(sim: Simulation) -> None:
    """What has come of the step, at the state in which it ended."""
    sim.timed(remember_contacts)  # how far each has given
    sim.timed(estimate_error)  # how far from balance it ended
    sim.timed(update_velocity)


def solve_proxy(sim: Simulation) -> None:
    """Projective dynamics with the barrier's quadratic proxy: leaves the trial in x."""
    sim.timed(build_contact_proxy)  # made at the feasible state
    for prepare in sim.scheme.prepare:
        sim.timed(prepare)
    repeat_until(sim, at_most=sim.settings.outer_iterations, cycle=sim.scheme.cycle)
