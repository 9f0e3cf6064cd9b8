"""A tracker's poses in a session: announced, held, filtered, handed on; what can't be used is told once a second."""

from __future__ import annotations

import math

import numpy as np
import pytest
from session_driver import Driver, pose

from tryon_protocol import CONVENTIONS, ErrorMessage, PoseMessage, SkeletonMessage
from tryon_server.sessions.commands import UsePose, UseTrackedPose
from tryon_server.sessions.events import PhaseChanged, TopologyReady

NAMES = CONVENTIONS["webxr"].required
K = len(NAMES)
STILL = ((0.0, 0.0, 0.0, 1.0),) * K
RATE = 60.0


def streaming(followable: bool = True) -> Driver:
    driver = Driver(motion=None)
    driver.simulation(TopologyReady(1, b"topology", b"plain", ("hips", "spine", "head"), followable))
    driver.simulation(PhaseChanged("ready", "Dressed"))
    driver.connect(1)
    return driver


def skeleton(**changes) -> SkeletonMessage:
    return SkeletonMessage(**({"subject": "wearer", "convention": "webxr", "joint_names": NAMES} | changes))


def tracked(seq: int, height: float = 1.0, t: float | None = None, **changes) -> PoseMessage:
    values = {
        "subject": "wearer",
        "convention": "webxr",
        "frame": "session",
        "t": seq / RATE if t is None else t,
        "seq": seq,
        "positions": tuple((0.3 * k, height, 0.0) for k in range(K)),
        "rotations": STILL,
    }
    return PoseMessage(**(values | changes))


def test_a_trackers_pose_reaches_the_simulation_in_its_own_joints():
    driver = streaming()
    driver.say(1, skeleton(rest_positions=((0.0, 1.0, 0.0),) * K, rest_rotations=STILL))
    driver.say(1, tracked(1))
    assert driver.errors(1) == []
    (command,) = driver.ordered(UseTrackedPose)
    assert (command.seq, command.frame, command.skeleton.joint_names) == (1, "session", NAMES)
    assert command.skeleton.rest_rotations is not None
    np.testing.assert_allclose(command.pose.positions, tracked(1).positions)
    assert command.pose.tracked.all()


def test_a_pose_before_its_skeleton_is_refused():
    driver = streaming()
    driver.say(1, tracked(1))
    assert driver.last(1, ErrorMessage).code == "unexpected_message"
    driver.say(1, skeleton(convention="head-hands", joint_names=("viewer",)))
    driver.wait(1.0)
    driver.say(1, tracked(2))
    assert driver.errors(1) == ["unexpected_message"] * 2
    assert driver.ordered(UseTrackedPose) == []


def test_a_body_of_another_rig_takes_model_local_only():
    driver = streaming(followable=False)
    driver.say(1, skeleton())
    driver.say(1, tracked(1))
    error = driver.last(1, ErrorMessage)
    assert (error.code, error.place) == ("unsupported_convention", "$.convention")
    driver.say(1, pose(2))
    assert len(driver.ordered(UsePose)) == 1


def test_bad_poses_are_told_once_a_second_and_good_ones_go_on():
    driver = streaming()
    driver.say(1, skeleton())
    for seq in range(1, 121):  # two seconds, another joint at fault each time
        bad = list(tracked(seq).positions)
        bad[seq % K] = (math.nan, 0.0, 0.0)
        driver.say(1, tracked(seq, positions=tuple(bad)))
        driver.now += 1 / RATE
    assert driver.errors(1) == ["invalid_pose"] * 2
    assert NAMES[1] in driver.messages(1, ErrorMessage)[0].message
    assert driver.ordered(UseTrackedPose) == []
    driver.say(1, tracked(121))
    assert len(driver.ordered(UseTrackedPose)) == 1
    assert driver.closed == {}


@pytest.mark.parametrize("factor", [0.0, 100.0])
def test_poses_in_another_unit_or_of_nobody_are_refused_and_good_ones_go_on(factor):
    driver = streaming()
    driver.say(1, skeleton())
    places = factor * np.array(tracked(1).positions)
    driver.say(1, tracked(1, positions=tuple(map(tuple, places.tolist()))))
    assert driver.errors(1) == ["invalid_pose"]
    assert driver.last(1, ErrorMessage).place.startswith("$.positions[")
    assert driver.ordered(UseTrackedPose) == []
    driver.say(1, tracked(2))
    assert [command.seq for command in driver.ordered(UseTrackedPose)] == [2]


def test_a_rest_pose_in_centimetres_is_refused_and_the_skeleton_before_stays():
    driver = streaming()
    driver.say(1, skeleton())
    x = np.arange(K)[:, None]
    rest = 100.0 * x * [0.2, 0.0, 0.0]
    driver.say(1, skeleton(rest_positions=tuple(map(tuple, rest.tolist()))))
    error = driver.last(1, ErrorMessage)
    assert (error.code, error.place) == ("invalid_skeleton", "$.rest_positions")
    assert "centimetres" in error.remedy
    driver.say(1, tracked(1))
    assert driver.ordered(UseTrackedPose)[-1].skeleton.rest_positions is None


def test_landmarks_of_a_picture_are_refused_by_what_to_send():
    driver = streaming()
    names = CONVENTIONS["mediapipe"].required
    driver.say(1, skeleton(convention="mediapipe", joint_names=names))
    picture = tuple((0.5 + 0.05 * k, 0.4, 0.0) for k in range(len(names)))
    bent = {"convention": "mediapipe", "frame": "mediapipe-world", "positions": picture, "rotations": ()}
    driver.say(1, tracked(1, **bent))
    error = driver.last(1, ErrorMessage)
    assert (error.code, "pose_world_landmarks" in error.remedy) == ("invalid_pose", True)
    assert driver.ordered(UseTrackedPose) == []


def test_a_joint_that_was_never_seen_is_named_and_one_that_is_lost_is_carried_along():
    driver = streaming()
    driver.say(1, skeleton())
    lost = tuple(0.0 if k == 3 else 1.0 for k in range(K))
    driver.say(1, tracked(1, confidence=lost, smoothing="none"))
    error = driver.last(1, ErrorMessage)
    assert (error.place, NAMES[3] in error.message) == ("$.confidence[3]", True)
    driver.say(1, tracked(2, smoothing="none"))
    gone = tuple((math.nan,) * 3 if k == 3 else (0.3 * k, 1.25, 0.0) for k in range(K))
    driver.say(1, tracked(3, positions=gone, confidence=lost, smoothing="none"))
    last = driver.ordered(UseTrackedPose)[-1]
    assert last.seq == 3
    np.testing.assert_allclose(last.pose.positions, tracked(3, 1.25).positions)


def test_a_lost_joint_that_comes_back_is_filtered_from_where_it_was_held():
    driver = streaming()
    driver.say(1, skeleton())
    lost = tuple(0.0 if k == 3 else 1.0 for k in range(K))
    for seq in range(1, 60):
        driver.say(1, tracked(seq, confidence=lost if 10 < seq < 50 else ()))
    heights = [command.pose.positions[3, 1] for command in driver.ordered(UseTrackedPose)]
    assert len(heights) == 59
    np.testing.assert_allclose(heights, 1.0, atol=1e-12)


def test_model_local_poses_are_used_as_they_are_unless_the_sender_asks():
    for smoothing, expected in ((None, 1.1), ("none", 1.1), ("one-euro", None)):
        driver = streaming()
        driver.say(1, pose(1, t=1.0, root=(0.0, 1.0, 0.0), smoothing=smoothing))
        driver.say(1, pose(2, t=1.01, root=(0.0, 1.1, 0.0), smoothing=smoothing))
        height = driver.ordered(UsePose)[-1].root[1]
        assert (height == expected) if expected else (1.0 < height < 1.1)


def test_a_tracker_is_filtered_and_another_clock_begins_anew():
    driver = streaming()
    driver.say(1, skeleton())
    driver.say(1, tracked(1, 1.0))
    driver.say(1, tracked(2, 1.1))
    driver.say(1, tracked(3, 1.5, t=0.001, clock="server"))
    heights = [command.pose.positions[0, 1] for command in driver.ordered(UseTrackedPose)]
    assert driver.errors(1) == []
    assert heights[0] == 1.0
    assert 1.0 < heights[1] < 1.1
    assert heights[2] == 1.5
    streams = [command.stream for command in driver.ordered(UseTrackedPose)]
    assert streams[0] == streams[1] != streams[2]


def test_a_new_skeleton_is_numbered_and_forgets_the_filter():
    driver = streaming()
    driver.say(1, skeleton())
    driver.say(1, tracked(1, 1.0))
    driver.say(1, skeleton())
    driver.say(1, tracked(2, 1.5))
    first, second = driver.ordered(UseTrackedPose)
    assert first.skeleton_number != second.skeleton_number
    assert second.pose.positions[0, 1] == 1.5


@pytest.mark.parametrize("changes", [{"joint_names": ("hips",)}, {"convention": "kinect"}])
def test_a_skeleton_that_is_wrong_is_answered_and_the_one_before_stays(changes):
    driver = streaming()
    driver.say(1, skeleton())
    driver.say(1, skeleton(**changes))
    assert driver.errors(1) in (["invalid_skeleton"], ["unsupported_convention"])
    driver.say(1, tracked(1))
    assert len(driver.ordered(UseTrackedPose)) == 1
