"""The harness is shown runs that are bad in one way each: it must name that way, and nothing else.

The runs are scripted: a square over a ball, its positions, sub-steps, energies and reports given frame by frame. The
good run, from which each bad one differs, keeps every limit.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from contact_scenes import square_on_sphere
from harness.energy import EnergyMeter
from harness.judgement import broken, growth, judged
from harness.kit import Pins, alone, led, square, strip
from harness.obstacles import Obstacles, standing
from harness.one import run_one
from harness.oracle import SubSteps, listening, on_the_way
from harness.play import play
from harness.recording import Recording
from harness.scene import Ask, Asked, HardScene, Run
from harness.subject import Simulated, poison
from harness.table import said_of
from scenes import SCENES
from scipy.spatial.transform import Rotation
from scripted import DT, LAST, REPORT, SECONDS, STOPS, Scripted
from small_scenes import STILL, fabric, icosphere, layers, rigid_body, slab

from tryon_solver.geometry.garment import GarmentError
from tryon_solver.scene import WORN, AirDrag, Gravity, Scene
from tryon_solver.simulation import build
from tryon_solver.stepping import correct

STOOD_DEAD = "awake, moving and yet left as it was [s]"  # as what is scripted does after each of its moves
GROWN_AT_REST = "energy without work at rest (share)"


@cache
def played(kind: type[Scripted]) -> Recording:
    return play(kind(), DT, SECONDS, tell=lambda _text: None)


def whole_run(kind: type[Scripted]) -> Recording:
    """Of the kind, to its end: a copy of its own for each test that asks, of what is played once."""
    return deepcopy(played(kind))


def names(kind: type[Scripted], rests: bool = True) -> set[str]:
    """The limits that a run broke."""
    record = whole_run(kind)
    assert record.frames == LAST or record.failure
    return {b.limit for b in broken(record, Asked(STOPS, rests))}


def test_a_good_run_keeps_every_limit():
    assert names(Scripted) == set()


class CrossesBall(Scripted):
    def positions(self, k):
        return self.x_start - [0, 0.05 if k == 40 else 0, 0]


class CrossesItself(Scripted):
    def positions(self, k):
        x = self.x_start.copy()
        if k == LAST:
            right = x[:, 0] > 0.04
            x[right, 0] = 0.08 - x[right, 0]
            x[right, 1] += 0.01 * np.sign(x[right, 2] - 0.01)
        return x


class PassesThrough(Scripted):
    """Above the ball in one frame and below it in the next: every frame is clean, the way is not."""

    def positions(self, k):
        return self.x_start - [0, 0.2 if k >= 50 else 0, 0]


class PassesThroughOnTheWay(Scripted):
    """One accepted sub-step leads into the ball and the next out of it again."""

    def moves(self):
        here = self.positions(self.k)
        if self.k != 10:
            return super().moves()
        ways = ((here, here - [0, 0.05, 0]), (here - [0, 0.05, 0], here))
        return [tuple(np.vstack([x, self.ball]).astype(np.float32) for x in way) for way in ways]


class LeapsAtFirst(Scripted):
    """The first sub-step of a frame begins a millimetre from where the frame before was."""

    def moves(self):
        (before, after), up = super().moves()[0], np.float32([0, 1e-3 * (self.k == 10), 0])
        return [(before + up, before), (before, after)]


class LeapsAtLast(Scripted):
    """What is published is a millimetre from where the last sub-step ended."""

    def positions(self, k):
        return self.x_start + [0, 1e-3 * (k >= 10), 0]

    def moves(self):
        (before, after), up = super().moves()[0], np.float32([0, 1e-3 * (self.k == 10), 0])
        return [(before, after - 0.5 * up)]


class LeapsBetween(Scripted):
    """One sub-step ends where the next one does not begin."""

    def moves(self):
        (before, after), up = super().moves()[0], np.float32([0, 1e-3 * (self.k == 10), 0])
        return [(before, after), (after + up, after)]


class Vanishes(Scripted):
    def positions(self, k):
        x = self.x_start.copy()
        if k == 30:
            x[7, 1] = np.nan
        return x


class Grows(Scripted):
    def energies(self):
        kinetic, stored, fall = super().energies()
        return kinetic + 2e-4 * (self.k == 80), stored, fall


class GrowsAtRest(Scripted):
    """By next to nothing of the fall, but more than half of all that is at play after it."""

    def energies(self):
        kinetic, stored, fall = super().energies()
        return kinetic, stored + 5e-7 * (self.k >= 80), fall


class FallsOff(Scripted):
    """In contact for a while, and no more."""

    def report(self, k):
        return replace(REPORT, pairs=12 if k < 60 else 0)


class Trembles(Scripted):
    """Every other frame 0.02 mm up: 2.4 mm/s, at 30 Hz."""

    def positions(self, k):
        return self.x_start + [0, 2e-5 * (k % 2), 0]


class Stretches(Scripted):
    """One triangle of 128 by a little more than 12 %."""

    def positions(self, k):
        x = self.x_start.copy()
        if k == 20:
            x[0, [0, 2]] += [-0.0025, 0.0025]
        return x


class Freezes(Scripted):
    def report(self, k):
        return replace(REPORT, retries=1, advice="1 steps were void") if 20 <= k < 60 else REPORT


class KeepsQuiet(Scripted):
    def report(self, k):
        return replace(REPORT, retries=1) if k == 20 else REPORT


class StaysBehind(Scripted):
    """The surface is 12 mm off to the end, and says so."""

    def skin(self, _t):
        return self.ball + [0.012, 0, 0]

    def report(self, _k):
        return replace(REPORT, body_lag=0.012)


class TellsTales(Scripted):
    def report(self, k):
        return replace(REPORT, body_lag=0.001 * (k == 3))


BAD = {
    CrossesBall: {"cloth through body", "a sub-step that collides"},
    CrossesItself: {"cloth through cloth", "a sub-step that collides", "stretch, 99.9 %", "stretch, max"},
    PassesThrough: {"a sub-step that collides"},
    PassesThroughOnTheWay: {"a sub-step that collides"},
    LeapsAtFirst: {"a leap between sub-steps"},
    LeapsAtLast: {"a leap between sub-steps"},
    LeapsBetween: {"a leap between sub-steps"},
    Vanishes: {"not a number", "a sub-step that collides"},
    Grows: {"energy without work (share of what is at play)", GROWN_AT_REST},
    GrowsAtRest: {GROWN_AT_REST},
    FallsOff: {"touches nothing at the end"},
    Trembles: {"trembling [m/s]"},
    Stretches: {"stretch, 99.9 %"},
    Freezes: {"time in the last safe state [s]", "share of a second's frames with void steps"},
    KeepsQuiet: {"void steps that the advice keeps quiet about"},
    StaysBehind: {"surface behind the skin after the stop [m]", "time behind the skin [s]"},
    TellsTales: {"reported lag off by [m]"},
}


@pytest.mark.parametrize("kind", BAD, ids=lambda kind: kind.__name__)
def test_a_bad_run_is_caught_for_what_it_is(kind):
    found = names(kind)
    # crossing itself in one frame also stretches and shakes; what else it is called does not matter
    assert BAD[kind] <= found
    assert found <= BAD[kind] | {"trembling [m/s]", STOOD_DEAD}


def test_a_step_may_fall_back_on_what_it_had_but_only_on_that():
    rng = np.random.default_rng(5)
    a, b, c = (rng.normal(size=(40, 3)).astype(np.float32) for _ in range(3))
    turn = Rotation.from_rotvec([0.1, -0.2, 0.3]).as_matrix()
    turned = (a.astype(np.float64) @ turn.T + [0.2, 0.1, 0]).astype(np.float32)
    bent = turned + 1e-4 * np.eye(40, 3, dtype=np.float32)

    def lead(moves, end, turned=()):
        heard = SubSteps(by_launches=True)
        heard.moves, heard.turned = list(moves), [(0, place) for place in turned]
        return heard.lead(a, end)

    assert lead([(a, b), (a, c)], c)  # the way to b was given up
    assert lead([(a, b), (a, c)], a)
    assert lead([], a)
    assert not lead([], b)
    assert not lead([(b, c)], c)
    assert not lead([(a, b)], c)
    assert on_the_way([(a, b), (b, turned), (a, c)], c) == [2]
    assert on_the_way([(a, b), (b, c), (b, a)], c) == [0, 1]
    assert lead([(turned, c)], c, [turned])  # with the body's root
    assert not lead([(bent, c)], c, [bent])


def test_what_may_part_has_not_fallen_off():
    record = whole_run(FallsOff)
    assert broken(record, Asked(STOPS, parts=True)) == []


def test_a_run_that_ends_too_soon_to_be_judged_is_not_called_still():
    record = play(Scripted(), DT, 1.2, tell=lambda _text: None)
    assert {b.limit for b in broken(record, Asked(STOPS))} == {"too little time after the stop to judge the rest"}
    assert broken(record, Asked(STOPS, rests=False)) == []
    assert broken(record, Asked(STOPS, quiet=1.0)) == []  # asked another way
    whole = whole_run(Scripted)
    assert broken(whole, Asked(STOPS, quiet=1.0)) == []
    too_late = broken(whole, Asked(STOPS, quiet=SECONDS))  # trembling is asked, but not all motion
    assert {b.limit for b in too_late} == {"too little time after the stop to judge the rest"}


def test_how_far_and_how_long_the_surface_is_from_what_a_tracker_told_is_told():
    """0.3 m aside in the frames 5 to 16, and a hand's breadth before."""
    subject, asked = Scripted(), []

    def tracked():
        asked.append(True)
        return subject.surface() + [0.3 if 5 <= len(asked) <= 16 else 0.08, 0.0, 0.0]

    told = judged(play(subject, DT, SECONDS, tracked=tracked, tell=lambda _text: None), Asked(STOPS), {})
    assert told["off_tracker"] == pytest.approx(0.3)
    assert told["behind_tracker"] == pytest.approx(12 * DT)
    assert told["broken"] == []
    assert any("at most 0.30 m, over 0.1 m for 0.20 s" in line for line in said_of(told))
    untracked = judged(whole_run(Scripted), Asked(STOPS), {})
    assert untracked["off_tracker"] is None


def test_a_frame_is_named():
    record = whole_run(CrossesBall)
    crossing = next(b for b in broken(record, Asked(STOPS)) if b.limit == "cloth through body")
    assert (crossing.first, crossing.worst, crossing.frames) == (40, 40, 1)


def test_frames_that_ipctk_is_not_asked_about_are_counted_as_such():
    """Every second frame and the last: a crossing between them is not seen, and the figures say how many were asked."""
    record = play(CrossesBall(), DT, SECONDS, every=7, tell=lambda _text: None)
    told = judged(record, Asked(STOPS), {})
    assert {b["limit"] for b in told["broken"]} == {STOOD_DEAD}
    assert told["asked"] == 1 + LAST // 7 + (LAST % 7 != 0)


def test_a_run_that_ends_in_an_error_fails_and_is_not_called_still():
    class Raises(Scripted):
        def report(self, k):
            if k == 100:
                raise RuntimeError("out of room")
            return REPORT

    record = play(Raises(), DT, SECONDS, tell=lambda _text: None)
    told = judged(record, Asked(STOPS), {})
    assert told["failure"] == "frame 100: RuntimeError: out of room"
    assert told["trembling"] is None


def test_what_is_only_stated_is_listed_with_its_reason():
    record = whole_run(Trembles)
    told = judged(record, Asked(STOPS), {"trembling [m/s]": "because"})
    assert told["broken"] == []
    assert told["stated"][0]["limit"] == "trembling [m/s]"
    assert told["stated"][0]["reason"] == "because"


def refusing(message):
    def set_up(_ask):
        raise GarmentError(message)

    return set_up


def test_a_refusal_must_say_what_it_should():
    ask = Ask(81, seconds=0.1)
    right = HardScene("a", "b", refusing("triangle 7 is too thin"), refused=r"triangle \d+ is too thin")
    assert run_one(right, ask)["failure"] == ""
    wrong = HardScene("a", "b", refusing("something is wrong"), refused=r"triangle \d+ is too thin")
    assert "something is wrong" in run_one(wrong, ask)["failure"]
    unasked = HardScene("a", "b", refusing("triangle 7 is too thin"))
    assert "too thin" in run_one(unasked, ask)["failure"]


def test_poison_that_is_read_before_it_is_written_is_seen():
    """The control of the poisoning: a step that adds to what it should have written ends in NaN."""
    garment, x = square(81, 0.2)
    sim = alone(Ask(81), garment, x)
    poison(Run(sim))
    assert np.isnan(sim.work.gradient.numpy()).all()
    assert np.isnan(sim.state.x_hat.numpy()).all()
    sim.advance(None, DT)
    assert np.isfinite(sim.cloth_positions()).all()
    assert np.isfinite(sim.state.x_hat.numpy()).all()


def test_energy_of_free_fall_is_kept_and_that_of_a_thrown_sheet_known():
    """Implicit Euler falls g dt^2/2 too far a step: E drops by M g^2 dt^2/2 each, no more and no less."""
    garment, x = square(81, 0.2)
    sim = build(Scene(garment, x, None, fabric(), (Gravity(),)))
    meter, found = EnergyMeter(sim), []
    for k in range(10):
        found.append(sum(meter.energies()))
        sim.advance(None, (k + 1) * DT)
    mass = sim.mass.sum()
    np.testing.assert_allclose(np.diff(found), -0.5 * mass * (9.81 * DT) ** 2, rtol=1e-3)
    assert meter.kinetic(np.tile([3.0, 0, 0], (81, 1))) == pytest.approx(4.5 * mass)


def test_elastic_energy_of_known_stretch():
    """Warp stretched by 1.2 under a limit of 1.1: A/2 (k_warp 0.2^2 + k_limit 0.1^2)."""
    garment, x = square(81, 0.2)
    cloth = fabric(strain_limit=1.1, k_bend=0.0)
    sim = build(Scene(garment, x * [1.2, 1, 1], None, cloth, WORN[3:]))
    expected = 0.5 * 0.04 * (cloth.k_warp * 0.2**2 + 20000.0 * 0.1**2)
    assert EnergyMeter(sim).elastic(x * [1.2, 1, 1]) == pytest.approx(expected, rel=1e-6)


def test_energy_of_contacts_that_stick_falls_by_the_force_of_friction():
    """dE/dy = mu N f1(y), f1 = (2 - y/e) y/e, for all contacts of a sheet on a ball, given by y each."""
    sim = build(square_on_sphere().scene, None, "cpu", STILL)
    for k in range(20):
        sim.advance(STILL, (k + 1) * DT)
    meter, (term,) = EnergyMeter(sim), sim.stages.contact
    meter.contact()
    ids, pressed = sim.pairs.ids.numpy()[: sim.pairs.size], -sim.pairs.slope.numpy()[: sim.pairs.size].astype(float)
    fabric, e, h = sim.scene.fabric, meter.friction.presliding, 1e-6

    def given_by(y):
        term.restore(ids, np.tile(np.float32([y, 0, 0]), (len(ids), 1)))
        return meter.given(ids, pressed)

    onto_ball = (ids >= sim.cloth_count).any(1)
    assert onto_ball.sum() > 50
    coulomb = (np.where(onto_ball, fabric.mu_body, fabric.mu_self) * pressed).sum()
    assert coulomb > 1e-3
    for y in (0.1 * e, 0.5 * e, 0.9 * e):
        found = (given_by(y + h) - given_by(y - h)) / (2 * h)
        assert found == pytest.approx(coulomb * (2 - y / e) * y / e, rel=1e-3)
    assert given_by(0.0) == 0.0


def test_work_of_led_pins_is_what_the_cloth_gains():
    """A strip lifted by its upper end against drag: E - W never rises, and W is at least the lift."""
    garment, x, columns, _ = strip(60, 0.1, 0.3)
    held = np.flatnonzero(np.arange(len(x)) // columns == len(x) // columns - 1).astype(np.int32)
    sim = build(Scene(garment, x, None, fabric(), (Gravity(), AirDrag(1.0), Pins(held))))
    drive = led(sim, lambda t: x[held] + [0, 0.2 * t, 0])
    meter, free, done = EnergyMeter(sim), [], 0.0
    for k in range(60):
        free.append(sum(meter.energies()) - done)
        drive((k + 1) * DT)
        sim.advance(None, (k + 1) * DT)
        meter.energies()
        done += meter.work()
    assert np.diff(free).max() < 1e-3 * done
    assert done > 0.9 * sim.mass.sum() * 9.81 * 0.2 * 0.8


def test_work_of_a_moving_plate_is_what_the_cloth_gains():
    """A plate lifts a sheet by 5 cm in a second: W is the weight times that, and the drag's."""
    garment, x = square(49, 0.15)
    plate = slab(0.2, 0.2, 0.02, 0.05)
    lift = Obstacles((plate,), (lambda t: (np.zeros(3), np.array([0, 0.05 * min(t, 1.0), 0])),))
    sim = build(Scene(garment, x + [0, 0.0032, 0], lift), None, "cpu", lift.start())
    meter, done = EnergyMeter(sim), 0.0
    for k in range(60):
        sim.advance(lift.at((k + 1) * DT), (k + 1) * DT)
        meter.energies()
        done += meter.work()
    against_air = AirDrag().coefficient * sim.area.sum() * 0.05**2
    assert done == pytest.approx(sim.mass.sum() * 9.81 * 0.05 + against_air, rel=0.02)


def test_obstacles_are_where_their_paths_lead():
    """On the host and on the device alike, between two stances too; the world, joint 0, stands still."""
    first, second = slab(0.1, 0.1, 0.02, 0.05), slab(0.2, 0.1, 0.02, 0.05)
    turning = Obstacles(
        (first, (second[0] + [0.3, 0, 0], second[1])),
        (standing, lambda t: (np.array([0, t, 0]), np.array([0, 0, 0.2 * t]))),
    )
    count = len(first[0])
    half = turning.on_device("cpu").between(turning.at(0.0), turning.at(1.0), 0.5)
    found = turning.surface(half)
    np.testing.assert_allclose(found[:count], first[0], atol=1e-12)
    middle = (second[0] + [0.3, 0, 0]).mean(0)
    c, s = np.cos(0.5), np.sin(0.5)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    expected = (second[0] + [0.3, 0, 0] - middle) @ turn.T + middle + [0, 0, 0.1]
    np.testing.assert_allclose(found[count:], expected, atol=1e-9)
    np.testing.assert_array_equal(turning.transforms(half)[0], np.eye(4))
    garment, x = square(9, 0.05)
    sim = build(Scene(garment, x + [0, 1, 0], turning), None, "cpu", turning.start())
    sim.advance(turning.at(0.5), 0.5)
    while sim.debt:
        sim.advance(turning.at(0.5), 0.5)
    np.testing.assert_allclose(sim.body_positions(), turning.surface(turning.at(0.5)), atol=1e-6)


def test_every_accepted_move_is_heard():
    """One per sub-step of the body and one per move of the correction, from where the last one ended."""
    garment, x = layers(1, 5, 5, 0.1, 0.0)
    ball = rigid_body(*icosphere(0.05, 1))
    with listening() as heard:
        sim = build(Scene(garment, x + [0, 0.06, 0], ball), None, "cpu", STILL)
        subject = Simulated(Run(sim, lambda _t: STILL), heard)
        report = subject.advance(DT)
        moves = subject.moves()
        assert len(moves) >= report.substeps + 1
        assert len(heard.turned) == 0  # taken
        assert subject.moves() == []
        np.testing.assert_array_equal(moves[-1][1], sim.state.x.numpy())
    sim.advance(STILL, 2 * DT)
    assert heard.take() == []


def test_what_a_correction_that_led_astray_goes_instead_is_heard(monkeypatch):
    """A little of a direction, from where the step began."""
    garment, x = layers(1, 5, 5, 0.1, 0.0)
    ball = rigid_body(*icosphere(0.05, 1))
    with listening() as heard:
        sim = build(Scene(garment, x + [0, 0.06, 0], ball), None, "cpu", STILL)
        subject = Simulated(Run(sim, lambda _t: STILL), heard)
        start = sim.state.x.numpy().copy()
        for name, told in (("ended_astray", True), ("led_astray", True), ("goes_as_one", False)):
            monkeypatch.setattr(correct, name, lambda *_, told=told: told)
        gone = []
        monkeypatch.setattr(correct, "leads_well", lambda sim, _began, find: gone.append(goes(sim, find)) or True)
        subject.advance(DT)
        assert gone[0] > 0
        assert subject.leads(start, sim.state.x.numpy())


def goes(sim, find):
    """How far a vertex goes along what is found, at most [m]."""
    correct.gone_to(sim, find)
    return float(np.abs(sim.state.x.numpy() - sim.state.x_feasible.numpy()).max())


def test_names_are_words_and_each_is_there_once():
    listed = [scene.name for scene in SCENES]
    assert len(set(listed)) == len(listed)
    for scene in SCENES:
        assert scene.stresses
        assert " " not in scene.name
        assert not any(name != scene.name and name.startswith(scene.name + "_") for name in listed), scene.name


def test_energy_that_grows_is_told_of_every_frame_in_which_it_is_over_the_least_before():
    none = [0.0] * 5
    record = Recording(DT, 1.1, 1.0, kinetic=[1.0, 0.0, 0.3, 0.3, 0.1], stored=none, fall=none, work=none)
    np.testing.assert_allclose(growth(record), [0.0, 0.0, 0.3, 0.3, 0.1])
    np.testing.assert_allclose(growth(record, 2), np.array([0.0, 0.0, 0.0]))
    record.work = [0.0, 0.0, 0.3, 0.3, 0.3]
    np.testing.assert_allclose(growth(record), 0.0, atol=1e-12)
