"""Runs that would pass by what is told of them, or between the frames that are asked about: each is caught."""

from dataclasses import replace

import numpy as np
import pytest
from harness.judgement import broken, judged
from harness.play import play
from harness.scene import Asked
from scipy.spatial import cKDTree
from scripted import DT, REPORT, SECONDS, STOPS, Scripted
from small_scenes import icosphere

OFFSETS = (1.5e-3, 1e-3)  # m


def found(subject, every=1, **more):
    """The limits that a run broke."""
    record = play(subject, DT, SECONDS, every, tell=lambda _text: None)
    assert not record.failure
    return {b.limit for b in broken(record, Asked(STOPS, **more))}


class Falls(Scripted):
    """At 0.3 m/s until frame 30, and then no more: said to be what a kind below says."""

    held = range(30, 80)

    def positions(self, k):
        return self.x_start + [0, 0.4 - 5e-3 * (min(k, 30) + max(0, k - 80)), 0]


class SleepsInTheAir(Falls):
    def report(self, k):
        return replace(REPORT, asleep=k in self.held, steps=int(k not in self.held))


class StandsInTheAir(Falls):
    """Awake, and its velocities are those of rest."""


class IsHeldMoving(Scripted):
    """Shows the same for 0.6 s, while it is said to move."""

    def energies(self):
        kinetic, stored, fall = super().energies()
        return kinetic + 1e-7 * (20 <= self.k < 60), stored, fall


class Nods(Scripted):
    """Asleep every other frame, so that each of these is the first of a sleep, and works all the while."""

    def report(self, k):
        return replace(REPORT, asleep=k % 2 == 1)


class HardlySteps(Scripted):
    """Of 30 steps 29 are void: never for half a second together."""

    def report(self, k):
        return REPORT if k % 29 == 0 else replace(REPORT, retries=1, advice="a step was void")


class IsLateOnTheWay(Scripted):
    """The surface is 12 mm off for two thirds of a second, long before the body stops."""

    def lag(self):
        return 0.012 if 5 <= self.k < 45 else 0.0

    def skin(self, _t):
        return self.ball + [self.lag(), 0, 0]

    def advance(self, t):
        return replace(super().advance(t), body_lag=self.lag())


class SleepsOnACrossing(Scripted):
    """Awake in the ball in frame 41, asleep there to frame 59, awake above it again from frame 60 on."""

    def positions(self, k):
        return self.x_start - [0, 0.05 * (41 <= k < 60), 0]

    def report(self, k):
        return replace(REPORT, asleep=42 <= k < 60, steps=int(not 42 <= k < 60))


class TellsLessStretch(Scripted):
    def told_stretch(self):
        return super().told_stretch() - 2e-3


class NearTheBall(Scripted):
    """20 mm above a ball, of which the gap is told."""

    wrong = 0.0
    told_offset = OFFSETS[0]

    def __init__(self):
        super().__init__()
        self.offsets = OFFSETS
        self.apart = float(cKDTree(self.ball).query(self.x_start)[0].min())

    def report(self, _k):
        gap = self.apart - self.told_offset + self.wrong
        return replace(REPORT, pairs=1, min_gap=gap, gap_offset=self.told_offset)


class TellsWiderGap(NearTheBall):
    wrong = 1e-4


class TellsNarrowerGap(NearTheBall):
    wrong = -1e-4


class TellsItOfCloth(NearTheBall):
    """Of cloth on cloth, which is nowhere near: a vertex and the side across are 18 mm apart."""

    told_offset = OFFSETS[1]
    wrong = -5e-3


def test_the_ball_is_nearest_at_a_vertex():
    ball, _ = icosphere(0.08, 2)
    assert NearTheBall().apart == pytest.approx(0.1 - ball[:, 1].max(), abs=1e-12)


CHEATS = {
    SleepsInTheAir: {"speed before sleep [m/s]"},
    StandsInTheAir: {"awake, moving and yet left as it was [s]"},
    IsHeldMoving: {"awake, moving and yet left as it was [s]"},
    Nods: {"speed before sleep [m/s]"},
    HardlySteps: {"share of a second's frames with void steps"},
    IsLateOnTheWay: {"time behind the skin [s]"},
    TellsLessStretch: {"reported stretch off by"},
    TellsWiderGap: {"reported gap off by [m]"},
    TellsNarrowerGap: {"reported gap off by [m]"},
    TellsItOfCloth: {"reported gap off by [m]"},
}


@pytest.mark.parametrize("kind", CHEATS, ids=lambda kind: kind.__name__)
def test_a_cheat_is_caught(kind):
    assert CHEATS[kind] <= found(kind(), rests=False)


@pytest.mark.parametrize("kind", [Scripted, NearTheBall], ids=lambda kind: kind.__name__)
def test_who_does_not_cheat_is_not(kind):
    assert found(kind(), rests=False) == set()


def test_the_first_frame_of_a_sleep_is_asked_about_whatever_its_number():
    assert found(SleepsOnACrossing(), every=60, rests=False) >= {"cloth through body", "a sub-step that collides"}


def test_a_body_that_squeezes_cloth_may_be_late_on_the_way():
    assert found(IsLateOnTheWay(), rests=False, pinches=True) == set()


def test_what_the_case_is_about_is_asked_of_the_last_frame():
    assert found(Scripted(), lost=lambda _cloth: 0.0) == set()
    assert found(Scripted(), lost=lambda cloth: 10.0 * (cloth[:, 1].max() > 0)) == {"lost of what it is about"}


def test_the_worst_second_of_trembling_stands_beside_the_whole():
    class TremblesForASecond(Scripted):
        def positions(self, k):
            return self.x_start + [0, 1e-5 * (k % 2) * (60 <= k < 75), 0]

    record = play(TremblesForASecond(), DT, SECONDS, tell=lambda _text: None)
    told = judged(record, Asked(STOPS), {})
    assert told["trembling_most"] >= told["trembling"] > 0
    assert np.isfinite(told["trembling_most"])
