"""What `Settings.accuracy` and `Settings.deadline` buy: errors as small as asked for, and calls as short, by a
clock that the test winds."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from against_reference import rms, simulation_at
from contact_scenes import DT, square_on_sphere

from tryon_solver.baselines.newton_ipc import Motion
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import near, pace
from tryon_solver.stepping.pace import LEAST_CROWDED, MOST_LOOKED_AT, Allowance, Hurried, Unhurried, time_of_iteration
from tryon_solver.stepping.progress import LAST_ONE, SHORTEST
from tryon_solver.stepping.search import searches_left

LIVE = PRESETS["live"]


@pytest.fixture(scope="module")
def met():
    """A square that has just met a ball: the case, and the states that steps set out from, by their numbers."""
    case = square_on_sphere()
    sim = build(case.scene, LIVE, "cpu", case.pose_at(0))
    motions = {}
    for k in range(1, 18):
        sim.advance(case.pose_at(k), k * DT)
        x = np.vstack([sim.cloth_positions(), sim.body_positions()]).astype(np.float64)
        motions[k] = Motion(x, sim.state.v.numpy().astype(np.float64), case.pose_at(k))
    return case, motions


def step(met, settings, after=12):
    case, motions = met
    sim = simulation_at(case, motions[after], settings)
    report = sim.advance(case.pose_at(after + 1), DT)
    return report, sim.cloth_positions()


@pytest.fixture(scope="module")
def true(met):
    """(N, 3) m, where a solved step of a blow ends, by the number of the state that it sets out from."""
    reference = replace(PRESETS["reference"], largest_step=DT)
    ends = {after: step(met, reference, after)[1] for after in range(10, 17)}
    for x in ends.values():
        x.setflags(write=False)
    return ends


@pytest.mark.parametrize("preset", ["draft", "live"])
def test_the_smaller_the_error_that_is_asked_for_the_smaller_it_is_and_the_more_iterations_it_takes(met, true, preset):
    """What is asked for is what errors are in the middle: of cloth that buckles a step has more than one balance."""
    asked = replace(PRESETS[preset], largest_step=DT)
    accuracies, errors, taken = (3e-4, 3e-5, 3e-6), [], []
    for after in range(10, 17):
        ends = [step(met, replace(asked, accuracy=accuracy), after) for accuracy in accuracies]
        errors.append([rms((x - true[after]).astype(np.float64)) for _, x in ends])
        taken.append([report.newton_iterations for report, _ in ends])
    error, iterations = np.median(errors, axis=0), np.median(taken, axis=0)
    assert (error > 0).all()
    assert (error < accuracies).all()
    assert error[0] > 3 * error[1] > 9 * error[2]
    assert iterations[0] < iterations[1] < iterations[2]


def test_a_budget_that_is_too_small_for_the_accuracy_is_not_kept_to(met):
    short = replace(LIVE, correction_iterations=1, second_iterations=0, correction_extensions=0)
    report, _ = step(met, short)
    assert report.newton_iterations == 1
    asked, _ = step(met, replace(short, accuracy=3e-6))
    assert asked.newton_iterations > 2
    assert asked.error < report.error / 10
    capped, _ = step(met, replace(short, accuracy=3e-6, most_iterations=2))
    assert capped.newton_iterations == 2


@pytest.mark.parametrize(("times", "patience"), [(3.9, near.PATIENCE), (4.1, near.PERSISTENCE)])
def test_what_comes_no_nearer_is_given_up_soon_where_it_is_near_and_later_where_it_is_far(times, patience):
    """Directions that have come to so many times what was asked for and no nearer."""
    asked, count = 1e-4, 10
    accuracy = wp.array([asked], dtype=wp.float32, device="cpu")
    squared = wp.array([count * (times * asked / near.SCALE) ** 2], dtype=wp.float32, device="cpu")
    state = wp.zeros(int(LAST_ONE) + 1, dtype=wp.int32, device="cpu")
    lengths = wp.full(int(SHORTEST) + 1, wp.inf, dtype=wp.float32, device="cpu")
    ended = []
    for _ in range(30):
        inputs = [accuracy, squared, count, near.SCALE, state, lengths]
        wp.launch(near.compare_asked_kernel, 1, inputs, device="cpu")
        ended.append(bool(state.numpy()[int(LAST_ONE)]))
    assert ended.index(True) == int(patience)


def test_a_correction_that_is_near_enough_at_that_length_of_step_ends_before_its_budget(met):
    taken = [step(met, replace(LIVE, correction_nearness=speed))[0].newton_iterations for speed in (1e-1, 1e-2)]
    spent, _ = step(met, LIVE)
    assert 0 < taken[0] < taken[1] < spent.newton_iterations


def test_cloth_that_hardly_moves_has_to_be_near_by_its_own_way_and_takes_as_long_as_without(met, monkeypatch):
    far_too_near = replace(LIVE, correction_nearness=1e3)  # all is within it
    early, _ = step(met, far_too_near)
    monkeypatch.setattr(near, "OF_WAY", 1e-6)
    spent, _ = step(met, replace(LIVE, correction_extensions=0))
    assert step(met, far_too_near)[0].newton_iterations == spent.newton_iterations > early.newton_iterations


def test_one_that_is_not_near_enough_when_its_budget_ends_is_extended(met):
    short = replace(LIVE, correction_iterations=1, correction_extensions=2, second_iterations=0)
    assert step(met, replace(short, correction_nearness=1e-9))[0].newton_iterations == 3
    assert step(met, replace(short, correction_nearness=1e3))[0].newton_iterations == 1


def test_with_a_deadline_time_is_not_left_unused_for_being_near_enough(met):
    near_enough = replace(LIVE, correction_nearness=3e-2)
    in_time = [step(met, replace(s, deadline=100.0))[0].newton_iterations for s in (near_enough, LIVE)]
    assert in_time[0] == in_time[1] > step(met, near_enough)[0].newton_iterations


def test_a_late_correction_ends_where_it_is_near_enough_and_goes_on_as_long_as_without_a_deadline(met):
    late = replace(LIVE, deadline=1e-6, correction_iterations=2, correction_extensions=2, correction_tolerance=1e-12)
    taken = [step(met, replace(late, late_nearness=speed), 15)[0].newton_iterations for speed in (1e3, 1e-1, 1e-9)]
    assert taken[0] == 1
    assert 1 < taken[1] < 6
    assert taken[2] == 6, "a budget and two extensions"
    asked, _ = step(met, replace(late, late_nearness=1e-9, accuracy=0.1), 15)
    assert asked.newton_iterations == 1, "an accuracy that is less ends it before"


def errors_with_more_and_none(met, true, draft):
    """RMS errors [m] of steps in a blow, with the gradients and searches of what is bought, and with a budget's."""
    errors = []
    for settings in (draft, replace(draft, most_pcg_iterations=15, most_searches=6)):
        errors.append([])
        for after in (14, 15, 16):
            errors[-1].append(rms((step(met, settings, after)[1] - true[after]).astype(np.float64)))
    return errors


def test_in_a_blow_an_accuracy_is_come_to_with_more_gradients_and_searches_than_a_budget_has(met, true):
    draft = replace(PRESETS["draft"], largest_step=DT, accuracy=3e-6)
    more, none = errors_with_more_and_none(met, true, draft)
    assert 0 < max(more) < 1e-5
    assert min(none) > 1e-4, "it stood where its directions were too short and its candidates ended"


def test_more_gradients_and_searches_are_for_what_is_bought_alone(met):
    case, motions = met
    draft = PRESETS["draft"]
    sim = simulation_at(case, motions[12], draft)
    had = []
    for bought in ((None, None), (1e-4, None), (1e-4, 0.5), (None, 0.5), (None, None)):
        sim.buy(*bought)
        had.append((sim.budget.pcg_iterations, searches_left(sim) + sim.searches))
    budget = draft.correction_pcg_iterations, draft.searches
    assert had == [budget, *[(draft.most_pcg_iterations, draft.most_searches)] * 3, budget]


def test_the_first_call_with_a_deadline_goes_by_what_iterations_took_without(met):
    case, motions = met
    sim = simulation_at(case, motions[12], LIVE)
    report = sim.advance(case.pose_at(13), DT)
    each = time_of_iteration(report)
    assert 0 < each < 1e-3 * report.times_ms["correct_penetration"] / report.newton_iterations
    sim.buy(None, 0.5)
    assert sim.pace._brief.expected == pytest.approx(each)
    assert time_of_iteration(replace(report, newton_iterations=0)) is None


def test_what_a_deadline_has_seen_is_known_when_it_comes_back(met):
    case, motions = met
    sim = simulation_at(case, motions[12], PRESETS["draft"])
    sim.buy(None, 0.5)
    seen = sim.pace
    sim.buy(None, None)
    assert sim.pace is not seen
    sim.buy(1e-4, 0.25)
    assert sim.pace is seen


def test_more_time_buys_a_nearer_step_than_a_budgets_gradients_do(met, true):
    """However long they had, a silk square's steps onto a ball ended where 15 gradients and 6 searches lead."""
    draft = replace(PRESETS["draft"], largest_step=DT, deadline=100.0)
    more, none = errors_with_more_and_none(met, true, draft)
    assert 0 < 10 * max(more) < min(none)


def test_an_accuracy_that_is_asked_for_comes_before_what_is_near_enough(met):
    asked, _ = step(met, replace(LIVE, accuracy=3e-6, correction_nearness=1e3))
    assert asked.newton_iterations == step(met, replace(LIVE, accuracy=3e-6))[0].newton_iterations


def test_it_is_bought_anew_while_the_simulation_runs_and_nothing_is_built(met):
    case, motions = met
    sim = simulation_at(case, motions[12], LIVE)
    before = {name: value for name, value in vars(sim).items() if name not in BOUGHT}
    sim.buy(1e-3, 0.5)
    assert {name: value for name, value in vars(sim).items() if name not in BOUGHT} == before
    first = sim.advance(case.pose_at(13), DT)
    sim.buy(1e-6, None)
    second = sim.advance(case.pose_at(14), 2 * DT)
    assert first.newton_iterations < second.newton_iterations
    sim.buy(None, None)
    assert sim.settings == LIVE
    assert sim.advance(case.pose_at(15), 3 * DT).newton_iterations <= LIVE.correction_iterations


BOUGHT = ("settings", "recorded_settings", "pace", "hurried", "budget", "accuracy")


@pytest.mark.parametrize("value", [0.0, -0.01, float("nan"), float("inf"), True, "1e-4"])
def test_a_nearness_that_can_not_be_is_refused_by_name(value):
    with pytest.raises(ValueError, match=r"settings\.correction_nearness must be a finite number above 0"):
        replace(LIVE, correction_nearness=value)


@pytest.mark.parametrize("field", ["accuracy", "deadline"])
@pytest.mark.parametrize("value", [0.0, -0.01, float("nan"), float("inf"), True, "1e-4", [1e-4], 1e-4j])
def test_what_can_not_be_bought_is_refused_by_name(met, field, value):
    with pytest.raises(ValueError, match=rf"settings\.{field} must be a finite number above 0"):
        replace(LIVE, **{field: value})
    case, motions = met
    sim = simulation_at(case, motions[12], LIVE)
    with pytest.raises(ValueError, match=rf"settings\.{field}"):
        sim.buy(**{"accuracy": None, "deadline": None, field: value})
    assert sim.settings == LIVE


class Clock:
    """A clock that stands still but for what it is told."""

    def __init__(self):
        self.now = 100.0

    def perf_counter(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    wound = Clock()
    monkeypatch.setattr(pace, "clock", wound)
    return wound


class Machine:
    """Plays calls of `advance` on a clock, for a pace: seconds for the body, a cycle, an iteration, and the rest; a
    correction is near enough for its end after `needed` iterations."""

    search, cycle, tail = 1e-3, 5e-4, 1e-3

    def __init__(self, clock, hurried, iteration=1e-3, brief=1.0, needed=1):
        self.clock, self.pace, self.iteration, self.brief, self.needed = clock, hurried, iteration, brief, needed

    def call(self, steps=1, body=1e-3, slower=1.0):
        """One call; what it took [s], how late it was by the pace, and cycles and iterations of its steps."""
        begun, spent, hurried = self.clock.now, [], self.pace
        hurried.begin()
        for k in range(steps):
            hurried.begin_step(steps - k)
            self.clock.now += slower * body
            cycles = hurried.cycles()
            self.clock.now += slower * (self.search + cycles * self.cycle)
            allowed = hurried.iterations(100)
            iterations = max(allowed.in_time, min(self.needed, allowed.at_most))
            self.clock.now += slower * (2 + iterations) * self.iteration * (1.0 if hurried.thorough else self.brief)
            hurried.corrected(iterations)
            self.clock.now += slower * self.tail
            spent.append((cycles, iterations))
        late = hurried.end()
        return self.clock.now - begun, late, spent


def hurried(deadline):
    return Hurried(replace(LIVE, deadline=deadline, correction_iterations=3), "cpu")  # and 9 by extensions


def test_a_deadline_is_met_once_the_costs_are_known_and_its_time_is_used(clock):
    machine = Machine(clock, hurried(20e-3))
    calls = [machine.call() for _ in range(30)]
    for took, late, spent in calls[3:]:
        assert took <= 20e-3
        assert late == 0
        assert took > 20e-3 - 2 * machine.iteration - 0.03 * 20e-3, "no further iteration would have fitted"
        assert spent[0][0] == LIVE.outer_iterations


def test_another_deadline_is_bought_with_the_costs_known(clock):
    machine = Machine(clock, hurried(60e-3), iteration=3e-3)
    for _ in range(30):
        machine.call()
    machine.pace.buy(replace(LIVE, deadline=30e-3, correction_iterations=3))
    took, late, _ = machine.call()
    assert late == 0, "from the first call on"
    assert took > 20e-3
    assert Machine(clock, hurried(30e-3), iteration=3e-3).call()[1] > 0, "who knows nothing is late at first"
    told = Hurried(replace(LIVE, deadline=30e-3, correction_iterations=3), "cpu", iteration=3e-3)
    assert Machine(clock, told, iteration=3e-3).call()[1] == 0, "who has frames without a deadline to go by is not"


def test_the_shortest_deadline_that_there_is_is_missed_and_no_error(met):
    report, _ = step(met, replace(LIVE, deadline=5e-324))
    assert report.late > 0


def test_what_is_dear_is_given_up_first_where_the_deadline_is_short(clock):
    machine = Machine(clock, hurried(12e-3))
    calls = [machine.call(body=4e-3) for _ in range(200)]
    for took, late, [(cycles, iterations)] in calls[10:]:
        assert took <= 12e-3
        assert late == 0
        assert cycles == 1, "of four"
        assert iterations >= 1


def test_a_deadline_that_can_not_be_met_is_missed_by_what_is_told_with_the_least_of_everything(clock):
    for needed, made in ((1, 1), (5, 5), (100, 12)):
        machine = Machine(clock, hurried(2e-3), needed=needed)
        calls = [machine.call(body=4e-3) for _ in range(20)]
        for took, late, spent in calls[3:]:
            assert late == pytest.approx(took - 2e-3)
            assert spent == [(1, made)], "what it needs, and no more than without one"


def test_the_time_of_a_call_is_shared_by_its_steps(clock):
    machine = Machine(clock, hurried(40e-3))
    took, late, spent = [machine.call(steps=3) for _ in range(10)][-1]
    assert took <= 40e-3
    assert late == 0
    assert max(iterations for _, iterations in spent) <= 1 + min(iterations for _, iterations in spent)


def test_iterations_are_thorough_where_there_is_time_for_a_budget_of_such_and_else_brief(clock):
    """Brief ones take a third; they come and go with the deadline, and hold it."""
    machine = Machine(clock, hurried(30e-3), iteration=3e-3, brief=1 / 3)
    for deadline, thorough in ((30e-3, True), (16e-3, False), (30e-3, True)):
        machine.pace.buy(replace(LIVE, deadline=deadline, correction_iterations=3))
        calls = [(*machine.call(), machine.pace.thorough) for _ in range(80)]
        for took, late, [(_, iterations)], was in calls[5:]:
            assert was == thorough
            assert took <= deadline
            assert late == 0
            assert iterations >= (3 if thorough else 2)


def test_a_machine_that_gets_slower_is_followed(clock):
    machine = Machine(clock, hurried(20e-3))
    before = [machine.call() for _ in range(30)][-1]
    after = [machine.call(slower=2.0) for _ in range(30)]
    assert sum(late > 0 for _, late, _ in after) <= 6, "until that is seen"
    assert after[-1][1] == 0
    assert after[-1][2][0][1] < before[2][0][1]


def slow_for_once(machine, part):
    normal = getattr(machine, part)
    setattr(machine, part, 40 * normal)
    assert machine.call()[1] > 0
    setattr(machine, part, normal)


@pytest.mark.parametrize("part", ["tail", "iteration", "search"])
def test_one_call_that_is_slow_for_once_costs_those_after_it_little(clock, part):
    machine = Machine(clock, hurried(20e-3))
    usual = [machine.call() for _ in range(70)][-1][2][0][1]
    slow_for_once(machine, part)
    after = [machine.call() for _ in range(70)]
    assert all(late == 0 for _, late, _ in after)
    assert min(iterations for _, _, [(_, iterations)] in after) > 0.4 * usual


def test_two_in_sixty_are_reckoned_with_for_so_many_may_not_be_late(clock):
    machine = Machine(clock, hurried(20e-3))
    usual = [machine.call() for _ in range(70)][-1][2][0][1]
    slow_for_once(machine, "tail")
    slow_for_once(machine, "tail")
    after = [machine.call()[2][0][1] for _ in range(70)]
    assert after[0] < 0.3 * usual
    assert after[-1] == usual, "until they are long past"


def test_a_correction_that_stops_on_the_way_or_is_done_again_has_what_is_left(clock):
    hurried_pace = hurried(20e-3)
    machine = Machine(clock, hurried_pace)
    for _ in range(10):
        machine.call()
    hurried_pace.begin()
    hurried_pace.begin_step(1)
    hurried_pace.cycles()
    planned = hurried_pace.iterations(100)
    assert planned.at_most == max(planned.in_time, 12), "what it has with its extensions"
    clock.now += 6e-3
    in_time = hurried_pace.again(100).in_time
    assert 0 < in_time <= planned.in_time - 5
    assert hurried_pace.more(1, 0) == Allowance(in_time + 2, 99), "where it begins is chosen already"
    assert hurried_pace.more(98, 0) == Allowance(2, 2), "all of it together no more than at most"
    hurried_pace.iterations(100)
    clock.now += 20e-3
    left = [hurried_pace.more(made, 0) for made in (0, 1, 12)]
    assert left == [Allowance(0, 12), Allowance(0, 11), Allowance(0, 0)], "late as it is"
    assert hurried_pace.again(24) == Allowance(0, 24)
    assert hurried_pace.more(4, 0) == Allowance(0, 20)
    hurried_pace.corrected(12)
    took, late, _ = machine.call()
    assert took > 20e-3 - 2 * machine.iteration - 0.03 * 20e-3, "what was done again makes no other look dearer"
    assert late == 0


def test_without_a_deadline_a_step_goes_through_so_many_candidates_and_no_budget_is_cut_otherwise():
    unhurried = Unhurried(LIVE, 1000)
    unhurried.begin_step(1)
    crowd = 300 * 1000
    worth = MOST_LOOKED_AT // 300
    assert unhurried.more(0, 100 * 1000).at_most >= LIVE.correction_iterations * (1 + LIVE.correction_extensions)
    assert unhurried.more(0, crowd).at_most == worth
    assert unhurried.more(3, 2 * crowd).at_most == (worth - 3) // 2, "three were on the shorter list"
    unhurried.corrected(4)
    assert unhurried.again(100).at_most == (worth - 5) // 2, "the fourth was on the longer one"
    assert unhurried.more(0, 100 * crowd).at_most == LEAST_CROWDED
    unhurried.corrected(LEAST_CROWDED)
    assert unhurried.again(100).at_most == 0
    unhurried.begin_step(1)
    assert unhurried.more(0, crowd).at_most == worth, "each step has its own"


@pytest.mark.parametrize("changed", [{"accuracy": 1e-4}, {"contact_passes": 2}])
def test_who_asks_for_the_balance_gets_it_on_any_list(changed):
    unhurried = Unhurried(replace(LIVE, **changed), 1000)
    unhurried.begin_step(1)
    assert unhurried.more(0, 10**7) is None
    assert unhurried.again(24).at_most == 24


def test_the_body_comes_as_far_under_a_deadline_however_late_it_is(met):
    case, motions = met
    patient = simulation_at(case, motions[12], LIVE)
    usual = patient.advance(case.pose_at(16), DT)
    rushed = simulation_at(case, motions[12], replace(LIVE, deadline=1e-6))
    report = rushed.advance(case.pose_at(16), DT)
    assert np.allclose(rushed.body.skin_now.numpy(), patient.body.skin_now.numpy(), atol=1e-6)
    assert report.late > 0
    assert report.newton_iterations <= LIVE.correction_iterations
    assert "deadline was missed" in report.advice
    assert usual.late == 0
