"""Edits as the session's machine sees them: who asked, who is answered, who holds, and what newcomers are told."""

from dataclasses import replace

import pytest
from session_driver import Driver

from tryon_protocol import (
    DesignMessage,
    EditedMessage,
    EditMessage,
    ErrorMessage,
    ProtocolError,
    RedoMessage,
    StatusMessage,
    UndoMessage,
)
from tryon_server.sessions.actions import Answer, Keep, KeepWaiting
from tryon_server.sessions.commands import ChangePattern
from tryon_server.sessions.events import ChangesTold, ChangeUnderWay, Designed, EditMade, EditRefused, TakenOn
from tryon_server.sessions.pattern_changes import MOST_WAITING

MOVE = {"kind": "move_vertex", "panel": "front", "vertex": 1, "by": [0.01, 0.0]}
DESIGN = DesignMessage(held=False, panels=(), seams=(), done=(), undone=0)


@pytest.fixture
def driver():
    """Two clients of a dressed garment."""
    driver = Driver()
    driver.connect(1)
    driver.connect(2)
    driver.dressed()
    return driver


def made(ticket: int, step="edit", number=1, last=1) -> EditMade:
    return EditMade(ticket, step, number, last, "value", MOVE, False, {"pattern": {}})


def test_an_edit_is_ordered_kept_and_then_answered(driver):
    driver.say(1, EditMessage(edit=MOVE, mirror=True, request=41))
    (command,) = driver.ordered(ChangePattern)
    assert (command.step, command.edit, command.mirror, command.hold) == ("edit", MOVE, True, False)
    actions = driver.session.simulated(made(command.ticket), driver.now)
    assert actions == [Keep(made(command.ticket))]
    assert driver.messages(1, EditedMessage) == []  # not before it is stored
    driver._note(driver.session.kept(made(command.ticket), None, driver.now))
    assert driver.messages(1, EditedMessage) == [EditedMessage(id=1, change="value", request=41)]
    assert driver.messages(2, EditedMessage) == []


def test_undo_and_redo_are_ordered(driver):
    driver.say(1, UndoMessage(request=1))
    driver.say(2, RedoMessage(request=1))
    undo, redo = driver.ordered(ChangePattern)
    assert (undo.step, redo.step) == ("undo", "redo")
    assert undo.ticket != redo.ticket
    driver._note(driver.session.kept(made(redo.ticket, "redo", 4, 4), None, driver.now))
    assert driver.messages(1, EditedMessage) == []
    assert driver.messages(2, EditedMessage) == [EditedMessage(id=4, change="value", request=1)]


def test_a_refusal_is_told_to_who_asked(driver):
    driver.say(2, EditMessage(edit=MOVE, request=9))
    (command,) = driver.ordered(ChangePattern)
    driver.simulation(EditRefused(command.ticket, "by", "it would fold", "Move it less far"))
    (fault,) = driver.messages(2, ErrorMessage)
    told = (fault.code, fault.place, fault.message, fault.remedy, fault.request)
    assert told == ("edit_refused", "by", "it would fold", "Move it less far", 9)
    assert driver.messages(1, ErrorMessage) == []


def test_what_could_not_be_stored_is_told(driver):
    driver.say(1, EditMessage(edit=MOVE, request=5))
    (command,) = driver.ordered(ChangePattern)
    fault = ProtocolError("edit_not_kept", "$", "The disk is full.", "Make room.")
    driver._note(driver.session.kept(made(command.ticket), fault, driver.now))
    assert driver.messages(1, EditedMessage) == []
    assert (driver.last(1, ErrorMessage).code, driver.last(1, ErrorMessage).request) == ("edit_not_kept", 5)


def test_what_is_held_has_no_ticket_and_is_let_go_when_its_client_leaves(driver):
    driver.say(1, EditMessage(edit=MOVE, hold=True))
    driver.leave(2)
    assert driver.ordered(ChangePattern) == [ChangePattern("edit", 0, MOVE, hold=True)]
    driver.leave(1)
    assert driver.ordered(ChangePattern)[1:] == [ChangePattern("edit", 0, None, hold=True)]


def test_who_has_let_go_leaves_nothing_behind(driver):
    driver.say(1, EditMessage(edit=MOVE, hold=True))
    driver.say(1, EditMessage(edit=None, hold=True))
    driver.say(1, EditMessage(edit=MOVE, hold=True))
    driver.say(2, EditMessage(edit=MOVE))
    driver._note(driver.session.kept(made(driver.ordered(ChangePattern)[-1].ticket), None, driver.now))
    count = len(driver.ordered(ChangePattern))
    driver.leave(1)
    assert len(driver.ordered(ChangePattern)) == count


@pytest.mark.parametrize("leaves", ["before", "after"])
def test_what_is_held_on_after_a_refusal_is_let_go_when_its_client_leaves(driver, leaves):
    """Before the edit is refused that was to take its place, or after."""
    driver.say(1, EditMessage(edit=MOVE, hold=True))
    driver.say(2, EditMessage(edit=MOVE))
    refused = EditRefused(driver.ordered(ChangePattern)[-1].ticket, "by", "it would fold", "Move it less far")
    if leaves == "after":
        driver.simulation(refused)
    driver.leave(1)
    assert driver.ordered(ChangePattern)[2:] == [ChangePattern("edit", 0, None, hold=True)]
    if leaves == "before":
        driver.simulation(refused)
        assert [fault.code for fault in driver.messages(2, ErrorMessage)] == ["edit_refused"]


def test_a_refusal_of_what_is_held_goes_to_its_holder(driver):
    driver.say(1, EditMessage(edit=MOVE, hold=True, request=6))
    driver.say(1, EditMessage(edit=MOVE, hold=True, request=7))
    driver.simulation(EditRefused(0, "by", "it would fold", "Move it less far"))
    faults = driver.messages(1, ErrorMessage)
    assert [(fault.code, fault.request) for fault in faults] == [("edit_refused", 7)], "the one held"
    assert driver.errors(2) == []


def test_the_design_is_told_to_all_and_to_who_comes_later(driver):
    driver.simulation(Designed(DESIGN, "cotton"))
    driver.connect(3)
    for client in (1, 2, 3):
        assert driver.messages(client, DesignMessage) == [DESIGN]
    kinds = [type(message).__name__ for message in driver.sent[3]]
    assert kinds.index("bytes") < kinds.index("DesignMessage")  # the topology comes first


def test_what_is_to_be_kept_waits_until_the_garment_is_dressed_and_is_ordered_then():
    driver = Driver()
    driver.connect(1)
    driver.say(1, EditMessage(edit=MOVE, request=1))
    driver.say(1, EditMessage(edit=MOVE, hold=True, request=2))
    driver.say(1, UndoMessage(request=3))
    faults = driver.messages(1, ErrorMessage)
    assert [(fault.code, fault.request) for fault in faults] == [("unexpected_message", 2)], "nothing can be held"
    assert driver.ordered(ChangePattern) == []
    assert [change.step for change in driver.stored.values()] == ["edit", "undo"], "it is not lost in between"
    driver.wait(1.0)
    told = driver.last(1, StatusMessage).changes
    assert [(one.step, one.kind, one.panel, one.doing) for one in told] == [
        ("edit", "move_vertex", "front", "waiting"),
        ("undo", "", "", "waiting"),
    ]
    assert all("worn" in one.detail for one in told)
    driver.dressed()
    assert [command.step for command in driver.ordered(ChangePattern)] == ["edit", "undo"]
    driver.dressed(2)
    assert len(driver.ordered(ChangePattern)) == 2, "once"


def test_what_is_done_for_a_change_is_told_to_all_until_it_is_answered(driver):
    driver.say(1, EditMessage(edit=MOVE, request=1))
    asked = driver.now
    driver.wait(2.0)
    (command,) = driver.ordered(ChangePattern)
    driver.simulation(ChangesTold((ChangeUnderWay(command.ticket, "dressing", "Sewing the seams", 0.25),)))
    (told,) = driver.last(2, StatusMessage).changes
    assert (told.doing, told.detail, told.progress, told.since) == ("dressing", "Sewing the seams", 0.25, asked)
    driver._note(driver.session.kept(made(command.ticket), None, driver.now))
    driver.wait(1.0)
    assert driver.last(2, StatusMessage).changes == ()


def test_a_change_that_is_refused_waits_no_more_and_one_that_is_made_is_forgotten_as_it_is_stored(driver):
    for k in (1, 2):
        driver.say(1, EditMessage(edit=MOVE, request=k))
    first, second = driver.ordered(ChangePattern)
    driver.simulation(EditRefused(first.ticket, "by", "it would fold", "Move it less far"))
    assert list(driver.stored) == [second.ticket]
    assert driver.session.simulated(made(second.ticket), driver.now) == [Keep(made(second.ticket))]
    driver._note(driver.session.kept(made(second.ticket), None, driver.now))
    assert list(driver.stored) == [second.ticket], "whoever stores the edit forgets it in the same breath"


def test_what_waited_in_an_earlier_session_is_made_in_this_one_and_a_refusal_listed():
    driver = Driver()
    driver.connect(1)
    driver._note(driver.session.begin_with_changes([ChangePattern("edit", 0, MOVE)], driver.now))
    assert len(driver.stored) == 1
    driver.dressed()
    (command,) = driver.ordered(ChangePattern)
    driver.simulation(EditRefused(command.ticket, "by", "It would fold.", "Move it less far."))
    driver.wait(1.0)
    (told,) = driver.last(1, StatusMessage).changes
    assert (told.kind, told.doing, told.detail) == ("move_vertex", "refused", "It would fold. Move it less far.")
    assert driver.stored == {}


def test_an_edit_to_keep_has_to_be_there(driver):
    driver.say(1, EditMessage(edit=None, request=8))
    fault = driver.last(1, ErrorMessage)
    assert (fault.code, fault.place, fault.request) == ("invalid_field", "$.edit", 8)


def test_only_so_many_wait(driver):
    for k in range(MOST_WAITING + 1):
        driver.say(1, EditMessage(edit=MOVE, request=k))
    assert len(driver.ordered(ChangePattern)) == MOST_WAITING
    fault = driver.last(1, ErrorMessage)
    assert (fault.code, fault.request) == ("rate_limited", MOST_WAITING)
    driver.simulation(EditRefused(driver.ordered(ChangePattern)[0].ticket, "by", "no", "less"))
    driver.say(1, EditMessage(edit=MOVE, request=99))
    assert len(driver.ordered(ChangePattern)) == MOST_WAITING + 1


def test_who_has_left_is_not_answered(driver):
    driver.say(1, EditMessage(edit=MOVE, request=1))
    (command,) = driver.ordered(ChangePattern)
    driver.leave(1)
    assert driver.session.kept(made(command.ticket), None, driver.now) == []


def test_who_has_no_connection_is_answered_by_ticket(driver):
    ticket, (keep, order) = driver.session.change_pattern(ChangePattern("edit", 0, MOVE), driver.now)
    assert keep == KeepWaiting(ticket, order.command)
    assert order.command == ChangePattern("edit", ticket, MOVE)
    assert driver.session.kept(made(ticket), None, driver.now) == [Answer(ticket, made(ticket))]
    ticket, _ = driver.session.change_pattern(ChangePattern("undo"), driver.now)
    _, answer = driver.session.simulated(EditRefused(ticket, "history", "there is no edit to undo", "x"), driver.now)
    assert (answer.ticket, answer.outcome.code) == (ticket, "edit_refused")


def test_edits_are_on_the_way_until_the_garment_has_taken_them_on(driver):
    assert not driver.session.on_the_way("")
    driver.simulation(made(0, number=1))
    driver.simulation(made(0, "undo", number=1, last=0))
    driver.simulation(made(0, number=2))
    driver.simulation(replace(made(0, number=1), garment="coat"))
    assert driver.session.on_the_way("") == {1, 2}
    driver.simulation(TakenOn(""))
    assert driver.session.on_the_way("") == set()
    assert driver.session.on_the_way("coat") == {1}
