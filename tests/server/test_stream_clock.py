"""The time that is told of a frame and the pose that it shows: of one parameter, whatever solver and network do.

A solver that takes as long as it is told, on a clock of the test's, follows a wearer of whom every pose is known.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tryon_server.runtime.sources import APPROACH_SPEED_MAX, LONGEST_MOVE, NEARBY, Move
from tryon_server.runtime.stream_source import (
    CATCH_UP,
    LARGEST_LAG,
    LIMBS_TURN,
    LONGEST_STEP,
    RUN_SPEED_MAX,
    STALL_SECONDS,
    StreamSource,
)
from tryon_solver.body.pose import Pose

LOOK = 1 / 72  # s between looks at a stream that has nothing new
UNKNOWN = np.inf  # s, latency of a pose that never arrives


def posed(x: float, turn: float = 0.0) -> Pose:
    """A body of two joints at x m whose second one is turned by `turn` rad."""
    rotations = np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, np.sin(turn / 2), np.cos(turn / 2)]])
    return Pose(np.array([x, 0.0, 0.0]), rotations)


def turn_of(pose: Pose) -> float:
    return 2.0 * float(np.arctan2(pose.rotations[1, 2], pose.rotations[1, 3]))


def walks(t: float) -> Pose:
    return posed(0.1 * t, 0.2 * abs(t % 10.0 - 5.0))


def sways(t: float) -> Pose:
    return posed(0.3 * np.sin(1.7 * t), 1.2 * np.sin(4.0 * t))


def stops_and_goes(t: float) -> Pose:
    return posed(0.4 * (np.floor(t / 3.0) + min(1.0, t % 3.0)), 0.0)


@dataclass
class Shown:
    """A move, when its frame was there [s], and what of the stream had been handed over by then."""

    move: Move
    at: float
    taken: int


@dataclass
class Session:
    """What came out of a session: frames, and the poses that were handed over: stream, number, time, pose."""

    shown: list[Shown]
    taken: list[tuple[int, int, float, Pose]]


def play(
    wearer: Callable[[float], Pose],
    cost: Callable[[float], float],
    seconds: float = 20.0,
    rate: float = 72.0,
    latency: Callable[[float], float] = lambda _: 0.03,
    sender: Callable[[float], tuple[int, float]] = lambda _: (1, 100.0),
    start: Pose | None = None,
) -> Session:
    """A session as the worker runs it: of the poses that came during a step only the newest is handed over.

    `cost(now)`: s of wall time of a step that begins now; `latency(t)` of the pose captured at t; `sender(t)`: whose
    pose that is, and by how much that one's clock is ahead.
    """
    stream = StreamSource(start or wearer(0.0))
    arriving = sorted(
        (t + latency(t), k + 1, t) for k, t in enumerate(np.arange(0.0, seconds, 1.0 / rate)) if latency(t) < UNKNOWN
    )
    session = Session([], [])
    now, last_look, spent = 0.0, -LOOK, 0.0
    newest = 0
    while now < seconds:
        newly = [entry for entry in arriving if entry[0] <= now]
        arriving = arriving[len(newly) :]
        if newly:
            number, t = max(newly)[1:]
            if number > newest:  # the server takes no pose that was captured before one it has
                newest = number
                who, ahead = sender(t)
                session.taken.append((who, number, t + ahead, wearer(t)))
                stream.take(*session.taken[-1])
        elapsed, last_look = now - last_look, now
        move = stream.next(elapsed, spent)
        if move is None:
            now += LOOK
            continue
        spent = cost(now) * np.ceil(move.dt / max(1 / 30, move.longest_step) - 1e-9)
        now += spent
        session.shown.append(Shown(move, now, len(session.taken)))
    return session


def check_clock(session: Session) -> None:
    """Of each sender, time never goes back, and is never ahead of the pose: at the time that a frame tells, the body is
    on the straight way from a pose that had come to the one that the frame names; but for ways that no poses say, to a
    sender's first one and after a leap."""
    places = {taken[1]: place for place, taken in enumerate(session.taken)}
    last: tuple[int, float] | None = None
    before = session.shown[0]
    unsaid = 0
    for frame in session.shown:
        move = frame.move
        if move.pose_seq == 0:
            continue
        place = places[move.pose_seq]
        stream, _, t, pose = session.taken[place]
        assert place < frame.taken
        assert move.t <= t, "the pose that the frame names is behind it"
        if last is not None and last[0] == stream:
            assert move.t >= last[1], "time goes back"
        if last is None or last[0] != stream or leaps(frame, before):
            unsaid = move.pose_seq
        before = frame
        last = (stream, move.t)
        earlier = (taken[2:] for taken in session.taken[place::-1] if taken[0] == stream and taken[2] <= move.t)
        if move.pose_seq != unsaid:
            assert any(off_the_way(one, (t, pose), move) < 1e-6 for one in earlier)


def leaps(frame: Shown, before: Shown) -> bool:
    """Is the wearer somewhere else, faster than anybody runs there?"""
    way = frame.move.pose.root - before.move.pose.root
    return float(np.linalg.norm(way)) > RUN_SPEED_MAX * frame.move.dt


def off_the_way(a: tuple[float, Pose], b: tuple[float, Pose], move: Move) -> float:
    """How far [m, rad] a move's pose is off the one between a and b at its time."""
    share = (move.t - a[0]) / (b[0] - a[0]) if b[0] > a[0] else 1.0
    there = Pose.interpolate(a[1], b[1], share)
    return max(abs(there.root[0] - move.pose.root[0]), abs(turn_of(there) - turn_of(move.pose)))


def ages(session: Session, after: float) -> np.ndarray:
    """Ages [s] of the frames that were there later than `after`; the sender's clock is 100 s ahead."""
    return np.array([frame.at + 100.0 - frame.move.t for frame in session.shown if frame.at > after])


@pytest.mark.parametrize("rate", [5.0, 30.0, 72.0])
@pytest.mark.parametrize("cost", [0.03, 0.07, 0.2, 0.5])
@pytest.mark.parametrize("wearer", [walks, sways, stops_and_goes])
def test_a_frame_shows_the_pose_of_the_time_that_it_tells(wearer, cost, rate):
    """Solvers as quick as the wall and ten times slower: no time is told that the body has not reached."""
    session = play(wearer, lambda _: cost, rate=rate)
    assert len(session.shown) > 20
    check_clock(session)
    assert all(frame.move.dt <= LONGEST_STEP for frame in session.shown)


@pytest.mark.parametrize("cost", [0.07, 0.1, 0.2])
def test_a_steady_walk_is_drawn_where_the_wearer_was_at_that_time(cost):
    """By the time alone, as a client does that draws the wearer from its own poses."""
    session = play(lambda t: posed(0.1 * t), lambda _: cost)
    for frame in session.shown:
        if frame.move.pose_seq and frame.move.t > 100.0:
            assert frame.move.pose.root[0] == pytest.approx(0.1 * (frame.move.t - 100.0), abs=1e-6)


@pytest.mark.parametrize("cost", [0.07, 0.1, 0.2, 0.5])
@pytest.mark.parametrize("wearer", [walks, sways, stops_and_goes])
def test_how_far_a_slow_solver_is_behind_is_what_it_says(wearer, cost):
    """The bound that stream_source.py promises, and no pose is reached faster than unhurried or as it was tracked."""
    session = play(wearer, lambda _: cost, seconds=40.0)
    slower = cost / LONGEST_MOVE
    late = ages(session, 10.0)
    assert late.max() <= slower * NEARBY / APPROACH_SPEED_MAX + 2.0 * cost + 0.03 + LOOK
    for one, other in itertools.pairwise(session.shown):
        speed = abs(other.move.pose.root[0] - one.move.pose.root[0]) / other.move.dt
        assert speed <= APPROACH_SPEED_MAX + 1e-6 or other.move.leap.any()


def test_who_stands_still_is_shown_as_now_by_a_slow_solver():
    """No way is left to go: then nothing is behind, but for the seconds that one move takes."""
    session = play(lambda t: posed(min(t, 1.9)), lambda _: 0.2, seconds=40.0)
    late = ages(session, 30.0)
    assert np.median(late) < LARGEST_LAG
    assert session.shown[-1].move.pose.root[0] == pytest.approx(1.9, abs=1e-9)


def test_a_solver_that_stands_still_for_a_while_makes_up_without_a_jump():
    """Two seconds for one step: what the wearer did is left out, unhurried, and then the frames are as young again."""
    session = play(walks, lambda now: 2.0 if 10.0 < now < 10.1 else 0.02)
    check_clock(session)
    assert ages(session, 15.0).max() < 0.03 + LOOK + 2 * 0.02 + 1e-6
    assert len([frame for frame in session.shown if 9.9 < frame.at < 13.0]) > 50


def test_a_stream_that_pauses_tells_the_time_of_the_pose_that_is_held():
    """The poses of a second never come: the cloth settles on, at the time of the last one."""
    session = play(sways, lambda _: 0.02, seconds=8.0, latency=lambda t: UNKNOWN if 4.0 < t < 5.0 else 0.03)
    check_clock(session)
    held = [frame.move for frame in session.shown if 4.0 + 0.03 + STALL_SECONDS + LOOK < frame.at < 5.0]
    assert len(held) > 10
    assert {move.t for move in held} == {held[0].t}
    assert 103.98 < held[0].t <= 104.0
    assert ages(session, 7.0).max() < 0.03 + LOOK + 2 * 0.02 + 1e-6


def test_poses_that_come_late_are_followed_as_they_come():
    """A network that begins to take 0.8 s longer: the poses of the time in between are shown, each at its time."""
    session = play(sways, lambda _: 0.02, seconds=12.0, latency=lambda t: 0.03 if t < 5.0 else 0.83)
    check_clock(session)
    first = next(frame for frame in session.shown if frame.move.t > 105.1)
    assert first.at < 5.1 + 0.83 + 0.1, "it does not wait for the time that the clock might have shown"
    assert ages(session, 11.0).max() < 0.83 + LOOK + 2 * 0.02 + 1e-6


def test_a_sender_whose_clock_goes_on_under_another_name_is_not_put_back():
    """A tracker that was announced anew: another stream, the same clock."""
    session = play(walks, lambda _: 0.02, sender=lambda t: (1 + (t > 10.0), 100.0))
    times = [frame.move.t for frame in session.shown if frame.move.pose_seq]
    assert (np.diff(times) > 0.0).all()
    assert ages(session, 14.0).max() < 0.03 + LOOK + 2 * 0.02 + 1e-6


@pytest.mark.parametrize("cost", [0.02, 0.2])
def test_of_two_clients_each_has_its_own_clock(cost):
    """The second one's is 70 s behind; a time is of the sender of the pose that the frame names."""
    session = play(walks, lambda _: cost, 40.0, sender=lambda t: (1, 100.0) if t < 15.0 else (2, 30.0))
    check_clock(session)
    of_second = {number for stream, number, _, _ in session.taken if stream == 2}
    second = [frame.move for frame in session.shown if frame.move.pose_seq in of_second]
    assert 30.0 + 15.0 - 2.0 < second[0].t < 30.0 + 15.0
    assert second[-1].t > 30.0 + 15.0


def test_a_clock_that_jumps_ahead_is_followed_by_the_body_first():
    """Four seconds between one pose and the next, of which nothing is known: the time comes with the way."""
    session = play(walks, lambda _: 0.02, sender=lambda t: (1, 100.0 + 4.0 * (t > 10.0)))
    check_clock(session)


@given(
    st.lists(st.floats(0.005, 0.6), min_size=5, max_size=40),
    st.lists(st.floats(0.0, 1.5), min_size=1, max_size=10),
    st.sampled_from([5.0, 13.0, 72.0]),
)
def test_whatever_takes_however_long(costs, latencies, rate):
    """Steps and networks of any delay, in any order; the second half of the pause never comes."""

    def latency(t: float) -> float:
        return UNKNOWN if 3.0 < t < 4.0 else latencies[int(t * 3.0) % len(latencies)]

    session = play(sways, lambda now: costs[int(now * 7.0) % len(costs)], seconds=8.0, rate=rate, latency=latency)
    check_clock(session)
    assert all(0.0 < frame.move.dt <= LONGEST_STEP for frame in session.shown)


@pytest.mark.parametrize("cost", [0.02, 0.2])
def test_a_leap_puts_nobody_back_in_time(cost):
    """A tracker that measures from elsewhere, 50 m away; then one who is found near by."""
    session = play(lambda t: posed(0.1 * t + 50.3 * (t > 10.0) + 1.4 * (t > 20.0)), lambda _: cost, seconds=40.0)
    check_clock(session)
    assert sum(bool(frame.move.leap.any()) for frame in session.shown) == 1
    for frame in session.shown:
        assert frame.move.dt <= max(LONGEST_MOVE, min(CATCH_UP * cost, LONGEST_STEP)) + 1e-9


@pytest.mark.parametrize("cost", [0.02, 0.07])
def test_a_pose_that_nobody_comes_to_in_the_time_is_leapt_to_and_the_limbs_follow(cost):
    """The tracker has found the wearer again, who squats now: 1.9 rad and 0.5 m from one pose to the next."""
    session = play(lambda t: posed(0.5 * (t > 10.0), 0.2 * np.sin(t) + 1.9 * (t > 10.0)), lambda _: cost, rate=30.0)
    check_clock(session)
    way = [other.pose.root[0] - one.pose.root[0] for one, other in itertools.pairwise(f.move for f in session.shown)]
    assert sorted(way)[-1] == pytest.approx(0.5)
    assert sorted(way)[-2] == 0.0
    for one, other in itertools.pairwise(frame.move for frame in session.shown):
        assert abs(turn_of(other.pose) - turn_of(one.pose)) <= LIMBS_TURN * other.dt + 0.02
    assert cost > LONGEST_MOVE or ages(session, 18.0).max() < 0.15
