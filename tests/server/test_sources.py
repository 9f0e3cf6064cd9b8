"""Sources of poses: never faster than real time for long, never faster than the body was."""

import numpy as np
import pytest
from analytic_drape import load_motion, small_body, sway_at
from hypothesis import given
from hypothesis import strategies as st

from tryon_server.runtime.sources import (
    APPROACH_SPEED_MAX,
    LARGEST_DEBT,
    LONGEST_MOVE,
    NEARBY,
    SETTLE_SECONDS,
    MotionSource,
    StillSource,
    approach_seconds,
    leap_towards,
)
from tryon_server.runtime.stream_source import CATCH_UP, LONGEST_STEP, SHORTEST_MOVE, StreamSource
from tryon_solver.body.pose import Pose

BODY = small_body()
SWAY = load_motion("sway", BODY)


def at(x: float, turn: float = 0.0) -> Pose:
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))
    rotations[1] = [0.0, 0.0, np.sin(turn / 2), np.cos(turn / 2)]
    return Pose(np.array([x, 0.0, 0.0]), rotations)


@given(st.lists(st.floats(1e-3, 2.0), min_size=1, max_size=60))
def test_a_motion_is_never_ahead_of_wall_time_and_forgets_what_it_cannot_make_up(waits):
    source = MotionSource(SWAY, at(0.0))
    start = source.next(1e-9).t
    for k, elapsed in enumerate(waits):
        move = source.next(elapsed)
        assert 0 < move.dt <= LONGEST_MOVE
        assert move.t - start <= sum(waits[: k + 1]) + 1e-6
    behind = [source.next(1e-9).dt for _ in range(5)]
    assert sum(behind) <= LARGEST_DEBT + 1e-6


def test_a_hiccup_is_made_up():
    source = MotionSource(SWAY, at(0.0))
    begin = source.next(0.01).t
    for elapsed in [0.01] * 10 + [0.06] + [0.01] * 10:
        last = source.next(elapsed)
    assert last.t - begin == pytest.approx(0.26)


def test_motion_repeats_on_its_own_clock():
    source = MotionSource(SWAY, at(0.3))
    moves = [source.next(0.02) for _ in range(200)]
    assert moves[0].t < 0
    playing = [move for move in moves if move.t >= 0]
    assert playing[-1].t > 1.5
    for move in playing:
        assert move.pose.root[0] == pytest.approx(sway_at(move.t), abs=2e-4)


@pytest.mark.parametrize(("goal", "seconds"), [(at(0.0), 0.5), (at(3.0), 3.0), (at(0.0, 3.0), 1.5)])
def test_a_way_that_nobody_recorded_is_taken_unhurried(goal, seconds):
    assert approach_seconds(at(0.0), goal) == pytest.approx(seconds)


def test_still_body_settles_and_then_costs_nothing():
    source = StillSource(at(0.0))
    moves = [source.next(0.02) for _ in range(1000)]
    assert moves[500] is not None
    assert moves[-1] is None


def test_cloth_of_a_slow_solver_settles_for_as_long_where_no_pose_arrives():
    """By simulated time, in which it swings; a quarter of the wall's was a quarter of it."""
    stream, wall = StreamSource(at(0.0)), 4 * LONGEST_MOVE
    moves = [stream.next(wall, wall) for _ in range(1000)]
    assert sum(move.dt for move in moves if move is not None) == pytest.approx(SETTLE_SECONDS, abs=2 * LONGEST_MOVE)
    assert moves[-1] is None
    stream.settle_anew()
    assert stream.next(wall, wall) is not None


def follow(stream: StreamSource, poses, period: float, look: float, until: float) -> list:
    """Poses are captured each ``period`` s and looked at each ``look`` s."""
    moves, now, k = [], 0.0, 0
    while now < until:
        now += look
        while k * period <= now:
            stream.take(1, k + 1, 1000.0 + k * period, poses(k * period))
            k += 1
        moves.append(stream.next(look))
    return moves


@pytest.mark.parametrize("look", [1 / 60, 1 / 120])
@pytest.mark.parametrize("period", [1 / 90, 1 / 60, 1 / 30, 1 / 15])
def test_a_stream_is_caught_up_with_and_then_followed(period, look):
    moves = follow(StreamSource(at(0.0)), lambda t: at(3.0 + 0.3 * t), period, look, 8.0)
    done = [move for move in moves if move is not None]
    speeds = np.diff([move.pose.root[0] for move in done]) / [move.dt for move in done[1:]]
    assert np.abs(speeds).max() <= APPROACH_SPEED_MAX + 0.3
    newest = 1000.0 + period * np.floor(8.0 / period)
    assert done[-1].t == pytest.approx(newest, abs=period + 1e-6)
    assert done[-1].pose.root[0] == pytest.approx(3.0 + 0.3 * (done[-1].t - 1000.0), abs=1e-6)
    assert all(move.dt <= min(LONGEST_MOVE, CATCH_UP * look) + 1e-9 for move in done)


def ages(cost: float, seconds: float, rate: float = 72.0, latency: float = 0.045) -> tuple[np.ndarray, list]:
    """A solver that takes ``cost`` s for a step follows a tracker: when frames are there, how old they are, the moves.

    The wearer walks away at 0.3 m/s. The solver's steps are 1/30 s long or as long as the move allows.
    """
    stream = StreamSource(at(0.0))
    now, last_look, spent, captured, seen, moves = 0.0, 0.0, 0.0, 0, [], []
    while now < seconds:
        while captured / rate + latency <= now:
            stream.take(1, captured + 1, captured / rate, at(0.3 * captured / rate))
            captured += 1
        elapsed, last_look = now - last_look, now
        move = stream.next(elapsed, spent)
        if move is None:
            now += 1 / 72
            continue
        spent = cost * np.ceil(move.dt / max(1 / 30, move.longest_step) - 1e-9)
        now += spent
        moves.append(move)
        seen.append((now, now - move.t))
    return np.array(seen), moves


@pytest.mark.parametrize("cost", [0.01, 0.03, 0.04, 0.05])
def test_a_frame_is_as_old_as_the_solver_takes_and_no_older(cost):
    """It begins a second behind. What is left after some seconds: the tracker's latency, a pose's wait, one move."""
    seen, moves = ages(cost, 20.0)
    late = seen[seen[:, 0] > 5.0]
    assert late[:, 1].max() <= 0.045 + 1 / 72 + 2.0 * cost + 1e-6
    assert np.median(late[:, 1]) <= 0.045 + 1 / 72 + cost + 1e-6
    middle = len(late) // 2
    assert late[middle:, 1].mean() <= late[:middle, 1].mean() + 1e-3
    roots, steps = np.array([move.pose.root[0] for move in moves]), np.array([move.dt for move in moves])
    speeds = np.diff(roots) / steps[1:]
    assert np.abs(speeds).max() <= APPROACH_SPEED_MAX, "the body never jumps"
    assert speeds[-1] == pytest.approx(0.3), "as the wearer does"


@pytest.mark.parametrize("cost", [0.2, 0.5, 2.0])
def test_behind_a_solver_that_can_not_keep_up_the_age_is_bounded_and_the_body_unhurried(cost):
    seen, moves = ages(cost, 40.0)
    late = seen[seen[:, 0] > 10.0]
    slower = cost / LONGEST_MOVE
    assert late[:, 1].max() <= slower * NEARBY / APPROACH_SPEED_MAX + 0.045 + 1 / 72 + 2.0 * cost
    before = at(0.0)
    for move in moves:
        assert move.dt <= LONGEST_STEP
        way = move.pose.root[0] - before.root[0] - move.leap[0]
        assert abs(way) <= 1.3 * APPROACH_SPEED_MAX * move.dt + 1e-9
        before = move.pose
    assert 0.3 * seen[-1, 0] - moves[-1].pose.root[0] < NEARBY + 0.3 * (1.0 + 2.0 * cost), "it is near the wearer"


def test_only_a_slow_solver_takes_long_steps():
    """Poses that come rarely are no reason to."""
    _, moves = ages(0.005, 10.0, rate=8.0)
    assert max(move.dt for move in moves) <= LONGEST_MOVE
    assert not any(move.longest_step for move in moves)
    _, moves = ages(0.05, 10.0)
    assert LONGEST_MOVE < moves[-1].longest_step == moves[-1].dt < LONGEST_STEP
    _, moves = ages(0.2, 10.0)
    assert max(move.dt for move in moves) <= LONGEST_MOVE, "long steps would not help"


def test_another_sender_has_another_clock():
    stream = StreamSource(at(0.0))
    follow(stream, lambda _: at(0.0), 0.02, 0.02, 2.0)
    stream.take(2, 1, 5.0, at(0.2))
    first = stream.next(0.02)
    assert first.pose_seq == 1
    assert 3.9 < first.t < 5.0
    assert 0.0 < first.pose.root[0] < 0.02


def test_stream_that_stalls_holds_the_pose_and_goes_on_with_the_next():
    stream = StreamSource(at(0.0))
    follow(stream, lambda t: at(0.1 * t), 0.02, 0.02, 3.0)
    held = [stream.next(0.02) for _ in range(60)]
    assert held[5] is None, "it waits a moment before it settles"
    assert all(move.pose.root[0] == pytest.approx(0.3, abs=0.01) for move in held if move is not None)
    stream.take(1, 999, 1004.4, at(0.44))
    assert stream.next(0.02).pose.root[0] == pytest.approx(0.44, abs=0.15)


def test_a_wearer_who_appears_far_away_is_not_walked_to():
    """Body and garment are put there by whole metres, once, and the rest of the way is unhurried."""
    stream = StreamSource(at(0.25))
    moves = follow(stream, lambda _: at(10_000.0), 0.02, 0.02, 3.0)
    leaps = [move.leap for move in moves if move is not None]
    np.testing.assert_array_equal(leaps[0], [10_000.0, 0.0, 0.0])
    assert not np.any(leaps[1:])
    roots = [10_000.25, *(move.pose.root[0] for move in moves if move is not None)]
    assert roots[-1] == 10_000.0
    assert np.abs(np.diff(roots)).max() <= APPROACH_SPEED_MAX * LONGEST_MOVE + 1e-9


def test_a_wearer_nearby_is_walked_to():
    moves = follow(StreamSource(at(0.0)), lambda _: at(0.9 * NEARBY), 0.02, 0.02, 4.0)
    assert not np.any([move.leap for move in moves if move is not None])
    assert moves[0].pose.root[0] < 0.05
    assert [move for move in moves if move is not None][-1].pose.root[0] == pytest.approx(0.9 * NEARBY)


@pytest.mark.parametrize(("speed", "leaps"), [(8.0, 0), (0.0, 1)])
def test_running_is_motion_and_a_tracker_that_measures_from_elsewhere_is_not(speed, leaps):
    """After three seconds the second one's poses are 50 m away from one to the next."""
    stream = StreamSource(at(0.0))

    def pose(t):
        return at(speed * t + (50.3 if leaps and t > 3.0 else 0.0))

    moves = [move for move in follow(stream, pose, 0.02, 0.02, 6.0) if move is not None]
    put = [move.leap for move in moves if move.leap.any()]
    assert len(put) == leaps
    for leap in put:
        np.testing.assert_array_equal(leap, [50.0, 0.0, 0.0])
    assert moves[-1].pose.root[0] == pytest.approx(pose(moves[-1].t - 1000.0).root[0], abs=1e-6)


def test_a_leap_is_not_lost_when_poses_come_faster_than_moves():
    stream = StreamSource(at(0.0))
    for k in range(3):
        stream.take(1, k + 1, 1000.0 + 0.01 * k, at(30.0 + 40.0 * k))
    move = stream.next(0.02)
    np.testing.assert_array_equal(move.leap, [110.0, 0.0, 0.0])
    assert move.pose.root[0] == pytest.approx(110.0)


def test_a_motion_is_played_where_it_was_recorded():
    source = MotionSource(SWAY, at(-4_000.4))
    moves = [source.next(0.02) for _ in range(200)]
    np.testing.assert_array_equal(moves[0].leap, [4_000.0, 0.0, 0.0])
    assert not np.any([move.leap for move in moves[1:]])
    assert moves[0].pose.root[0] == pytest.approx(-0.4, abs=0.05)
    assert moves[-1].pose.root[0] == pytest.approx(sway_at(moves[-1].t), abs=2e-4)


@given(st.tuples(*[st.floats(-1e5, 1e5)] * 3))
def test_leaps_are_whole_metres_and_leave_less_than_one(place):
    goal = Pose(np.array(place), at(0.0).rotations)
    leap = leap_towards(at(0.0), goal)
    assert (leap == np.round(leap)).all()
    if np.linalg.norm(place) > NEARBY:
        assert np.abs(goal.root - leap).max() <= 0.5
    else:
        assert not leap.any()


@pytest.mark.parametrize("period", [LONGEST_MOVE + 1e-7, 1e-4, 1 / 90, 0.0171])
def test_no_move_is_so_short_that_roundings_become_speeds(period):
    """Poses a little longer apart than a move may be, or much closer: what is left over waits for the next one."""
    moves = follow(StreamSource(at(0.0)), lambda t: at(0.1 * t), period, 1 / 60, 4.0)
    done = [move.dt for move in moves if move is not None]
    assert len(done) > 100
    assert min(done) >= SHORTEST_MOVE
