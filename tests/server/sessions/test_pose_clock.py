"""The times of a stream's poses: a stray one costs its pose alone, and a clock that restarted is followed."""

from __future__ import annotations

import pytest
from session_driver import Driver, pose

from tryon_protocol import ErrorMessage, SkeletonMessage
from tryon_server.sessions.commands import UsePose
from tryon_server.sessions.pose_clock import CLOCK_JUMP_MAX, RESTART_SECONDS

STEP = 0.05


def streaming() -> Driver:
    driver = Driver(motion=None)
    driver.dressed()
    driver.connect(1)
    driver.say(1, pose(10, t=50.0))
    return driver


def go_on(driver: Driver, seq: int, t: float, count: int) -> list[int]:
    """The numbers that were used of ``count`` poses of a clock that shows ``t`` [s] at the first."""
    before = len(driver.ordered(UsePose))
    for k in range(count):
        driver.wait(STEP)
        driver.say(1, pose(seq + k, t=t + k * STEP))
    return [command.seq for command in driver.ordered(UsePose)[before:]]


def test_a_time_far_ahead_is_refused_and_the_poses_after_it_are_used():
    driver = streaming()
    driver.wait(STEP)
    driver.say(1, pose(11, t=1e6))
    error = driver.last(1, ErrorMessage)
    assert (error.code, error.place) == ("invalid_pose", "$.t")
    assert "jumped ahead" in error.message
    assert "skeleton" in error.remedy
    assert go_on(driver, 12, 50.1, 3) == [12, 13, 14]


def test_a_link_that_stalled_for_long_loses_no_pose():
    driver = streaming()
    driver.wait(3.0 * CLOCK_JUMP_MAX)
    for k in range(1, 31):  # all at once
        driver.say(1, pose(10 + k, t=50.0 + 0.1 * CLOCK_JUMP_MAX * k))
    assert driver.errors(1) == []
    assert len(driver.ordered(UsePose)) == 31


@pytest.mark.parametrize(("seq", "t"), [(11, 0.0), (11, 1e6), (1, 0.0)])
def test_a_clock_that_restarted_is_followed_once_it_ran_steadily(seq, t):
    driver = streaming()
    count = round(RESTART_SECONDS / STEP) + 5
    used = go_on(driver, seq, t, count)
    assert used
    assert used == list(range(used[0], seq + count))
    assert used[0] - seq >= round(RESTART_SECONDS / STEP) - 1
    streams = [command.stream for command in driver.ordered(UsePose)]
    assert len(set(streams)) == 2
    assert len(set(streams[1:])) == 1


def test_times_that_stand_still_or_jump_about_are_never_followed():
    driver = streaming()
    for k in range(60):
        driver.wait(STEP)
        driver.say(1, pose(11 + k, t=1e6 if k % 2 else 3.0))
    for k in range(60, 120):
        driver.wait(STEP)
        driver.say(1, pose(11 + k, t=7.0))
    assert [command.seq for command in driver.ordered(UsePose)] == [10]


def test_a_stray_time_within_a_steady_stream_never_counts_as_a_restart():
    driver = streaming()
    for k in range(1, 61):
        driver.wait(STEP)
        driver.say(1, pose(10 + 2 * k, t=50.0 + k * STEP))
        driver.say(1, pose(11 + 2 * k, t=1e6 + k * STEP))
    assert len(driver.ordered(UsePose)) == 61
    assert all(command.t_capture < 100.0 for command in driver.ordered(UsePose))


def test_after_a_new_skeleton_numbers_and_times_may_begin_anew():
    driver = streaming()
    driver.say(1, SkeletonMessage(subject="wearer", convention="head-hands", joint_names=("viewer",)))
    driver.say(1, pose(1, t=0.0))
    driver.say(1, pose(2, t=STEP))
    driver.say(1, pose(2, t=2 * STEP))
    first, *others = driver.ordered(UsePose)
    assert [command.seq for command in others] == [1, 2]
    assert {command.stream for command in others} - {first.stream} == {command.stream for command in others}
    assert driver.last(1, ErrorMessage).place == "$.seq"
