"""What the harness says of rest: a run is shown to it that creeps, one that moves asleep, one that starts up awake."""

from dataclasses import replace

import pytest
from harness.judgement import broken, judged
from harness.play import play
from harness.scene import Asked
from scripted import DT, LAST, REPORT, SECONDS, STOPS, Scripted

QUIET = 1.0  # s
FALLS_ASLEEP, WAKES = 70, 100  # frames


def found(subject, quiet=None, wakes=False):
    """The limits that a run broke, and its figures."""
    record = play(subject, DT, SECONDS, tell=lambda _text: None)
    asked = Asked(STOPS, quiet=quiet, wakes=wakes)
    return {b.limit for b in broken(record, asked)}, judged(record, asked, {})


class Creeps(Scripted):
    """Slides at 2 mm/s: too slow a motion to tremble."""

    def positions(self, k):
        return self.x_start + [2e-3 * k * DT, 0, 0]


class Sleeps(Scripted):
    """Asleep for half a second, without a step; then a vertex sets off at `speed` m/s."""

    speed = 0.05

    def positions(self, k):
        x = self.x_start.copy()
        x[0, 1] += self.speed * DT * min(max(k - WAKES + 1, 0), 2)
        return x

    def report(self, k):
        asleep = FALLS_ASLEEP <= k < WAKES
        return replace(REPORT, asleep=asleep, steps=0 if asleep else 1)


class Dreams(Sleeps):
    """Asleep, and a millionth of a metre off in one frame."""

    def positions(self, k):
        return super().positions(k) + [1e-6 * (k == FALLS_ASLEEP + 9), 0, 0]


class Works(Sleeps):
    """Said to be asleep, and stepped."""

    def report(self, k):
        return replace(super().report(k), steps=1)


class Startles(Sleeps):
    speed = 0.2


def test_all_motion_is_asked_only_from_when_on_the_case_says():
    names, told = found(Creeps(), QUIET)
    assert names == {"all motion at rest [m/s]"}
    assert told["restless"] == pytest.approx(2e-3, rel=1e-3)
    names, told = found(Creeps())
    assert names == set()
    assert told["restless"] is None
    assert found(Scripted(), QUIET)[0] == set()


def test_sleep_is_measured_and_its_frames_are_one():
    names, told = found(Sleeps())
    assert names == set()
    assert told["asleep"] == pytest.approx((WAKES - FALLS_ASLEEP) * DT)
    assert told["waking"] == pytest.approx(0.05, rel=1e-3)
    # ipctk was asked about no frame of sleep but the first
    assert told["asked"] == LAST + 1 - (WAKES - FALLS_ASLEEP)


def test_who_was_never_asleep_did_not_wake_and_breaks_a_case_about_that():
    assert found(Scripted())[1]["waking"] is None
    names, told = found(Scripted(), wakes=True)
    assert names == {"never asleep, or never woken"}
    assert [b["limit"] for b in told["broken"]] == ["never asleep, or never woken"]
    assert found(Sleeps(), wakes=True)[0] == set()


@pytest.mark.parametrize("kind", [Dreams, Works])
def test_who_moves_or_works_asleep_is_caught(kind):
    assert "asleep, and yet it moved or worked" in found(kind())[0]


def test_who_starts_up_is_caught():
    assert "fastest vertex on waking [m/s]" in found(Startles())[0]
