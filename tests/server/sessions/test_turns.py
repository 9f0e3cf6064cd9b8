"""What a client does wrong again and again: nothing of it vanishes."""

import re

import msgspec
from session_driver import Driver, pose

from tryon_protocol import DesignMessage, ErrorMessage, ProtocolError
from tryon_server.sessions.complaints import MOST_KINDS, Complaints
from tryon_server.sessions.events import Designed


def worn(motion: str | None = "walk") -> Driver:
    """A client watches a garment that is worn by its pattern."""
    driver = Driver(motion)
    driver.dressed()
    driver.simulation(Designed(DesignMessage(held=False, panels=(), seams=(), done=(), undone=0), "cotton"))
    driver.connect(1)
    return driver


def told_of(fault: ErrorMessage) -> int:
    """How many faults an answer stands for."""
    said = re.search(r"That came (\d+) times since it was answered last", fault.message)
    return int(said[1]) if said else 1


def bad_deadline(driver: Driver, value: float, **more) -> None:
    driver.say_bytes(1, msgspec.msgpack.encode({"type": "set_accuracy", "deadline_ms": value, **more}))


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


def test_of_more_kinds_of_faults_than_are_remembered_none_is_passed_over():
    complaints = Complaints()
    told = []
    for k in range(3 * MOST_KINDS):
        for _ in range(2):
            told += complaints.came(ProtocolError("edit_refused", f"$.part{k}", "It is none.", "Choose another."), 0.0)
    told += complaints.due(1.0)
    assert sorted(fault.place for fault in told) == sorted(2 * [f"$.part{k}" for k in range(3 * MOST_KINDS)])
