"""How a client comes and goes: hello, versions, resuming, being turned away."""

from session_driver import Driver, pose

from tryon_protocol import (
    ByeMessage,
    GoodbyeMessage,
    HelloMessage,
    PingMessage,
    PlayMessage,
    PongMessage,
    StatusMessage,
    WelcomeMessage,
    encode,
)
from tryon_server.sessions.commands import FollowMotion, Run, UsePose


def test_hello_is_answered_by_welcome_then_status_then_topology():
    driver = Driver()
    driver.dressed()
    driver.connect(1)
    kinds = [type(message).__name__ for message in driver.sent[1]]
    assert kinds == ["WelcomeMessage", "StatusMessage", "bytes"]
    welcome = driver.last(1, WelcomeMessage)
    assert (welcome.session, welcome.version, welcome.topology_id, welcome.credit) == ("session-1", 1, 1, 2)
    assert welcome.motions == ("walk", "squat")
    assert welcome.clock == driver.now


def test_topology_follows_when_the_garment_is_dressed_later():
    driver = Driver()
    driver.connect(1)
    assert driver.last(1, WelcomeMessage).topology_id == 0
    driver.dressed()
    assert b"topology\x01" in driver.sent[1]


def test_client_without_zstd_gets_the_plain_topology():
    driver = Driver()
    driver.connect(1, codecs=())
    driver.dressed()
    assert b"plain" in driver.sent[1]


def test_no_common_version_is_a_fatal_error():
    driver = Driver()
    driver.connect_silently(1)
    driver.say(1, HelloMessage(versions=(7, 8), client="future"))
    assert driver.errors(1) == ["unsupported_version"]
    assert driver.sent[1][-1].fatal
    assert driver.closed == {1: 4400}


def test_first_message_must_be_hello():
    driver = Driver()
    driver.connect_silently(1)
    driver.say(1, PlayMessage())
    assert driver.errors(1) == ["unexpected_message"]
    assert driver.closed == {1: 4400}


def test_malformed_hello_is_fatal_and_names_the_fault():
    driver = Driver()
    driver.connect_silently(1)
    driver.say_bytes(1, b"\x93\x01\x02\x03")
    assert driver.sent[1][-1].fatal
    assert driver.closed == {1: 4400}


def test_silent_connection_is_closed_after_ten_seconds():
    driver = Driver()
    driver.connect_silently(1)
    driver.wait(9.9)
    assert driver.closed == {}
    driver.wait(0.2)
    assert driver.closed == {1: 4408}


def test_second_hello_is_an_error_and_the_connection_goes_on():
    driver = Driver()
    driver.connect(1)
    driver.say(1, HelloMessage(versions=(1,), client="again"))
    assert driver.errors(1) == ["unexpected_message"]
    assert driver.closed == {}


def test_ping_is_answered_with_both_clocks():
    driver = Driver()
    driver.connect(1)
    driver.say(1, PingMessage(t=5.5))
    pong = driver.last(1, PongMessage)
    assert (pong.t, pong.clock) == (5.5, driver.now)


def test_session_that_is_full_turns_the_next_client_away():
    driver = Driver()
    for client in (1, 2, 3):
        driver.connect(client)
    driver.connect_silently(4)
    assert driver.errors(4) == ["session_full"]
    assert driver.closed == {4: 4400}
    driver.leave(2)
    driver.connect(5)
    assert driver.messages(5, WelcomeMessage)


def test_simulation_runs_only_while_somebody_watches():
    driver = Driver()
    driver.dressed()
    assert driver.ordered(Run) == []
    driver.connect(1)
    driver.connect(2)
    driver.leave(1)
    assert driver.ordered(Run) == [Run(True)]
    driver.leave(2)
    assert driver.ordered(Run) == [Run(True), Run(False)]


def test_session_ends_when_nobody_watches_for_the_time_of_grace():
    driver = Driver()
    driver.connect(1)
    driver.wait(100.0)
    assert driver.ended is None
    driver.leave(1)
    driver.wait(29.0)
    assert driver.ended is None
    driver.wait(2.0)
    assert driver.ended == "Nobody was watching any more"


def test_bye_is_answered_by_a_normal_close():
    driver = Driver()
    driver.connect(1)
    driver.say(1, ByeMessage())
    assert driver.closed == {1: 1000}
    assert driver.session.viewer_count == 0


def test_end_of_the_server_tells_everybody_when_to_come_back():
    driver = Driver()
    driver.connect(1)
    driver.connect(2)
    driver.end("The server stops", retry_after=3.0)
    assert driver.last(1, GoodbyeMessage).retry_after == 3.0
    assert driver.closed == {1: 1001, 2: 1001}
    assert driver.ended == "The server stops"
    driver.end("again")
    assert driver.session.tick(driver.now) == []


def test_messages_after_the_end_change_nothing():
    driver = Driver()
    driver.connect(1)
    driver.end("over")
    orders = list(driver.orders)
    driver.say(1, PlayMessage())
    driver.dressed()
    assert driver.orders == orders


def test_resumed_client_takes_the_place_of_its_old_connection():
    driver = Driver(motion=None)
    driver.dressed()
    driver.connect(1)
    driver.connect(2)
    driver.say(1, pose(1))
    token = driver.last(1, WelcomeMessage).resume_token
    driver.connect(3, resume=token)
    assert driver.closed == {1: 1000}
    assert driver.last(3, WelcomeMessage).resume_token == token
    driver.say(3, pose(1))
    assert [command.stream for command in driver.ordered(UsePose)] == [1, 3]
    driver.leave(1)
    driver.say(3, pose(2))
    assert len(driver.ordered(UsePose)) == 3


def test_unknown_resume_token_makes_a_new_seat():
    driver = Driver()
    driver.connect(1, resume="made up")
    assert driver.last(1, WelcomeMessage).resume_token == "token-1"


def test_pose_right_waits_for_a_lost_client_and_then_goes_to_another():
    driver = Driver(motion=None)
    driver.dressed()
    driver.connect(1)
    driver.connect(2)
    driver.say(1, pose(1))
    driver.leave(1)
    driver.say(2, pose(1))
    assert driver.errors(2) == ["pose_source_taken"]
    driver.wait(16.0)
    driver.say(2, pose(2))
    assert [command.stream for command in driver.ordered(UsePose)] == [1, 2]


def test_pose_right_is_free_at_once_when_its_client_closed_the_connection_in_good_order():
    driver = Driver(motion=None)
    driver.dressed()
    driver.connect(1)
    driver.connect(2)
    driver.say(1, pose(1))
    driver.leave(1, in_good_order=True)
    driver.say(2, pose(1))
    assert driver.errors(2) == []
    assert [command.stream for command in driver.ordered(UsePose)] == [1, 2]


def test_choosing_a_motion_frees_the_pose_right():
    driver = Driver(motion=None)
    driver.dressed()
    driver.connect(1)
    driver.connect(2)
    driver.say(1, pose(1))
    from tryon_protocol import SetMotionMessage

    driver.say(2, SetMotionMessage(motion="walk"))
    driver.say(2, SetMotionMessage(motion=None))
    driver.say(2, pose(1))
    assert driver.ordered(FollowMotion) == [FollowMotion("walk"), FollowMotion(None)]
    assert driver.ordered(UsePose)[-1].stream == 2


def test_status_of_a_new_client_says_how_dressing_goes():
    from tryon_server.sessions.events import PhaseChanged

    driver = Driver()
    driver.simulation(PhaseChanged("dressing", "sewing", 0.25))
    driver.connect(1)
    status = driver.last(1, StatusMessage)
    assert (status.state, status.detail, status.progress) == ("dressing", "sewing", 0.25)


def test_flood_closes_the_connection():
    driver = Driver()
    driver.connect(1)
    data = encode(PingMessage(t=0.0))
    for _ in range(2000):
        driver.say_bytes(1, data)
    assert driver.closed == {1: 4429}


def test_of_pings_beyond_the_rate_the_newest_is_answered_and_the_connection_goes_on():
    driver = Driver()
    driver.connect(1)
    for k in range(300):
        driver.say(1, PingMessage(t=float(k)))
    assert driver.errors(1) == ["rate_limited"]
    assert len(driver.messages(1, PongMessage)) == 100
    driver.wait(1.1)
    assert driver.last(1, PongMessage).t == 299.0
    driver.say(1, PingMessage(t=300.0))
    assert driver.last(1, PongMessage).t == 300.0
    assert driver.errors(1) == ["rate_limited"] * 2  # the second tells how many gave way
    assert driver.closed == {}
