"""The worker's loop in this process, with a fake connection and a fake clock."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import analytic_drape
import numpy as np
import pytest
from scripted_worker import LetGoError, ScriptedConnection, allow, clock_of, frames, work

from tryon_protocol import Skeleton, TrackedPose
from tryon_server.runtime.order import DrapeOrder, WorkOrder
from tryon_server.runtime.stream_source import LONGEST_STEP
from tryon_server.runtime.worker import FAILURES_IN_A_ROW, Worker
from tryon_server.sessions.commands import (
    AllowFrame,
    BuyAccuracy,
    FollowMotion,
    Run,
    UsePose,
    UseTrackedPose,
    WearFabric,
)
from tryon_server.sessions.events import FabricWorn, FrameReady, PhaseChanged, Reported, TopologyReady, Troubled

REST = np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))


def of(connection, kind) -> list:
    return [event for event in connection.events if isinstance(event, kind)]


def test_tells_how_it_begins_then_the_topology_then_that_it_is_ready():
    """What can be asked for of what is worn is there before anybody is told that it is."""
    connection = work([], until=1.0)
    assert [type(event).__name__ for event in connection.events] == [
        "PhaseChanged", "PhaseChanged", "TopologyReady", "EffectsTold", "PresetInForce", "PhaseChanged", "Designed",
    ]  # fmt: skip
    assert [event.phase for event in of(connection, PhaseChanged)] == ["preparing", "dressing", "ready"]
    assert of(connection, TopologyReady)[0].joint_names == ("hips", "spine", "head")


def test_what_there_is_to_say_of_the_fit_is_told_with_being_ready():
    def wide(order, progress):
        drape = analytic_drape.build(order, progress)
        notes = ("body: it is not closed",)
        drape.outfit = replace(drape.outfit, fit="the waist is 7 cm too wide", fitting_size=0.9, notes=notes, size=0.95)
        return drape

    assert of(work([], until=1.0), PhaseChanged)[-1] == PhaseChanged("ready", "Dressed", worn_size=1.0)
    told = of(work([], until=1.0, build=wide), PhaseChanged)[-1]
    assert told.detail == "Dressed; the waist is 7 cm too wide"
    assert (told.fit, told.fitting_size) == ("the waist is 7 cm too wide", 0.9)
    assert told.notes == ("body: it is not closed",)
    assert told.worn_size == 0.95


def test_does_nothing_until_it_is_to_run_and_stops_when_it_is_to_hold():
    connection = work([(0.0, allow(1000)), (1.0, Run(True)), (2.0, Run(False))], until=4.0)
    when = [t for t, event in zip(connection.times, connection.events) if isinstance(event, FrameReady)]
    assert when[0] < 0.1, "the state as dressed"
    assert all(1.0 <= t <= 2.03 for t in when[1:])
    assert 40 <= len(when) <= 52


def test_simulated_time_is_wall_time():
    connection = work([(0.0, allow(1000)), (0.0, Run(True))], until=3.0)
    decoded = frames(connection)
    assert decoded[-1].t_sim - decoded[1].t_sim == pytest.approx(
        decoded[-1].t_published - decoded[1].t_published, abs=0.03
    )
    for frame in decoded[1:]:  # the sheet waves by the time that it was told, which began with the approach of 0.5 s
        assert frame.cloth[0, 2] == pytest.approx(0.3 + 0.05 * np.sin(5 * (frame.t_sim + 0.5)), abs=1e-4)
    report = of(connection, Reported)[-1].report
    assert report.real_time_factor == pytest.approx(1.0, abs=0.02)
    assert report.frames_per_second == pytest.approx(50.0, abs=4.0)
    assert report.advice == ""


def test_advice_of_the_solver_is_in_the_reports():
    connection = work([(0.0, allow(1000)), (0.0, Run(True))], until=1.0, fabric="denim")
    assert of(connection, Reported)[-1].report.advice == "the fabric is stretched by 35 %"


def test_accuracy_and_deadline_are_those_of_the_newest_command_in_every_garment():
    bought = [(0.3, BuyAccuracy(1e-4)), (0.6, BuyAccuracy(2e-4, 0.0015)), (1.2, WearFabric("denim"))]
    connection = work([(0.0, allow(1000)), (0.0, Run(True)), *bought], until=2.4)
    told = [(event.report.error, event.report.late_ms) for event in of(connection, Reported)]
    assert told[0] == (2.5e-4, 0.0), "as the preset has it"
    assert told[-1] == (2e-4, pytest.approx(0.5)), "half a millisecond late, of denim"
    assert of(connection, Reported)[-1].report.advice
    assert list(dict.fromkeys(error for error, _ in told)) == [2.5e-4, 1e-4, 2e-4]


def test_reports_tell_of_each_frame_that_was_solved_since_the_one_before():
    bought = (0.6, BuyAccuracy(2e-4, 0.0015))
    connection = work([(0.0, allow(1000)), (0.0, Run(True)), bought], until=2.0, fabric="denim")
    reports = [event.report for event in of(connection, Reported)]
    newest = reports[-1]
    told = [price for report in reports for price in report.solved]
    solved = [frame for frame in frames(connection)[1:] if frame.seq <= newest.seq]  # the first is as dressed
    assert len(told) == len(solved) > 10 * len(reports)
    assert all((r.solved[-1].error, r.solved[-1].late_ms) == (r.error, r.late_ms) for r in reports)
    assert newest.solved[-1].solver_ms == newest.solver_ms
    assert {price.error for price in told} == {2.5e-4, 2e-4}
    assert [price.late_ms for price in newest.solved] == pytest.approx([0.5] * len(newest.solved))
    asleep = work([(0.0, allow(1000)), (0.0, Run(True))], until=1.0, fabric="resting")
    assert of(asleep, Reported)[-1].report.solved == ()


def test_while_the_garment_sleeps_reports_say_so_and_frames_go_on_by_the_clock():
    connection = work([(0.0, allow(1000)), (0.0, Run(True))], until=1.0, fabric="resting")
    assert of(connection, Reported)[-1].report.asleep
    assert not of(work([(0.0, allow(1000)), (0.0, Run(True))], until=1.0), Reported)[-1].report.asleep
    decoded = frames(connection)
    assert len(decoded) > 40
    assert (np.diff([frame.t_sim for frame in decoded[1:]]) > 0).all()


def test_motion_begins_with_an_approach_and_its_clock_is_the_motions_own():
    connection = work([(0.0, allow(1000)), (0.0, Run(True))], until=2.0)
    decoded = frames(connection)
    assert decoded[1].t_sim < 0 < decoded[-1].t_sim
    for frame in decoded[1:]:
        if frame.t_sim > 0:
            assert frame.root[0] == pytest.approx(analytic_drape.sway_at(frame.t_sim), abs=1e-4)
        else:
            assert abs(frame.root[0]) < 0.1


def test_frames_are_dropped_before_they_are_encoded():
    script = [(0.0, Run(True)), (0.0, allow(3)), (1.0, allow(4))]
    connection = work(script, until=2.0)
    decoded = frames(connection)
    assert [frame.seq for frame in decoded] == [1, 2, 3, 4]
    assert decoded[3].t_published == pytest.approx(1.0, abs=0.03), "the newest state, not one that waited"
    assert of(connection, FrameReady)[3].shared.needs == (3, 2)


def test_asked_again_while_holding_publishes_the_same_state_without_solving():
    script = [(0.0, allow(1)), (1.0, allow(2, again=True, keyframe=True, plain=True)), (2.0, allow(3))]
    connection = work(script, until=3.0)
    _, second = of(connection, FrameReady)
    assert second.shared.stands_alone
    assert second.plain is not None
    assert second.standalone is None
    one, two = frames(connection)
    np.testing.assert_array_equal(one.cloth, two.cloth)


def pose_command(seq: int, t: float, x: float) -> UsePose:
    return UsePose(7, seq, t, np.array([x, 0.0, 0.0]), REST)


def test_streamed_poses_are_followed_and_named_in_the_frames():
    poses = [(1.0 + 0.02 * k, pose_command(k + 1, 500.0 + 0.02 * k, 0.2 + 0.004 * k)) for k in range(150)]
    connection = work([(0.0, allow(1000)), (0.0, Run(True)), *poses], until=4.0, motion=None)
    decoded = frames(connection)
    followed = [frame for frame in decoded if frame.pose_seq]
    assert followed[0].pose_seq == 1
    speeds = np.diff([frame.root[0] for frame in followed]) / np.diff([frame.t_sim for frame in followed])
    assert speeds.max() < 0.5, "the way to the first pose is unhurried"
    last = followed[-1]
    assert last.t_sim == pytest.approx(500.0 + 0.02 * (last.pose_seq - 1), abs=1e-9), "the sender's clock"
    assert last.root[0] == pytest.approx(0.2 + 0.004 * (last.pose_seq - 1), abs=1e-9)
    assert last.pose_seq >= 148


class SlowSheet(analytic_drape.WavingSheet):
    """Takes `cost` s for each step of at most 1/30 s, or of as much as it may."""

    clock: ScriptedConnection
    cost = 0.05
    longest = 0.0

    def advance(self, pose, t, longest_step=0.0):
        self.longest = max(self.longest, longest_step)
        self.clock.now += self.cost * np.ceil((t - self.t) / max(1 / 30, longest_step) - 1e-9)
        return super().advance(pose, t, longest_step)


def test_frames_of_a_slow_solver_are_of_the_newest_pose_there_was():
    """The age of a frame neither stays at the second that it begins with, nor does it grow."""
    sheet = SlowSheet("cotton")
    poses = [(1.0 + 0.02 * k, pose_command(k + 1, 1.0 + 0.02 * k, 0.002 * k)) for k in range(1000)]
    script = [(0.0, allow(10_000)), (0.0, Run(True)), *poses]
    connection = ScriptedConnection(script, 21.0)
    sheet.clock = connection
    order = WorkOrder(DrapeOrder(Path("pattern.json"), "cotton", "draft", "cpu"), None, 50.0, 1.0)
    with pytest.raises(LetGoError):
        Worker(connection, order, lambda *_: sheet, analytic_drape.load_motion, *clock_of(connection)).run()
    followed = [frame for frame in frames(connection) if frame.pose_seq]
    late = [frame.t_published - frame.t_sim for frame in followed if frame.t_published > 5.0]
    assert len(late) == pytest.approx(16 / 0.05, rel=0.1)
    assert max(late) < 2 * 0.05 + 0.02
    assert np.median(late) < 0.05 + 0.02 + 0.01
    assert 1 / 30 < sheet.longest <= LONGEST_STEP
    for frame in followed:
        if frame.t_published > 5.0:
            assert frame.root[0] == pytest.approx(0.1 * (frame.t_sim - 1.0), abs=1e-6), "where the wearer was then"


def test_frames_of_a_solver_that_can_not_keep_up_tell_the_time_of_the_pose_they_show():
    """Six times slower than the wall. A client that has the poses finds the body where the wearer was at that time."""
    sheet = SlowSheet("cotton")
    sheet.cost = 0.2
    poses = [(1.0 + 0.02 * k, pose_command(k + 1, 1.0 + 0.02 * k, 0.002 * k)) for k in range(1950)]
    connection = ScriptedConnection([(0.0, allow(10_000)), (0.0, Run(True)), *poses], 40.0)
    sheet.clock = connection
    order = WorkOrder(DrapeOrder(Path("pattern.json"), "cotton", "draft", "cpu"), None, 50.0, 1.0)
    with pytest.raises(LetGoError):
        Worker(connection, order, lambda *_: sheet, analytic_drape.load_motion, *clock_of(connection)).run()
    followed = [frame for frame in frames(connection) if frame.pose_seq]
    assert (np.diff([frame.t_sim for frame in followed]) > 0.0).all()
    begun = [frame for frame in followed if frame.t_sim >= 1.0]
    assert len(begun) > 100
    for frame in begun:
        assert frame.root[0] == pytest.approx(0.1 * (frame.t_sim - 1.0), abs=1e-6)
        assert frame.t_sim <= 1.0 + 0.02 * (frame.pose_seq - 1) + 1e-9
    assert max(frame.t_published - frame.t_sim for frame in begun if frame.t_published > 20.0) < 4.0


def test_a_paused_stream_goes_on_from_the_pose_and_the_time_it_stood_at():
    """Poses come all along. Nothing is simulated for five seconds; then the way to the wearer is gone unhurried."""
    poses = [(1.0 + 0.02 * k, pose_command(k + 1, 500.0 + 0.02 * k, 0.004 * k)) for k in range(700)]
    held = [(5.0, Run(False)), (10.0, Run(True))]
    connection = work([(0.0, allow(10_000)), (0.0, Run(True)), *poses, *held], until=15.0, motion=None)
    followed = [frame for frame in frames(connection) if frame.pose_seq]
    assert not [frame for frame in followed if 5.1 < frame.t_published < 9.9]
    assert (np.diff([frame.t_sim for frame in followed]) >= 0.0).all()
    for frame in followed:
        if frame.t_sim >= 500.0:
            assert frame.root[0] == pytest.approx(0.2 * (frame.t_sim - 500.0), abs=1e-6)
    assert np.abs(np.diff([frame.root[0] for frame in followed])).max() < 0.05
    assert followed[-1].t_published - (followed[-1].t_sim - 499.0) < 0.1


def test_without_poses_the_cloth_settles_and_then_nothing_is_solved():
    connection = work([(0.0, allow(1000)), (0.0, Run(True)), (0.5, pose_command(1, 0.0, 0.0))], until=20.0, motion=None)
    when = [t for t, event in zip(connection.times, connection.events) if isinstance(event, FrameReady)]
    assert 13.0 < when[-1] < 14.5
    settling = [frame for frame in frames(connection) if frame.t_published > 3.0]
    assert len(settling) > 100, "frames go on, by numbers of their own"
    assert (np.diff([frame.seq for frame in settling]) > 0).all()
    assert len({(frame.t_sim, frame.pose_seq) for frame in settling}) == 1, "at the time of the pose, which stands"
    assert np.ptp([frame.cloth[0, 2] for frame in settling]) > 0.01, "with other cloth"


def test_who_joins_where_nothing_moves_any_more_is_shown_it_at_once_and_nobody_else_is_sent_anything():
    script = [(0.0, allow(1000)), (0.0, Run(True)), (18.0, allow(2000, again=True, keyframe=True)), (18.3, allow(2000))]
    connection = work(script, until=22.0, motion=None)
    decoded = frames(connection)
    late = [frame for frame in decoded if frame.t_published > 17.0]
    assert late[0].t_published == pytest.approx(18.0, abs=0.03)
    assert all(frame.stands_alone and 18.0 <= frame.t_published < 18.35 for frame in late)
    np.testing.assert_array_equal(late[0].cloth, decoded[-len(late) - 1].cloth)


def test_the_clock_of_frames_never_goes_back():
    """Not from the stance for dressing to the way into the motion, nor to another motion, nor where none is chosen any
    more and cloth settles, nor where the garment is dressed anew."""
    script = [(0.0, allow(1000)), (0.0, Run(True)), (1.0, FollowMotion("sway")), (1.7, FollowMotion(None))]
    script += [(2.4, FollowMotion("sway")), (3.0, WearFabric("denim")), (3.8, Run(False)), (4.0, Run(True))]
    times = [frame.t_sim for frame in frames(work(script, 5.0, motion="sway"))]
    assert times[0] == pytest.approx(-0.5), "where the way into the motion begins"
    assert times == sorted(times)
    assert times[-1] > 2.0


def test_another_motion_is_approached_from_where_the_body_stands():
    script = [(0.0, allow(1000)), (0.0, Run(True)), (0.9, FollowMotion("sway")), (2.0, FollowMotion(None))]
    connection = work(script, until=3.0)
    roots = np.array([frame.root[0] for frame in frames(connection)])
    assert np.abs(np.diff(roots)).max() < 0.02


def test_motion_that_cannot_be_played_is_reported_and_the_loop_goes_on():
    script = [(0.0, allow(1000)), (0.0, Run(True)), (1.0, FollowMotion("gone")), (2.0, FollowMotion("sway"))]
    connection = work(script, until=4.0)
    (trouble,) = of(connection, Troubled)
    assert trouble.code == "unknown_motion"
    assert frames(connection)[-1].t_published > 3.9


@pytest.mark.parametrize("first", ["cotton", "mesh"])
def test_other_fabric_is_worn_with_a_new_topology_and_a_frame_that_stands_alone(first):
    """A garment without a pattern is dressed anew; one with a pattern is worn on."""
    script = [(0.0, allow(1000)), (0.0, Run(True)), (1.0, WearFabric("denim"))]
    connection = work(script, until=2.0, fabric=first)
    assert [event.topology_id for event in of(connection, TopologyReady)] == [1, 2]
    first_of_second = next(frame for frame in frames(connection) if frame.topology_id == 2)
    assert first_of_second.stands_alone
    assert frames(connection)[-1].t_published > 1.9
    dressed = [event.phase for event in of(connection, PhaseChanged)].count("dressing")
    assert dressed == 1


def test_a_mesh_streams_on_until_it_is_dressed_of_its_new_fabric():
    script = [(0.0, allow(1000)), (0.0, Run(True)), (1.0, WearFabric("denim"))]
    connection = work(script, until=2.5, fabric="mesh", seconds_beside=0.5)
    seen = frames(connection)
    between = np.diff([frame.t_published for frame in seen if frame.t_published > 0.9])
    assert between.max() < 0.05, "no gap in the stream"
    assert sum(frame.topology_id == 1 for frame in seen if frame.t_published > 1.0) > 20, "the old one is worn on"
    worn = [event.fabric for event in of(connection, FabricWorn)]
    assert worn == ["denim"]
    assert seen[-1].topology_id == 2


@pytest.mark.parametrize(("asked", "worn"), [(("tight",), ["mesh"]), (("resting", "denim"), ["denim"])])
def test_a_mesh_is_worn_on_where_a_fabric_does_not_fit_and_of_two_fabrics_the_last_counts(asked, worn):
    script = [(0.0, allow(1000)), (0.0, Run(True)), *((1.0 + 0.1 * k, WearFabric(one)) for k, one in enumerate(asked))]
    connection = work(script, until=2.5, fabric="mesh", seconds_beside=0.5)
    assert [event.fabric for event in of(connection, FabricWorn)] == worn
    assert frames(connection)[-1].t_published > 2.4
    troubles = [(event.code, event.place) for event in of(connection, Troubled)]
    assert troubles == ([("edit_refused", "$.fabric")] if asked == ("tight",) else [])


def test_garment_that_cannot_be_dressed_is_reported_with_advice_and_may_be_dressed_otherwise():
    script = [(0.0, allow(1000)), (0.0, Run(True)), (1.0, WearFabric("cotton"))]
    connection = work(script, until=2.0, fabric="tight")
    trouble = of(connection, Troubled)[0]
    assert (trouble.code, trouble.remedy) == ("simulation_failed", "Enlarge the pieces.")
    assert [event.phase for event in of(connection, PhaseChanged)] == [
        "preparing", "dressing", "failed", "dressing", "ready",
    ]  # fmt: skip
    assert frames(connection)[-1].t_published > 1.9


def test_position_that_is_not_a_number_is_reported_and_never_published():
    connection = work([(0.0, allow(1000)), (0.0, Run(True))], until=3.0, fabric="nan")
    troubles = of(connection, Troubled)
    assert "not a number" in troubles[0].message
    assert of(connection, PhaseChanged)[-1].phase == "failed"
    assert all(np.isfinite(frame.cloth).all() for frame in frames(connection))
    assert 10 <= len(frames(connection)) <= 12


def test_steps_that_always_fail_end_in_a_failed_session_that_still_listens():
    connection = work([(0.0, Run(True)), (5.0, WearFabric("cotton"))], until=6.0, fabric="failing")
    troubles = of(connection, Troubled)
    assert len(troubles) == 2
    assert str(FAILURES_IN_A_ROW) in troubles[1].message
    assert "diverged" in troubles[1].message
    assert of(connection, PhaseChanged)[-1].phase == "ready"


def test_a_body_that_can_not_follow_a_tracker_says_so_once_a_second_and_the_loop_goes_on():
    viewer = Skeleton("head-hands", ("viewer",), None, None, None)
    pose = TrackedPose(None, np.array([[0.0, 1.62, 0.0]]), REST[:1], np.ones(1, dtype=bool))
    tracked = [(1.0 + k / 60, UseTrackedPose(1, k, k / 60, "session", viewer, 1, pose)) for k in range(1, 100)]
    good = [(2.8, UsePose(1, 100, 9.0, np.zeros(3), REST))]
    start = [(0.5, Run(True)), (0.5, AllowFrame(10_000, False, False, False, False))]
    connection = work([*start, *tracked, *good], until=4.0, motion=None)
    told = [event for event in connection.events if isinstance(event, Troubled)]
    assert [event.code for event in told] == ["invalid_skeleton"] * 2
    assert "model-local" in told[0].message
    assert [event for event in connection.events if isinstance(event, FrameReady)]


@pytest.mark.parametrize(
    ("turned", "told"),
    [
        ([(0.0, 6.0, 180.0)], [3.0]),
        ([(0.0, 1.5, 180.0), (1.5, 6.0, 0.0)], []),
        ([(0.0, 1.5, 180.0), (1.5, 2.0, 20.0), (2.0, 6.0, 160.0)], [5.0]),
        ([(0.0, 2.5, 180.0), (2.5, 3.0, 0.0), (3.0, 6.0, 180.0)], [3.0]),
        ([(0.0, 6.0, 95.0)], []),
    ],
)
def test_a_body_upside_down_for_long_is_told_once_and_followed(turned, told):
    """A tracker that is turned over; not who turns a cartwheel, nor who lies."""
    poses = []
    for k in range(1, 360):
        t = k / 60
        degrees = next(angle for begins, ends, angle in turned if begins <= t < ends)
        turn = np.deg2rad(degrees / 2)
        rotations = np.vstack([[[np.sin(turn), 0.0, 0.0, np.cos(turn)]], REST[1:]])
        poses.append((1.0 + t, UsePose(1, k, 50.0 + t, np.array([0.0, 1.0, 0.0]), rotations)))
    connection = work([(0.5, allow(10_000)), (0.5, Run(True)), *poses], until=8.0, motion=None)
    assert [event.code for event in of(connection, Troubled)] == ["upside_down"] * len(told)
    times = [time for time, event in zip(connection.times, connection.events) if isinstance(event, Troubled)]
    assert times == pytest.approx(told, abs=0.3)
    assert frames(connection)[-1].pose_seq == 359
    if turned[-1][2] == 180.0:
        assert abs(frames(connection)[-1].rotations[0] @ [1.0, 0.0, 0.0, 0.0]) > 0.999, "as it was sent"


def test_quaternions_that_begin_with_w_are_told_once_and_followed():
    w_first = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    poses = [(1.0 + k / 60, UsePose(1, k, 50.0 + k / 60, np.array([0.0, 1.0, 0.0]), w_first)) for k in range(1, 360)]
    connection = work([(0.5, allow(10_000)), (0.5, Run(True)), *poses], until=8.0, motion=None)
    assert [event.code for event in of(connection, Troubled)] == ["contorted"]
    assert frames(connection)[-1].pose_seq == 359
