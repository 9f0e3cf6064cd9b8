"""What clients ask for, and what they get wrong while the session goes on."""

import math

import msgspec
import pytest
from session_driver import JOINTS, Driver, pose

from tryon_protocol import (
    DesignMessage,
    EditMessage,
    ErrorMessage,
    GoodbyeMessage,
    PauseMessage,
    PlayMessage,
    ProtocolError,
    ReportMessage,
    SetAccuracyMessage,
    SetFabricMessage,
    SetMotionMessage,
    StatusMessage,
    WelcomeMessage,
    encode,
)
from tryon_server.sessions import OWN_MOTION
from tryon_server.sessions.commands import BuyAccuracy, ChangePattern, FollowMotion, Run, UsePose, WearFabric
from tryon_server.sessions.events import (
    Designed,
    Gone,
    PhaseChanged,
    PresetInForce,
    PresetRefused,
    Reported,
    Troubled,
)

QUARTER = math.sqrt(0.5)
REST = (0.0, 0.0, 0.0, 1.0)


def streaming() -> Driver:
    driver = Driver(motion=None)
    driver.dressed()
    driver.connect(1)
    return driver


def test_pose_reaches_the_simulation_with_normalised_rotations():
    driver = streaming()
    driver.say(1, pose(1, t=7.5, root=(1.0, 2.0, 3.0), rotations=((0.0, QUARTER, 0.0, QUARTER * 1.001), REST, REST)))
    (command,) = driver.ordered(UsePose)
    assert (command.seq, command.t_capture, command.root.tolist()) == (1, 7.5, [1.0, 2.0, 3.0])
    assert sum(command.rotations[0] ** 2) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("changes", "code", "place"),
    [
        ({"rotations": (REST, (0.0, math.nan, 0.0, 1.0), REST)}, "invalid_pose", "$.rotations[1]"),
        ({"rotations": (REST, REST)}, "invalid_pose", "$.rotations"),
        ({"rotations": (REST,) * 4}, "invalid_pose", "$.rotations"),
        ({"rotations": (REST, REST, (0.0, 0.0, 0.0, 0.0))}, "invalid_pose", "$.rotations[2]"),
        ({"root": (0.0, math.inf, 0.0)}, "invalid_pose", "$.root[1]"),
        ({"t": math.nan}, "invalid_pose", "$.t"),
        ({"subject": "somebody"}, "unknown_subject", "$.subject"),
        ({"convention": "smpl"}, "unsupported_convention", "$.convention"),
        ({"frame": "room"}, "unsupported_frame", "$.frame"),
    ],
)
def test_pose_that_cannot_be_used_is_answered_and_the_session_goes_on(changes, code, place):
    driver = streaming()
    driver.say(1, pose(1, **changes))
    error = driver.last(1, ErrorMessage)
    assert (error.code, error.place, error.fatal) == (code, place, False)
    assert error.remedy
    assert driver.ordered(UsePose) == []
    driver.say(1, pose(2))
    assert len(driver.ordered(UsePose)) == 1
    assert driver.closed == {}


def test_missing_joint_is_named():
    driver = streaming()
    driver.say(1, pose(1, rotations=(REST, REST)))
    assert JOINTS[2] in driver.last(1, ErrorMessage).message


@pytest.mark.parametrize("t", [1e300, -1e12])
def test_time_that_no_clock_shows_does_not_shut_out_the_poses_after_it(t):
    driver = streaming()
    driver.say(1, pose(1, t=t))
    assert driver.last(1, ErrorMessage).place == "$.t"
    driver.say(1, pose(2, t=5.0))
    assert [command.t_capture for command in driver.ordered(UsePose)] == [5.0]


@pytest.mark.parametrize(
    ("seq", "t", "place"), [(5, 9.0, "$.seq"), (4, 9.0, "$.seq"), (6, 5.0, "$.t"), (6, 4.0, "$.t")]
)
def test_poses_must_come_in_order(seq, t, place):
    driver = streaming()
    driver.say(1, pose(5, t=5.0))
    driver.say(1, pose(seq, t=t))
    assert driver.last(1, ErrorMessage).place == place
    assert [command.seq for command in driver.ordered(UsePose)] == [5]


def test_same_fault_is_answered_once_a_second():
    driver = streaming()
    for seq in range(1, 60):
        driver.say(1, pose(seq, subject="somebody"))
        driver.wait(0.05)
    assert len(driver.messages(1, ErrorMessage)) == 3


def test_pose_is_refused_while_a_motion_plays_and_before_the_garment_is_dressed():
    driver = Driver(motion=None)
    driver.connect(1)
    driver.say(1, pose(1))
    assert driver.errors(1) == ["unexpected_message"]
    driver.dressed()
    driver.say(1, SetMotionMessage(motion="squat"))
    driver.wait(2.0)
    driver.say(1, pose(2))
    assert driver.errors(1) == ["unexpected_message", "unexpected_message"]
    assert "squat" in driver.last(1, ErrorMessage).message


@pytest.mark.parametrize(
    "data", [b"", b"\x00", b"\xff" * 10, b"\x81\xa4type\xa4none", b"\xc1\x01", b"\xdf\xff\xff\xff\xff"]
)
def test_malformed_bytes_are_answered_and_the_connection_goes_on(data):
    driver = streaming()
    driver.say_bytes(1, data)
    assert len(driver.errors(1)) == 1
    driver.say(1, pose(1))
    assert len(driver.ordered(UsePose)) == 1


def test_message_that_is_too_long_is_answered():
    driver = streaming()
    driver.say_bytes(1, encode(PlayMessage()) + b"\x00" * 70000)
    assert driver.errors(1) == ["too_long"]


def test_text_message_is_answered():
    driver = streaming()
    driver.say_text(1)
    assert driver.errors(1) == ["malformed_message"]
    assert driver.closed == {}


def test_pause_holds_the_simulation_and_play_lets_it_go_on():
    driver = Driver()
    driver.dressed()
    driver.connect(1)
    driver.connect(2)
    driver.say(1, PauseMessage())
    assert driver.ordered(Run)[-1] == Run(False, settle=False)
    assert (driver.last(2, StatusMessage).state, driver.last(2, StatusMessage).playing) == ("paused", False)
    driver.say(2, PlayMessage())
    assert driver.ordered(Run)[-1] == Run(True)
    assert driver.last(1, StatusMessage).state == "running"


def test_what_is_edited_is_taken_on_while_nobody_watches_but_not_while_a_client_holds():
    driver = Driver()
    driver.dressed()
    driver.connect(1)
    driver.leave(1)
    assert driver.ordered(Run) == [Run(True), Run(False, settle=True)]
    driver.connect(2)
    driver.say(2, PauseMessage())
    driver.leave(2)
    assert driver.ordered(Run)[-1] == Run(False, settle=False)


def test_motion_and_fabric_are_chosen_by_name():
    driver = Driver()
    driver.dressed()
    driver.connect(1)
    driver.say(1, SetMotionMessage(motion="squat"))
    driver.say(1, SetFabricMessage(fabric="denim"))
    assert driver.ordered(FollowMotion) == [FollowMotion("squat")]
    assert driver.ordered(WearFabric) == [WearFabric("denim")]
    status = driver.last(1, StatusMessage)
    assert (status.motion, status.fabric) == ("squat", "denim")


def test_fabric_that_is_worn_is_not_dressed_again_unless_dressing_had_failed():
    driver = Driver()
    driver.dressed()
    driver.connect(1)
    driver.say(1, SetFabricMessage(fabric="cotton"))
    assert driver.ordered(WearFabric) == []
    driver.simulation(PhaseChanged("failed", "too tight"))
    driver.say(1, SetFabricMessage(fabric="cotton"))
    assert driver.ordered(WearFabric) == [WearFabric("cotton")]


def test_another_fabric_of_a_pattern_is_an_edit_of_it_and_told_once_it_is_worn():
    driver = Driver()
    driver.dressed()
    driver.connect(1)
    driver.simulation(Designed(DesignMessage(held=False, panels=(), seams=(), done=(), undone=0), "cotton"))
    driver.say(1, SetFabricMessage(fabric="denim", request=5))
    (command,) = driver.ordered(ChangePattern)
    assert (command.step, command.edit) == ("edit", {"kind": "change_fabric", "fabric": "denim"})
    assert driver.ordered(WearFabric) == []
    assert driver.last(1, StatusMessage).fabric == "cotton"
    driver.say(1, SetFabricMessage(fabric="cotton"))
    assert len(driver.ordered(ChangePattern)) == 2, "the other one is on its way"
    driver.simulation(Designed(DesignMessage(held=True, panels=(), seams=(), done=(), undone=0), "denim"))
    assert driver.last(1, StatusMessage).fabric == "cotton", "nothing is kept of what is held"
    driver.simulation(Designed(DesignMessage(held=False, panels=(), seams=(), done=(), undone=0), "denim"))
    assert driver.last(1, StatusMessage).fabric == "denim"


def test_after_dressing_has_failed_another_fabric_is_dressed_anew():
    driver = Driver()
    driver.dressed()
    driver.connect(1)
    driver.simulation(Designed(DesignMessage(held=False, panels=(), seams=(), done=(), undone=0), "cotton"))
    driver.simulation(PhaseChanged("failed", "too tight"))
    driver.say(1, SetFabricMessage(fabric="denim"))
    assert driver.ordered(WearFabric) == [WearFabric("denim")]


@pytest.mark.parametrize("given", [{"fabric": "steel"}, {"fabric": 7}, {}])
def test_an_edit_to_a_fabric_that_there_is_not_is_refused_with_those_that_there_are(given):
    """What is no name is the solver's to refuse, as any field."""
    driver = Driver()
    driver.dressed()
    driver.connect(1)
    driver.say(1, EditMessage(edit={"kind": "change_fabric", **given}, request=8))
    if given != {"fabric": "steel"}:
        assert len(driver.ordered(ChangePattern)) == 1
        return
    assert driver.ordered(ChangePattern) == []
    fault = driver.last(1, ErrorMessage)
    assert (fault.code, fault.place, fault.request) == ("unknown_fabric", "$.edit.fabric", 8)
    assert "cotton, denim" in fault.remedy
    with pytest.raises(ProtocolError, match="no fabric 'steel'"):
        driver.session.change_pattern(ChangePattern("edit", 0, {"kind": "change_fabric", **given}), driver.now)


def test_a_preset_is_chosen_for_all_clients_who_are_told_when_it_is_in_force():
    driver = streaming()
    driver.connect(2)

    def told(client):
        status = driver.last(client, StatusMessage)
        return status.preset, status.preset_in_force, status.preset_pending

    assert told(2) == (None, "", False)
    driver.simulation(PresetInForce("draft", None))
    assert told(2) == (None, "draft", False)
    driver.say(1, SetAccuracyMessage(accuracy=5e-5, preset="fit"))
    assert driver.ordered(BuyAccuracy) == [BuyAccuracy(5e-5, None, "fit")]
    assert told(2) == ("fit", "draft", True)
    driver.simulation(PresetInForce("fit", "fit"))
    assert told(2) == ("fit", "fit", False)
    driver.connect(3)
    assert told(3) == ("fit", "fit", False), "who joins is told, too"
    driver.say(2, SetAccuracyMessage(accuracy=5e-5))
    assert driver.ordered(BuyAccuracy)[-1] == BuyAccuracy(5e-5)
    assert told(1) == (None, "fit", True)


@pytest.mark.parametrize("name", ["auto", "fine", "x" * 100])
def test_a_preset_that_there_is_not_is_refused_by_name_with_the_choices(name):
    driver = streaming()
    driver.say(1, SetAccuracyMessage(accuracy=1e-3, preset=name, request=9))
    fault = driver.last(1, ErrorMessage)
    assert (fault.code, fault.place, fault.request) == ("invalid_field", "$.preset", 9)
    assert name[:70] in fault.message
    assert fault.remedy == "Choose one of: draft, live, fit, reference."
    assert driver.ordered(BuyAccuracy) == []
    assert driver.last(1, StatusMessage).accuracy is None


def test_a_preset_that_can_not_be_built_is_told_and_the_one_before_stands():
    driver = streaming()
    driver.simulation(PresetInForce("draft", None))
    driver.say(1, SetAccuracyMessage(accuracy=1e-3, preset="reference"))
    refused = PresetRefused("reference", None, "The preset reference could not be built.", "Choose it again.")
    driver.simulation(refused)
    fault, status = driver.last(1, ErrorMessage), driver.last(1, StatusMessage)
    assert (fault.code, fault.place, fault.fatal) == ("simulation_failed", "$.preset", False)
    assert (fault.message, fault.remedy) == (refused.message, refused.remedy)
    assert (status.preset, status.preset_in_force, status.preset_pending) == (None, "draft", False)
    assert status.accuracy == 1e-3, "what else was chosen stays"
    driver.say(1, SetAccuracyMessage(preset="fit"))
    driver.simulation(refused)  # of one that is asked for no more
    assert driver.last(1, StatusMessage).preset == "fit"


def test_accuracy_and_deadline_are_chosen_for_all_clients():
    driver = streaming()
    driver.connect(2)
    assert driver.last(2, StatusMessage).accuracy is None
    driver.say(1, SetAccuracyMessage(accuracy=5e-5, deadline_ms=11.1))
    assert driver.ordered(BuyAccuracy) == [BuyAccuracy(5e-5, pytest.approx(0.0111))]
    assert (driver.last(2, StatusMessage).accuracy, driver.last(2, StatusMessage).deadline_ms) == (5e-5, 11.1)
    driver.say(2, SetAccuracyMessage())
    assert driver.ordered(BuyAccuracy)[-1] == BuyAccuracy(None, None)
    assert (driver.last(1, StatusMessage).accuracy, driver.last(1, StatusMessage).deadline_ms) == (None, None)
    for number, (field, value) in enumerate(
        [("accuracy", 0.0), ("accuracy", float("nan")), ("accuracy", 1.0), ("deadline_ms", 0.5), ("deadline_ms", "11")]
    ):
        driver.say_bytes(1, msgspec.msgpack.encode({"type": "set_accuracy", field: value, "request": 50 + number}))
        fault = driver.last(1, ErrorMessage)
        assert (fault.code, fault.place, fault.request) == ("invalid_field", f"$.{field}", 50 + number)
    assert len(driver.ordered(BuyAccuracy)) == 2


def test_unknown_names_are_answered_with_the_request_number_and_what_there_is():
    driver = Driver()
    driver.connect(1)
    driver.say(1, SetMotionMessage(motion="moonwalk", request=41))
    driver.say(1, SetFabricMessage(fabric="steel", request=42))
    first, second = driver.messages(1, ErrorMessage)
    assert (first.code, first.request, first.place) == ("unknown_motion", 41, "$.motion")
    assert (second.code, second.request) == ("unknown_fabric", 42)
    assert "walk, squat" in first.remedy
    assert driver.ordered(FollowMotion) == driver.ordered(WearFabric) == []


@pytest.mark.parametrize("request_number", [7, None, -1, 2**40, "seven"])
def test_a_command_that_cannot_be_read_is_answered_with_its_number_if_it_has_one(request_number):
    driver = Driver()
    driver.connect(1)
    command = {"type": "set_motion", "motion": 5, "request": request_number}
    for _ in range(2):
        driver.say_bytes(1, msgspec.msgpack.encode(command))
    answers = driver.messages(1, ErrorMessage)
    assert {answer.code for answer in answers} == {"invalid_field"}
    expected = [7, 7] if request_number == 7 else [None]  # without a number, the same fault is told once a second
    assert [answer.request for answer in answers] == expected


def test_session_that_waits_for_poses_says_so():
    driver = streaming()
    assert driver.last(1, StatusMessage).state == "waiting"
    driver.say(1, pose(1))
    assert driver.last(1, StatusMessage).state == "running"
    driver.wait(2.5)
    assert driver.last(1, StatusMessage).state == "waiting"


def test_equal_status_is_not_sent_twice():
    driver = Driver()
    driver.dressed()
    driver.connect(1)
    before = len(driver.sent[1])
    for _ in range(20):
        driver.wait(0.1)
        driver.say(1, PlayMessage())
    assert len(driver.sent[1]) == before


def test_reports_and_troubles_reach_every_client():
    driver = Driver()
    driver.connect(1)
    driver.connect(2)
    report = ReportMessage(
        seq=1, t_sim=0.0, iterations=2, residual=0.1, min_gap=None, max_stretch=1.0, body_lag=0.0, pairs=0, retries=0,
        times_ms={}, solver_ms=1.0, frames_per_second=60.0, real_time_factor=1.0,
    )  # fmt: skip
    driver.simulation(Reported(report))
    driver.simulation(Troubled("simulation_failed", "$", "A step failed.", "Wait."))
    for client in (1, 2):
        assert driver.last(client, ReportMessage) == report
        assert driver.last(client, ErrorMessage).message == "A step failed."
    assert driver.closed == {}


def test_lost_simulation_is_told_with_advice_and_ends_the_session():
    driver = Driver()
    driver.connect(1)
    driver.simulation(Gone("its process was ended by signal 9"))
    error = driver.last(1, ErrorMessage)
    assert (error.code, error.fatal) == ("simulation_failed", True)
    assert "signal 9" in error.message
    assert "new session" in error.remedy
    assert driver.messages(1, GoodbyeMessage)[0].retry_after is None
    assert driver.closed == {1: 1000}
    assert driver.ended


def test_what_there_is_to_say_of_fit_and_files_is_in_the_status_as_long_as_it_is_worn():
    driver = Driver()
    driver.connect(1)
    driver.dressed()
    worn = ("the waist is wide", 0.9, ("body: it is open",), 0.95)
    driver.simulation(PhaseChanged("ready", "Dressed; wide", None, *worn))
    driver.wait(0.1)
    status = driver.last(1, StatusMessage)
    assert (status.state, status.fit, status.fitting_size) == ("running", "the waist is wide", 0.9)
    assert (status.notes, status.worn_size) == (("body: it is open",), 0.95)
    driver.connect(2)
    assert driver.last(2, StatusMessage).fit == "the waist is wide"
    driver.simulation(PhaseChanged("dressing", "Sewing the seams", 0.5))
    status = driver.last(1, StatusMessage)
    assert (status.fit, status.notes, status.worn_size) == ("", (), None)


@pytest.mark.parametrize("motion", [None, "walk", "squat"])
def test_a_body_that_moves_by_itself_has_no_other_motion(motion):
    driver = Driver(motion=OWN_MOTION)
    driver.connect(1)
    driver.dressed()
    assert driver.last(1, WelcomeMessage).motions == (OWN_MOTION,)
    assert driver.last(1, StatusMessage).state == "running"
    driver.say(1, SetMotionMessage(motion=motion, request=7))
    fault = driver.last(1, ErrorMessage)
    assert (fault.code, fault.request) == ("unknown_motion", 7)
    assert "moves by itself" in fault.message
    driver.session.offer_motion("dance")
    driver.say(1, SetMotionMessage(motion="dance"))
    assert driver.ordered(FollowMotion) == []
    driver.say(1, SetMotionMessage(motion=OWN_MOTION))
    assert driver.ordered(FollowMotion) == [FollowMotion(OWN_MOTION)]


def test_a_motion_that_was_uploaded_meanwhile_can_be_chosen_until_it_is_removed():
    driver = Driver()
    driver.connect(1)
    driver.dressed()
    driver.say(1, SetMotionMessage(motion="dance"))
    assert driver.errors(1) == ["unknown_motion"]
    driver.session.offer_motion("dance")
    driver.say(1, SetMotionMessage(motion="dance"))
    assert driver.ordered(FollowMotion) == [FollowMotion("dance")]
    driver.connect(2)
    assert driver.last(2, WelcomeMessage).motions == ("walk", "squat", "dance")
    driver.session.withdraw_motion("dance")
    driver.say(1, SetMotionMessage(motion="dance", request=8))
    assert driver.last(1, ErrorMessage).request == 8
