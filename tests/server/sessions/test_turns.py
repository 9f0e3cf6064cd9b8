"""What a client sends faster than it may, and what it does wrong again and again: of neither anything vanishes."""

import re
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from session_driver import RULES, Driver, pose

from tryon_protocol import (
    ByeMessage,
    Codec,
    DesignMessage,
    EditMessage,
    EncodedFrame,
    ErrorMessage,
    MeasureEffectsMessage,
    PauseMessage,
    PingMessage,
    PlayMessage,
    PongMessage,
    ProtocolError,
    SetAccuracyMessage,
    SetEffectMessage,
    SetMotionMessage,
    SkeletonMessage,
    StatusMessage,
    UndoMessage,
    encode,
)
from tryon_server.sessions.commands import BuyAccuracy, ChangePattern, FollowMotion, Run, UsePose
from tryon_server.sessions.complaints import MOST_KINDS, Complaints
from tryon_server.sessions.events import Designed, FrameReady
from tryon_server.sessions.line import MOST_COUNTED

RATE = int(RULES.messages_per_second)


def worn(motion: str | None = "walk", rules=RULES) -> Driver:
    """A client watches a garment that is worn by its pattern."""
    driver = Driver(motion, rules)
    driver.dressed()
    driver.simulation(Designed(DesignMessage(held=False, panels=(), seams=(), done=(), undone=0), "cotton"))
    driver.connect(1)
    return driver


def spent(driver: Driver) -> Driver:
    """Its client has sent all that it may at once."""
    for _ in range(RATE):
        driver.say(1, PingMessage(t=0.0))
    assert driver.errors(1) == []
    return driver


def told_of(fault: ErrorMessage) -> int:
    """How many faults an answer stands for."""
    said = re.search(r"That came (\d+) times since it was answered last", fault.message)
    return int(said[1]) if said else 1


def bad_deadline(driver: Driver, value: float, **more) -> None:
    driver.say_bytes(1, msgspec.msgpack.encode({"type": "set_accuracy", "deadline_ms": value, **more}))


# What is wrong again and again ---------------------------------------------------------------------------------------


def test_each_of_the_same_faults_that_come_at_a_persons_pace_is_answered():
    driver = worn()
    for count in range(1, 9):
        bad_deadline(driver, -float(count))
        assert [(fault.code, fault.place) for fault in driver.messages(1, ErrorMessage)] == [
            ("invalid_field", "$.deadline_ms")
        ] * count
        for _ in range(4):
            driver.wait(0.1)


def test_faults_of_a_burst_are_summed_up_once_it_has_ceased():
    driver = worn()
    for _ in range(20):
        bad_deadline(driver, -1.0)
    assert len(driver.messages(1, ErrorMessage)) == 1
    driver.wait(0.2)
    assert len(driver.messages(1, ErrorMessage)) == 1
    driver.wait(0.15)
    first, rest = driver.messages(1, ErrorMessage)
    assert (first.place, told_of(first)) == (rest.place, 1)
    assert told_of(rest) == 19
    assert (rest.code, rest.remedy) == (first.code, first.remedy)
    driver.wait(5.0)
    assert len(driver.messages(1, ErrorMessage)) == 2


def test_a_single_fault_that_was_held_back_is_told_as_it_is():
    driver = worn()
    bad_deadline(driver, -1.0)
    driver.wait(0.1)
    driver.say_bytes(1, msgspec.msgpack.encode({"type": "set_accuracy", "deadline_ms": "soon"}))
    driver.wait(0.35)
    assert [fault.message for fault in driver.messages(1, ErrorMessage)] == [
        "Expected `float` >= 1.0.",
        "Expected `float | null`, got `str`.",
    ]


def test_bad_poses_of_a_tracker_are_answered_once_a_second_with_how_many_there_were():
    driver = worn(motion=None)
    for seq in range(1, 91):
        bad = [(0.0, 0.0, 0.0, 1.0)] * 3
        bad[seq % 3] = (float("nan"), 0.0, 0.0, 1.0)
        driver.say(1, pose(seq, seq / 30, rotations=tuple(bad)))
        driver.wait(1 / 30)
    answers = driver.messages(1, ErrorMessage)
    assert 3 <= len(answers) <= 4
    driver.wait(1.0)
    assert sum(map(told_of, driver.messages(1, ErrorMessage))) == 90


def test_what_is_wrong_with_a_number_is_answered_each_time_also_beyond_the_rate():
    driver = spent(worn())
    for number in range(400):
        bad_deadline(driver, -1.0, request=number)
    assert [fault.request for fault in driver.messages(1, ErrorMessage)] == list(range(400))


def test_a_skeleton_that_is_refused_is_answered_by_its_number():
    driver = worn(motion=None)
    driver.say(1, SkeletonMessage(subject="dog", convention="webxr", joint_names=("hips",), request=6))
    assert [(fault.code, fault.request) for fault in driver.messages(1, ErrorMessage)] == [("unknown_subject", 6)]


def test_of_more_kinds_of_faults_than_are_remembered_none_is_passed_over():
    complaints = Complaints()
    told = []
    for k in range(3 * MOST_KINDS):
        for _ in range(2):
            told += complaints.came(ProtocolError("edit_refused", f"$.part{k}", "It is none.", "Choose another."), 0.0)
    told += complaints.due(1.0)
    assert sorted(fault.place for fault in told) == sorted(2 * [f"$.part{k}" for k in range(3 * MOST_KINDS)])


# What comes faster than it may ---------------------------------------------------------------------------------------


def test_of_a_burst_of_choices_the_newest_stands_and_the_client_is_told_of_the_others():
    driver = worn()
    for k in range(400):
        driver.say(1, SetAccuracyMessage(deadline_ms=10.0 + k))
    assert len(driver.ordered(BuyAccuracy)) == RATE
    for _ in range(4):
        driver.wait(0.1)
    assert driver.ordered(BuyAccuracy)[-1] == BuyAccuracy(None, pytest.approx(0.409))
    assert driver.last(1, StatusMessage).deadline_ms == 409.0
    assert len(driver.ordered(BuyAccuracy)) == RATE + 1
    notices = driver.messages(1, ErrorMessage)
    assert {(notice.code, notice.request, notice.fatal) for notice in notices} == {("rate_limited", None, False)}
    assert all("100 messages a second" in notice.message and "`set_accuracy`" in notice.message for notice in notices)
    assert sum(map(told_of, notices)) == 400 - RATE - 1
    assert driver.closed == {}


def test_what_gave_way_is_told_by_its_kind():
    driver = spent(worn())
    for _ in range(3):
        driver.say(1, SetAccuracyMessage(accuracy=1e-3))
        driver.say(1, SetMotionMessage(motion="squat"))
    driver.wait(0.5)
    counts = dict.fromkeys(("set_accuracy", "set_motion"), 0)
    for notice in driver.messages(1, ErrorMessage):
        counts[re.search("`(.*)`", notice.message)[1]] += told_of(notice)
    assert counts == {"set_accuracy": 2, "set_motion": 2}
    assert driver.ordered(FollowMotion) == [FollowMotion("squat")]


def test_a_single_message_beyond_the_rate_only_waits():
    driver = spent(worn())
    driver.say(1, SetAccuracyMessage(accuracy=1e-3))
    assert driver.ordered(BuyAccuracy) == []
    driver.wait(0.1)
    assert driver.ordered(BuyAccuracy) == [BuyAccuracy(1e-3, None)]
    assert driver.errors(1) == []


def test_what_waits_is_refused_as_it_would_have_been_at_once():
    driver = spent(worn())
    driver.say(1, SetMotionMessage(motion="moonwalk", request=4))
    driver.wait(0.1)
    assert [(fault.code, fault.request) for fault in driver.messages(1, ErrorMessage)] == [("unknown_motion", 4)]


def test_nothing_overtakes_what_waits():
    driver = spent(worn())
    driver.say(1, UndoMessage(request=1))
    driver.say(1, SetAccuracyMessage(accuracy=1e-3))
    driver.now += 1.5 / RATE
    driver.say(1, SetAccuracyMessage(accuracy=2e-3))  # there is time for one, which is not this
    assert [command.step for command in driver.ordered(ChangePattern)] == ["undo"]
    assert driver.ordered(BuyAccuracy) == []
    driver.wait(0.1)
    assert driver.ordered(BuyAccuracy) == [BuyAccuracy(2e-3, None)]


def test_edits_beyond_the_rate_all_count_and_of_those_that_are_held_the_newest():
    driver = spent(worn())
    for k in range(5):
        driver.say(1, EditMessage(edit={"kind": "move", "by": k}, hold=True, request=k))
    for k in range(3):
        driver.say(1, EditMessage(edit={"kind": "keep", "by": k}, request=10 + k))
    driver.wait(0.1)
    ordered = [(command.hold, command.edit["by"]) for command in driver.ordered(ChangePattern)]
    assert ordered == [(True, 4), (False, 0), (False, 1), (False, 2)]


def test_beyond_what_may_wait_each_message_that_counts_is_refused_by_its_number_and_values_still_change():
    driver = spent(worn())
    for number in range(MOST_COUNTED + 3):
        driver.say(1, UndoMessage(request=number))
    driver.say(1, SetAccuracyMessage(accuracy=1e-3))
    faults = driver.messages(1, ErrorMessage)
    assert [fault.request for fault in faults] == [MOST_COUNTED, MOST_COUNTED + 1, MOST_COUNTED + 2]
    assert {fault.code for fault in faults} == {"rate_limited"}
    assert "this `undo` was not used" in faults[0].message
    driver.wait(1.0)
    assert len(driver.ordered(ChangePattern)) == MOST_COUNTED
    assert driver.ordered(BuyAccuracy) == [BuyAccuracy(1e-3, None)]


def test_the_newest_pose_beyond_the_rate_is_used_and_none_from_before_another_source():
    driver = spent(worn(motion=None))
    for seq in (1, 2, 3):
        driver.say(1, pose(seq))
    driver.wait(0.1)
    assert [command.seq for command in driver.ordered(UsePose)] == [3]
    driver = spent(worn(motion=None))
    driver.say(1, pose(1))
    driver.say(1, SetMotionMessage(motion="walk"))
    driver.wait(0.1)
    assert (driver.ordered(UsePose), driver.ordered(FollowMotion)) == ([], [FollowMotion("walk")])
    assert set(driver.errors(1)) == {"rate_limited"}


def test_values_that_are_renewed_all_the_time_have_their_turns_among_others():
    """Fifteen messages that count come for each pose and choice, half as many again as may be carried out."""
    driver = worn(motion=None)
    for k in range(200):
        for _ in range(15):
            driver.say(1, MeasureEffectsMessage())
        driver.say(1, pose(k + 1))
        driver.say(1, SetAccuracyMessage(deadline_ms=10.0 + k))
        driver.wait(0.1)
    assert driver.closed == {}
    used = [command.seq for command in driver.ordered(UsePose)]
    assert used == sorted(used)
    late = [seq for seq in used if seq > 100]
    assert len(late) > 10, "also once the line is full"
    assert max(np.diff(late)) <= 10, "a second"
    bought = [round(1e3 * command.deadline) - 10 for command in driver.ordered(BuyAccuracy)]
    assert sum(k > 100 for k in bought) > 10


def test_an_edit_that_is_held_stays_behind_the_changes_that_it_comes_after():
    driver = spent(worn())
    for kind, hold in (("drag", True), ("keep", False), ("drag on", True)):
        driver.say(1, EditMessage(edit={"kind": kind}, hold=hold))
    driver.say(1, MeasureEffectsMessage())
    driver.say(1, EditMessage(edit={"kind": "drag further"}, hold=True))
    driver.wait(0.1)
    assert [command.edit["kind"] for command in driver.ordered(ChangePattern)] == ["keep", "drag further"]


def test_effects_that_are_refused_again_and_again_are_summed_up():
    driver = worn()
    for _ in range(50):
        driver.say(1, SetEffectMessage(name="wind", parameters={"speed": float("nan")}))
    driver.wait(1.5)
    told = [fault for fault in driver.messages(1, ErrorMessage) if fault.code != "rate_limited"]
    assert len(told) <= 3
    assert sum(map(told_of, told)) == 50


def test_what_waits_is_carried_out_when_its_client_is_closed_for_a_flood():
    driver = spent(worn())
    driver.say(1, SetAccuracyMessage(deadline_ms=44.0))
    while not driver.closed:
        driver.say(1, PingMessage(t=0.0))
    assert driver.ordered(BuyAccuracy) == [BuyAccuracy(None, pytest.approx(0.044))]


def test_a_pose_from_before_another_skeleton_gives_way_to_it():
    driver = spent(worn(motion=None))
    driver.say(1, pose(1))
    driver.say(1, SkeletonMessage(subject="dog", convention="webxr", joint_names=("hips",), request=6))
    driver.wait(0.5)
    assert driver.ordered(UsePose) == []
    assert sorted(driver.errors(1)) == ["rate_limited", "unknown_subject"]


def test_frames_that_a_pose_acknowledges_are_acknowledged_though_it_gives_way():
    driver = worn(motion=None)
    for seq in (1, 2):
        driver.simulation(FrameReady(1, EncodedFrame(b"frame", seq, Codec.KEY, ())))
    assert len(driver.frames[1]) == 2
    spent(driver)
    driver.say(1, pose(1, ack=2))
    driver.say(1, pose(2))
    driver.simulation(FrameReady(1, EncodedFrame(b"frame", 3, Codec.KEY, ())))
    assert len(driver.frames[1]) == 3


@pytest.mark.parametrize("way", ["bye", "closed", "lost", "resumed"])
def test_what_waits_is_carried_out_when_its_client_leaves(way):
    driver = spent(worn(motion=None))
    token = driver.sent[1][0].resume_token
    driver.say(1, SetAccuracyMessage(accuracy=1e-3))
    driver.say(1, UndoMessage())
    driver.say(1, pose(1))
    match way:
        case "bye":
            driver.say(1, ByeMessage())
        case "closed" | "lost":
            driver.leave(1, in_good_order=way == "closed")
        case "resumed":
            driver.connect(2, resume=token)
    assert driver.ordered(BuyAccuracy) == [BuyAccuracy(1e-3, None)]
    assert [command.step for command in driver.ordered(ChangePattern)] == ["undo"]
    assert [command.seq for command in driver.ordered(UsePose)] == [1]


def test_who_says_goodbye_is_told_first_what_it_was_not_told_yet():
    driver = worn()
    for _ in range(5):
        bad_deadline(driver, -1.0)
    driver.say(1, ByeMessage())
    assert [told_of(fault) for fault in driver.messages(1, ErrorMessage)] == [1, 4]


def test_pause_and_play_are_one_value():
    driver = spent(worn())
    for message in (PauseMessage(), PlayMessage(), PauseMessage()):
        driver.say(1, message)
    before = len(driver.ordered(Run))
    driver.wait(0.1)
    assert driver.ordered(Run)[before:] == [Run(False, settle=False)]


def test_a_session_that_allows_less_than_a_message_a_second_takes_them_nevertheless():
    driver = worn(rules=replace(RULES, messages_per_second=0.5))
    driver.say(1, PingMessage(t=1.0))
    driver.say(1, PingMessage(t=2.0))
    assert [pong.t for pong in driver.messages(1, PongMessage)] == [1.0]
    driver.wait(2.0)
    assert [pong.t for pong in driver.messages(1, PongMessage)] == [1.0, 2.0]


def test_waiting_does_not_weaken_the_protection_from_floods():
    driver = worn()
    data = encode(SetAccuracyMessage(accuracy=1e-3))
    for _ in range(2000):
        driver.say_bytes(1, data)
    assert driver.closed == {1: 4429}
    assert driver.messages(1, ErrorMessage)[-1].fatal
    assert len(driver.ordered(BuyAccuracy)) == RATE + 1, "and what waited"
