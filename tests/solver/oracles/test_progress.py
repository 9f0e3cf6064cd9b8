"""When the correction's loop goes on, moves, asks for a search or for room, and ends: judged on every device."""

from dataclasses import dataclass, field

import numpy as np
import pytest
import warp as wp

from tryon_solver.contact import filtering
from tryon_solver.contact.filtering import Passes
from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.stepping.progress import Progress


@dataclass
class Script:
    """Plays the correction's loop with directions and moves of given lengths [m], the host in the loop.

    `leaving`, `crowded`: the iterations whose direction leaves the region, or after which there are too many pairs,
    until the host has helped. `more`: `extensions` (0), the length from which a direction is `unsettled` (2), and the
    sum of each direction's moves, as `adrift` (0).
    """

    progress: Progress
    pairs: ContactPairs
    events: list = field(default_factory=list)

    def play(self, budget, searches, lengths, moves, shortest=1e-6, leaving=(), crowded=(), imbalances=None, **more):
        self.lengths, self.moves, self.shortest, self.crowded = lengths, moves, shortest, crowded
        self.unsettled = more.get("unsettled", 2.0)
        self.imbalances = imbalances or [1.0] * len(lengths)
        self.least = []
        progress = self.progress
        device = progress.state.device
        self.second = wp.ones(1, dtype=wp.float32, device=device)
        self.together = wp.array([(more.get("adrift", 0.0), 0.0, 0.0)], dtype=wp.vec3, device=device)
        progress.begin(budget, more.get("extensions", 0), searches)
        self.done = 0
        while True:
            while int(progress.going_on.numpy()[0]):
                progress.unless_directed(self.find)
                progress.leaving.fill_(3 if self.done in leaving else 0)
                progress.if_free_to_move(self.move)
            outcome = progress.read()
            if outcome.wants_search:
                self.events.append("search")
                leaving = ()
                searches -= 1
                progress.resume(searches, outcome.starting)
            elif outcome.wants_room:
                self.events.append("room")
                self.crowded = ()
                progress.resume(searches, outcome.starting)
            else:
                return outcome

    def find(self):
        self.progress.length.fill_(self.lengths[self.done])
        imbalance = wp.array([self.imbalances[self.done]], dtype=wp.float32, device=self.progress.state.device)
        self.progress.judge_direction(imbalance, self.unsettled, self.second, self.together, 1)
        self.least.append(int(self.progress.least_yet.numpy()[0]))
        self.events.append("direction")

    def move(self):
        self.events.append("move")
        self.progress.moved.fill_(self.moves[self.done])
        self.progress.judge_move(self.shortest, self.second)
        self.progress.if_going_on(self.look)
        self.done += 1

    def look(self):
        self.events.append("look")
        self.pairs.counters.assign([9 if self.done in self.crowded else 2, 0])
        self.pairs.stop_when_full(self.progress.going_on, self.progress.wants_room)


@pytest.fixture
def script(device):
    progress = Progress.allocate(device)
    progress.state.fill_(77)
    progress.lengths.fill_(np.nan)
    return Script(progress, ContactPairs.allocate(8, device))


ONE = ["direction", "move", "look"]


def test_the_budget_is_spent(script):
    outcome = script.play(3, 0, [0.5, 0.5, 0.5], [0.5, 0.4, 0.3])
    assert script.events == [*ONE, *ONE, "direction", "move"]
    assert (outcome.iterations, outcome.moved) == (3, pytest.approx(0.3))


def test_it_ends_when_nothing_moves(script):
    outcome = script.play(9, 0, [1] * 9, [0.5, 1e-7])
    assert script.events == [*ONE, "direction", "move"]
    assert outcome.iterations == 2


def test_the_last_direction_is_dropped_where_it_overshoots(script):
    outcome = script.play(2, 0, [1, 1.01], [0.5, 9])
    assert script.events == [*ONE, "direction"]
    assert (outcome.iterations, outcome.moved) == (2, pytest.approx(0.5))
    assert script.play(2, 0, [1, 0.99], [0.5, 0.7]).moved == pytest.approx(0.7)


def test_a_budget_of_one_has_nothing_to_overshoot(script):
    script.play(1, 0, [1e6], [0.5])
    assert script.events == ["direction", "move"]


def test_no_budget_no_iteration(script):
    outcome = script.play(0, 5, [], [])
    assert (script.events, outcome.iterations, outcome.moved) == ([], 0, 0.0)


def test_it_asks_for_a_search_and_goes_on_with_the_same_direction(script):
    script.play(2, 1, [1, 1], [0.5, 0.5], leaving=(1,))
    assert script.events == [*ONE, "direction", "search", "move"]


def test_without_a_search_left_it_moves_as_far_as_it_can(script):
    script.play(2, 0, [1, 1], [0.5, 0.5], leaving=(0, 1))
    assert "search" not in script.events
    assert script.events.count("move") == 2


def test_a_budget_that_ends_far_from_balance_has_strayed(script):
    def play(imbalances, moves, budget):
        return script.play(budget, 0, [1] * budget, moves, imbalances=imbalances)

    assert play([9, 1, 2, 5], [0.5] * 4, 4).strayed
    assert script.least == [0, 1, 0, 0]
    assert not play([9, 1, 2, 3], [0.5] * 4, 4).strayed
    assert not play([9, 5, 2, 1], [0.5] * 4, 4).strayed
    assert script.least == [0, 1, 1, 1]
    assert not play([1, 9, 9], [0.5, 1e-7, 0.5], 3).strayed, "it came to rest before the budget was spent"
    assert not play([9], [0.5], 1).strayed
    assert not play([0.1, 9, 8, 7], [0.5] * 4, 4).strayed, "where it began does not count"


def test_a_budget_that_has_strayed_is_extended_and_its_last_direction_taken(script):
    def play(imbalances, more):
        n = len(imbalances)
        lengths = [1.0, 1.0, 9.0, *[0.1] * (n - 3)]
        return script.play(3, 0, lengths, [0.5] * n, imbalances=imbalances, extensions=more, unsettled=10.0)

    outcome = play([9, 1, 5, 4, 3, 2, 1, 1, 1], more=2)
    assert (outcome.iterations, outcome.strayed) == (6, False)
    assert script.events == [*ONE * 5, "direction", "move"]
    script.events.clear()
    outcome = play([9, 1, 5, 4, 3, 6, 1, 1, 1, 1, 1, 1], more=2)
    assert (outcome.iterations, outcome.strayed) == (9, False)
    outcome = play([9, 1, 5, 4, 3, 6, 1, 1, 6, 1, 1, 1], more=2)
    assert (outcome.iterations, outcome.strayed) == (9, True)
    outcome = play([9, 1, 3, 9, 9, 9], more=2)
    assert (outcome.iterations, outcome.strayed) == (3, False)


def test_a_budget_that_came_hardly_nearer_and_has_far_to_go_has_strayed(script):
    def play(imbalances, lengths):
        outcome = script.play(3, 0, lengths, [1.0] * 3, imbalances=imbalances, unsettled=0.4)
        return outcome.strayed

    assert play([9, 3, 1], [1.0, 1.0, 0.5])
    assert not play([9, 3, 1], [1.0, 1.0, 0.3]), "nothing moves far"
    assert not play([9, 3, 0.8], [1.0, 1.0, 0.5]), "ten times nearer"


@pytest.mark.parametrize(("adrift", "iterations"), [(0.009, 2), (0.011, 4)])
def test_a_budget_that_ends_with_the_cloth_adrift_is_extended(adrift, iterations, script):
    """By 0.01 m/s; one vertex, steps of a second."""
    outcome = script.play(2, 0, [0.1] * 4, [0.1] * 4, extensions=1, adrift=adrift)
    assert (outcome.iterations, outcome.strayed) == (iterations, False)


def test_it_asks_for_room_and_goes_on(script):
    outcome = script.play(3, 0, [0.5, 0.5, 0.5], [0.5, 0.4, 0.3], crowded=(0,))
    assert script.events == [*ONE, "room", *ONE, "direction", "move"]
    assert outcome.iterations == 3


@dataclass
class Beginning:
    """Plays the choice of where the correction starts; `events` as they come."""

    progress: Progress
    pairs: ContactPairs
    standing: float  # J
    tried: float  # J
    leaving: int = 0  # vertices that the way to the trial takes out of the region, until the host has searched
    crowded: bool = False  # are there more pairs at the trial than room, until the host has made some?
    in_vain: bool = False  # does the host find that searching along the way to the trial is in vain?
    events: list = field(default_factory=list)

    def play(self, searches):
        progress = self.progress
        progress.begin(3, 0, searches, starting=True)
        for _ in range(4):
            progress.if_starting(self.choose)
            progress.unless_directed(lambda: self.events.append("direction"))
            progress.leaving.fill_(7)  # the rest of the turn counts for a direction that there is not
            outcome = progress.read()
            if not (outcome.wants_search or outcome.wants_room):
                return outcome
            assert int(progress.going_on.numpy()[0]) == 0
            if outcome.wants_search:
                assert outcome.leaving == self.leaving
                self.leaving = 0
                searches -= 1
            else:
                self.crowded = False
            if self.in_vain:
                progress.start_here()
            else:
                progress.resume(searches, outcome.starting)
            self.events.append("host")
        return None

    def choose(self):
        self.events.append("standing")
        self.progress.standing.fill_(self.standing)
        self.progress.leaving.fill_(self.leaving)
        self.progress.if_free_to_try(self.attempt)

    def attempt(self):
        self.events.append("trial")
        self.progress.tried.fill_(self.tried)
        self.pairs.counters.fill_(self.pairs.capacity + 1 if self.crowded else 0)
        self.progress.if_tried_in_vain(self.pairs, lambda: self.events.append("back"))


@pytest.mark.parametrize(
    ("more", "searches", "events"),
    [
        ({}, 1, ["standing", "trial", "direction"]),
        ({"tried": 2.1}, 1, ["standing", "trial", "back", "direction"]),
        ({"leaving": 3}, 1, ["standing", "host", "standing", "trial", "direction"]),
        ({"leaving": 3}, 0, ["standing", "trial", "direction"]),
        ({"leaving": 3, "in_vain": True}, 1, ["standing", "host", "direction"]),
        ({"crowded": True}, 1, ["standing", "trial", "host", "standing", "trial", "direction"]),
        ({"crowded": True, "tried": 9.0}, 1, ["standing", "trial", "host", "standing", "trial", "back", "direction"]),
    ],
)
def test_it_starts_at_the_trial_unless_that_is_further_from_balance(device, more, searches, events):
    values = {"standing": 2.0, "tried": 1.0, **more}
    beginning = Beginning(Progress.allocate(device), ContactPairs.allocate(4, device), **values)
    outcome = beginning.play(searches)
    assert beginning.events == events
    assert not outcome.starting


@wp.kernel
def hit_kernel(until: int, passes: wp.array(dtype=wp.int32), seen_out: wp.array(dtype=wp.int32)):
    number = passes[0]
    if passes[1] == 0:
        return
    wp.atomic_add(seen_out, number, 1)
    if number < until:
        wp.atomic_add(passes, 2, 1)


@pytest.mark.parametrize(("until", "taken", "launched"), [(0, 0, 1), (3, 3, 4), (6, 6, 6), (99, 6, 6)])
@pytest.mark.parametrize("turns", [1, 2, 4, 9])
def test_passes_end_with_the_first_that_finds_nothing(device, until, taken, launched, turns, monkeypatch):
    monkeypatch.setattr(filtering, "turns_at_once", lambda _array: turns)
    passes = Passes.allocate(device)
    passes.state.fill_(55)
    seen = wp.zeros(8, dtype=wp.int32, device=device)
    passes.repeat(
        lambda: wp.launch(hit_kernel, 4, [until], [passes.state, seen], device=device), at_most=6
    )
    assert passes.taken() == taken
    assert seen.numpy().tolist() == [4] * launched + [0] * (8 - launched)
