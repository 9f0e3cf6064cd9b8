"""Penetration correction: Newton with conjugate gradients on the full incremental potential, from a feasible state.

The paper corrects with inertia and barrier alone. That counts contact twice for a garment under tension (proxy force in
the trial, barrier force in the correction) and leaves it bouncing between two gaps; METHOD.md section 7 has the
argument. Here the correction keeps the elastic matrix: every iteration solves A p = -dE/dx with fresh projections,
exact barrier and friction at the current point. It starts from the trial, as far as that can be reached, or from the
feasible state, whichever is nearer to balance. Every iterate is feasible, so a budget that runs out leaves a safe
state.

The iterations are a loop on the device (stepping/progress.py), on a GPU one graph. It comes back to the host for what a
graph can't do: search further, and make room for more contact pairs.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.contact import bounds, pairs
from tryon_solver.linalg import pcg
from tryon_solver.linalg.as_one import move_as_one
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.one_block import sum_up
from tryon_solver.linalg.read_back import read
from tryon_solver.linalg.side_by_side import side_by_side
from tryon_solver.linalg.vectors import find_largest, subtract
from tryon_solver.stepping.coast import keep_momentum
from tryon_solver.stepping.ending import end_if_well, ends_by_itself, told_at_end
from tryon_solver.stepping.extend import (
    LISTED,
    extend_if_leaving,
    extends_by_itself,
    make_room_for_extension,
    note_extensions,
)
from tryon_solver.stepping.gradient import (
    add_contact_gradient,
    cloth_gradient,
    elastic_gradient,
    surface_gradient,
)
from tryon_solver.stepping.near import make_last_if_near, measure_nearness
from tryon_solver.stepping.newton import linearise, newton_matrix, solve_newton_system
from tryon_solver.stepping.overshoot import retreat_if_overshot
from tryon_solver.stepping.pace import Allowance
from tryon_solver.stepping.progress import HARDLY_NEARER, LED_ASTRAY, Budget, Outcome
from tryon_solver.stepping.record import as_one, baked
from tryon_solver.stepping.search import FURTHER_EDGES, a_few_edges, follow, search_further, searches_left
from tryon_solver.stepping.stride import choose_stride, note_unstopped, stride_out
from tryon_solver.stepping.take import move, take, take_within_region

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


wp.set_module_options({"enable_backward": False})

LITTLE = 0.1  # of what a step that stays would keep from cloth that goes as one, that this may be off balance
MOST_OF_IT = 0.5  # of the way that inertia takes the cloth
SHARES = (1 / 4, 1 / 16, 1 / 64)  # of a direction that leads astray whole
HARMLESS = 0.1  # m/s: what the garment's energy at this speed can do


@wp.kernel
def shorten_kernel(share: float, direction: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    direction[i] = share * direction[i]


@wp.kernel
def trust_kernel(
    speed: float,
    dt: wp.array(dtype=wp.float32),
    trial: wp.array(dtype=wp.float32),
    length: wp.array(dtype=wp.float32),
    direction: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    farthest = 2.0 * trial[0] + speed * dt[0]
    if length[0] > farthest:
        direction[i] = (farthest / length[0]) * direction[i]


@wp.kernel
def keep_kernel(wanted: wp.array(dtype=wp.int32), x: wp.array(dtype=wp.vec3), x_out: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    if wanted[0] == 1:
        x_out[i] = x[i]


def look_around(sim: Simulation, near: bool) -> None:
    """Pairs, friction, gradient and Hessian of the full potential at x; `near` if `take` just went there."""
    if sim.touching and not (near and sim.candidates.idle):
        pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x, near)
    linearise_at(sim)


def linearise_at(sim: Simulation) -> None:
    """Friction, gradient and Hessian of the full potential at x, whose pairs are collected."""
    x, gradient = sim.state.x, sim.work.gradient

    def gradient_of_cloth() -> None:
        cloth_gradient(sim, x, gradient, correcting=True)
        add_contact_gradient(sim, x, x, gradient)

    prepare_contact(sim)
    wp.copy(sim.x_searched, x)
    surface_gradient(sim, x, gradient)
    side_by_side(sim.device, gradient_of_cloth, lambda: linearise(sim))


def gradient_at(sim: Simulation) -> None:
    """Friction and gradient likewise."""
    state, work = sim.state, sim.work
    prepare_contact(sim)
    elastic_gradient(sim, state.x, work.gradient, correcting=True)
    add_contact_gradient(sim, state.x, state.x, work.gradient)


def prepare_contact(sim: Simulation) -> None:
    """Friction at x likewise, seen from where the last iteration began."""
    if sim.pairs.size:
        for term in sim.stages.contact:
            term.prepare(sim.pairs, sim.state, sim.state.x, sim.x_searched)


def measure_imbalance(sim: Simulation, out: wp.array) -> None:
    """out[0] = <g, D^-1 g> [J] at x as looked around, D the Hessian's blocks: how far from where forces balance."""
    pcg.preconditioned_norm_sq(sim.cg, sim.work.blocks, sim.work.gradient, out)


def imbalance(sim: Simulation) -> float:
    """The same for the host, which waits for it."""
    out = sim.progress.tried
    measure_imbalance(sim, out)
    return float(read(out)[0][0])


def start_at_feasible(sim: Simulation) -> None:
    """As if no iteration had been elsewhere: what friction remembers of one would leave it without normal forces."""
    wp.copy(sim.state.x, sim.state.x_feasible)
    wp.copy(sim.x_searched, sim.state.x_feasible)


def choose_start(sim: Simulation) -> None:
    """For the device: from x_feasible to the trial as far as it is free, unless x_feasible is nearer to balance.

    A garment at rest thus stays where it is instead of being let go and caught again in every step, and one in fast
    motion does not follow a trial that its few cycles left far off. The pairs must be those at x_feasible.
    """
    state, work, progress = sim.state, sim.work, sim.progress
    start_at_feasible(sim)
    linearise_at(sim)
    measure_imbalance(sim, progress.standing)
    if sim.touching:
        work.alpha.fill_(1.0)
        bounds.count_leaving(state.x, sim.to_trial, work.alpha, sim.region, progress.leaving)
        extend_if_leaving(sim, sim.to_trial, starting=True)

    def attempt() -> None:
        wp.copy(work.direction, sim.to_trial)
        take_within_region(sim, work.direction)
        look_around(sim, near=True)
        measure_imbalance(sim, progress.tried)
        progress.if_tried_in_vain(sim.pairs, back)

    def back() -> None:
        start_at_feasible(sim)
        if sim.touching:
            follow(sim, near=False)
        look_around(sim, near=False)

    progress.if_free_to_try(attempt)


def trial_is_in_vain(sim: Simulation) -> bool:
    """Is the trial further away than a search reaches, and, with contact left out, led astray beside x_feasible? Waits
    for the device. x must be x_feasible, and is again, but not looked around.

    A search along such a way finds all that the whole garment could meet on it, in vain: in a wind or under a pressure
    that projective dynamics' few cycles do not come to balance with, cloth that stands has trials of decimetres.
    """
    state, work, progress = sim.state, sim.work, sim.progress
    if float(read(progress.trial)[0][0]) <= FURTHER_EDGES * sim.mean_edge:
        return False
    work.alpha.fill_(1.0)
    move(sim, sim.to_trial)
    elastic_gradient(sim, state.x, work.gradient, correcting=True)
    linearise(sim)
    measure_imbalance(sim, progress.tried)
    tried, standing = (float(value[0]) for value in read(progress.tried, progress.standing))
    start_at_feasible(sim)
    return led_astray(sim, standing, tried)


def correct_penetration(sim: Simulation, conclude: Callable[[Simulation], None]) -> None:
    """From x_feasible and the trial in x by Newton iterations; leaves a feasible x.

    Newton's steps that lead uphill come back (overshoot.py), but the first, and what contact stopped in one is held in
    the next (hold.py). The budget's last is not taken when it is much longer than the one before. A fold that snaps
    takes several, the first of them uphill: where the budget ends among these it is extended. Where that is spent as
    well, x is where an iteration began nearest to balance, and the next step has the snap. Not twice in a row, unless
    that is much nearer than where the step began: one that only finds back there would be found again by all that
    follow, and the garment would stand frozen. A budget is extended likewise where the cloth as one has still to move.
    With more contact passes the next pass goes on with a snap: nothing is extended and nothing goes back.

    Conjugate gradients that are cut short in a blow lead astray, each direction further than the one before: then all
    of it is done again from x_feasible with the second budget. If that leads astray, too, x is where an iteration began
    nearest to balance; and where all but the first began astray, a little of the first one's way, or the step is void:
    the garment is carried along and nothing else, for what it would do instead tears it. What leaves cloth torn is done
    again likewise (torn.py).

    A GPU may `conclude` the step at once, of which `sim.concluded` tells (ending.py).
    """
    settings = sim.settings
    as_one(sim, "way_to_trial", lambda: way_to_trial(sim))
    once = settings.contact_passes == 1
    allowed = sim.pace.iterations(sim.budget.iterations)
    budget = sim.budget if sim.pace.thorough else sim.brief_budget
    outcome = iterate_newton(sim, budget, allowed, once, conclude if ends_by_itself(sim) else None, starting=True)
    sim.concluded, sim.figures = outcome.concluded, outcome.figures if outcome.concluded else None
    if sim.halving is not None:
        sim.halving.grown = outcome.carried
    if once and not sim.concluded:
        if settings.second_iterations and ended_astray(sim, outcome):
            outcome = again(sim, sim.second_budget, outcome)
        if sim.tears is not None and not settings.ends_by_accuracy and sim.tears.torn(outcome.stretch):
            outcome = again(sim, sim.tears.budget, outcome)
            sim.tears.bear(outcome.stretch)
        leave_off(sim, outcome)
    elif sim.concluded:
        sim.went_back = sim.stood = False
        if sim.tears is not None:
            sim.tears.bear_none()
    keep_momentum(sim)
    if outcome.iterations:
        sim.counters.residual = outcome.wanted / sim.dt


def way_to_trial(sim: Simulation) -> None:
    """For the device: `to_trial`, from x_feasible to where the scheme has come, as contacts let it; nothing is held."""
    if sim.touching:
        sim.holding.release()
    subtract(sim.state.x, sim.state.x_feasible, sim.to_trial)
    for term in sim.stages.contact:
        if term.restrain is not None and sim.pairs.size:
            term.restrain(sim.pairs, sim.to_trial)
    find_largest(sim.to_trial, sim.progress.trial)


def again(sim: Simulation, budget: Budget, outcome: Outcome) -> Outcome:
    """Do all of it again from x_feasible with another budget, if it is allowed any."""
    allowed = sim.pace.again(budget.iterations)
    if not allowed.at_most:
        return outcome
    start_again(sim)
    return iterate_newton(sim, budget, allowed, extensible=False)


def leave_off(sim: Simulation, outcome: Outcome) -> None:
    """Stay where the iterations ended, or go back: to the nearest to balance, or if that is astray, near x_feasible."""
    several = outcome.iterations > 1  # else none but the first began anywhere
    astray = ended_astray(sim, outcome)
    lost = several and astray and led_astray(sim, outcome.began, outcome.least)
    found_back = sim.went_back and outcome.least > HARDLY_NEARER * outcome.began
    sim.went_back = not lost and (astray or (outcome.strayed and not found_back))
    stood, sim.stood = sim.stood, False
    if lost:
        go_a_little(sim, outcome.began, stood)
    elif sim.went_back:
        go_back_to_least(sim)


def go_a_little(sim: Simulation, began: float, stood: bool) -> None:
    """From x_feasible cloth of one piece as one, which loses no momentum and tears nothing, or along Newton's
    direction, shortened until it does not lead astray; else the step is void. Not where the step before `stood`, too:
    from the same state all that follow would, so it goes the least of these ways, wherever that leads."""
    if sim.of_one_piece and goes_as_one(sim, began):
        return
    for share in SHARES:
        if leads_well(sim, began, partial(find_share, sim, share)):
            return
    if stood and SHARES:
        return
    start_again(sim)
    sim.counters.retries += 1
    sim.stood = True


def goes_as_one(sim: Simulation, began: float) -> bool:
    """Go from x_feasible as one; is that most of where inertia takes it? Cloth around a ball goes nowhere so. It may be
    off balance by a LITTLE of what staying would keep from it: gaps that it slides with do not stay as they were."""
    now = gone_to(sim, partial(find_common_move, sim))
    places = sim.state.x, sim.state.x_hat, sim.state.x_feasible
    x, predicted, feasible = (each.numpy()[: sim.cloth_count] for each in places)
    kept = sim.total_mass * float(np.linalg.norm((x - feasible).mean(axis=0)) / sim.dt) ** 2
    if led_astray(sim, began, now) and now > LITTLE * kept:
        return False
    return bool(np.linalg.norm(x - feasible) > MOST_OF_IT * np.linalg.norm(predicted - feasible))


def leads_well(sim: Simulation, began: float, find: Callable[[], None]) -> bool:
    """Go from x_feasible along the `direction` that is found there; does it not lead astray?"""
    return not led_astray(sim, began, gone_to(sim, find))


def gone_to(sim: Simulation, find: Callable[[], None]) -> float:
    """Go from x_feasible along the `direction` that is found there; how far from balance is where it leads [J]?"""
    start_again(sim)
    find()
    take(sim, sim.work.direction)
    look_around(sim, near=True)
    return imbalance(sim)


def find_share(sim: Simulation, share: float) -> None:
    """Of Newton's direction."""
    find_direction(sim, sim.second_budget)
    launch(shorten_kernel, sim.all_count, [share], [sim.work.direction], device=sim.device)


def find_common_move(sim: Simulation) -> None:
    """The best move and turn of all the cloth."""
    sim.work.direction.zero_()
    subtract(sim.work.direction, sim.work.gradient, sim.cg.residual)
    improve_as_one(sim)


def ended_astray(sim: Simulation, outcome: Outcome) -> bool:
    """Did iterations lead astray, by where the last began? Not where its direction was short and led out of it: forces
    of a barrier that cloth has just come into are large beside none, and gone with the next micrometre."""
    if not led_astray(sim, outcome.began, outcome.last):
        return False
    if not outcome.near:
        return True
    if sim.touching and not sim.candidates.idle:
        sim.candidates.size_near_list()  # a graph has made it, and nobody has asked how long it is
    look_around(sim, near=True)
    return imbalance(sim) > outcome.last


def led_astray(sim: Simulation, began: float, now: float) -> bool:
    """Is an imbalance [J] larger than where the first iteration began by far, and by more than is harmless?"""
    return now > max(LED_ASTRAY * began, 0.5 * sim.total_mass * HARMLESS**2)


def start_again(sim: Simulation) -> None:
    """At x_feasible, as if nothing had been corrected: nothing is held, and searching is free again."""
    if sim.touching:
        sim.holding.release()
    start_at_feasible(sim)
    if sim.touching:
        sim.searches = 0
        follow(sim, near=False)
    look_around(sim, near=False)


def iterate_newton(
    sim: Simulation,
    budget: Budget,
    allowed: Allowance,
    extensible: bool,
    conclude: Callable[[Simulation], None] | None = None,
    starting: bool = False,
) -> Outcome:
    """Newton iterations, until nothing moves or `at_most` are made: from x as looked around, or `starting` from what
    `choose_start` takes. Where they end as they should a GPU is to `conclude` the step, if that is given."""
    progress, settings = sim.progress, sim.settings
    extensions = settings.correction_extensions if extensible and settings.ends_by_budget else 0
    searches = searches_left(sim)
    progress.begin(allowed.at_most, extensions, searches, starting)
    more = sim.pace.more(0, sim.candidates.size)  # which is seldom less than its budget: else nothing is launched
    if more is not None and (settings.deadline is not None or more.at_most < allowed.at_most * (1 + extensions)):
        allow(sim, more, least=0)
    if not sim.candidates.idle:  # and nobody may have asked how many pairs there are
        sim.pairs.stop_when_full(progress.going_on, progress.wants_room)
    judged = False  # the trial, before the first search along the way to it

    def turn() -> None:
        if not sim.candidates.idle:
            sim.pairs.cover_in_graph()
        progress.if_starting(lambda: choose_start(sim))
        iterate(sim, budget)

    def run() -> None:
        wp.capture_while(progress.going_on, turn)
        if sim.tears is not None:
            sim.tears.measure(sim.state.x)
        if conclude is not None:
            end_if_well(sim, HARMLESS, conclude)

    while True:
        budget.graph.run(run, (conclude is None, *baked(sim)), sim.device)
        told = {} if conclude is None else told_at_end(sim)
        if extends_by_itself(sim):
            told[LISTED] = sim.candidates.count
        outcome = progress.read(sim.pairs, told)
        if LISTED in told:
            note_extensions(sim, searches, outcome)
        if outcome.wants_search and outcome.starting and not (judged or outcome.unfitted) and trial_is_in_vain(sim):
            searches = outcome.searches
            linearise_at(sim)
            progress.start_here()
        elif outcome.wants_search or outcome.wants_room:
            if outcome.unfitted:
                make_room_for_extension(sim)
            elif outcome.wants_search:
                judged = outcome.starting
                wanted = sim.to_trial if outcome.starting else sim.work.direction
                search_further(sim, wanted, sim.work.alpha, a_few_edges(sim, outcome.leaving))
            else:
                make_room(sim, outcome)
            searches = searches_left(sim)
            progress.resume(searches, outcome.starting)
        else:
            break
        least = 0 if outcome.wants_search and not outcome.starting else 1  # no direction waits to be taken
        if (more := sim.pace.more(outcome.iterations, sim.candidates.size)) is not None:
            allow(sim, more, least)
    sim.pace.corrected(outcome.iterations)
    sim.counters.newton_iterations += outcome.iterations
    return outcome


def allow(sim: Simulation, more: Allowance, least: int) -> None:
    """From here on `more` iterations, `least` at any rate."""
    if sim.settings.deadline is None:
        sim.progress.limit(max(least, more.at_most))
    else:
        sim.progress.hurry(more.in_time, max(least, more.at_most))


def make_room(sim: Simulation, outcome: Outcome) -> None:
    """For the pairs that there are at x; who was `starting` is at x_feasible again."""
    sim.candidates.size_near_list()
    sim.pairs.make_room(outcome.pairs)
    if outcome.starting:
        start_at_feasible(sim)
        follow(sim, near=False)
    pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x, near=not outcome.starting)
    for term in sim.stages.contact:
        term.make_room(sim.pairs)
    if not outcome.starting:
        linearise_at(sim)


def go_back_to_least(sim: Simulation) -> None:
    """Put x to the iterate that was nearest to balance; like all of them it is feasible."""
    state, work = sim.state, sim.work
    wp.copy(state.x, work.least)
    if sim.touching:
        follow(sim, near=False)


def iterate(sim: Simulation, budget: Budget) -> None:
    """One Newton iteration, for the device to repeat: a direction, unless there is one, and, where it leads within the
    region or there is no searching left, the move, back to where it stops descending, and a look around."""
    state, work, progress = sim.state, sim.work, sim.progress
    progress.unless_directed(lambda: find_direction(sim, budget))
    if sim.touching:
        work.alpha.fill_(1.0)
        bounds.count_leaving(state.x, work.direction, work.alpha, sim.region, progress.leaving)
        extend_if_leaving(sim, work.direction, starting=False)

    def move() -> None:
        wp.copy(work.wanted, work.direction)
        take_within_region(sim, work.direction)
        if not sim.candidates.idle:
            sim.holding.measure(work.wanted, work.total)
        find_largest(work.total, progress.moved)
        make_last_if_near(sim)
        note_unstopped(sim)
        progress.judge_move(sim.settings.correction_tolerance, state.dt)
        collect_near()
        retreat_if_overshot(sim, lambda: gradient_at(sim), come_back)
        choose_stride(sim)
        progress.if_going_on(look)

    def collect_near() -> None:
        if not sim.candidates.idle:
            pairs.collect(sim.pairs, sim.candidates, sim.contact, state.x, bool(sim.touching))

    def come_back() -> None:
        if sim.touching:
            follow(sim, near=True)
        collect_near()

    def look() -> None:
        wp.copy(sim.x_searched, state.x)
        linearise(sim)
        if not sim.candidates.idle:
            sim.pairs.stop_when_full(progress.going_on, progress.wants_room)

    progress.if_free_to_move(move)


def improve_as_one(sim: Simulation) -> None:
    """Of what `direction` leaves, as `cg` has it, what a common move and turn of the cloth can meet."""
    work = sim.work
    cloth = sim.state.x, sim.cloth_count, sim.of_one_piece
    move_as_one(sim.cg, newton_matrix(sim), *cloth, work.as_one, work.direction)


def find_direction(sim: Simulation, budget: Budget) -> None:
    """Newton's direction at x as looked around; the budget's last is dropped if it overshoots. Keeps the x that is
    nearest to balance."""
    work, settings = sim.work, sim.settings
    solve_newton_system(sim, budget.pcg_iterations)
    stride_out(sim)
    improve_as_one(sim)
    find_largest(work.direction, sim.progress.length)
    trusted = [budget.trusted, sim.state.dt, sim.progress.trial, sim.progress.length]
    launch(trust_kernel, sim.all_count, trusted, [work.direction], device=sim.device)
    measure_nearness(sim, budget.ends_near)
    together = sim.cg.single
    sum_up(work.direction, sim.cloth_count, together)
    unsettled, dt = settings.correction_unsettled, sim.state.dt
    sim.progress.judge_direction(sim.cg.first, unsettled, dt, together, sim.cloth_count)
    launch(keep_kernel, sim.all_count, [sim.progress.least_yet, sim.state.x], [work.least], device=sim.device)
