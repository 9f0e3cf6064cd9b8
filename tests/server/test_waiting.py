"""A drag's edits: the newest is shown, and none takes the frames more time than its share."""

import pytest
from analytic_drape import squares

from tryon_server.runtime.redesign import wanted
from tryon_server.runtime.waiting import HELD_SHARE, LOOK_SECONDS, HeldBack, WaitingChanges
from tryon_server.sessions.commands import ChangePattern, Run
from tryon_server.sessions.events import EditRefused
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.history import History

KEPT, UNDO = ChangePattern("edit", 7, {"kind": "lengthen"}), ChangePattern("undo", 8)


def held(ticket):
    return ChangePattern("edit", ticket, {"kind": "lengthen"}, hold=True)


class Desk:
    """Takes commands, each of which takes `seconds`, on a clock of its own."""

    def __init__(self, seconds=0.02):
        self.now, self.seconds, self.taken, self.back = 10.0, seconds, [], HeldBack()

    def come(self, *commands, busy=False):
        """They come; those that were taken now."""
        before = len(self.taken)
        self.back.take(commands, self._take, lambda: self.now, busy)
        return self.taken[before:]

    def _take(self, command):
        self.taken.append(command)
        self.now += self.seconds


def test_of_a_drag_the_newest_is_taken_after_all_that_is_no_drag():
    assert Desk().come(held(1), Run(True), held(2)) == [Run(True), held(2)]
    assert Desk().come(KEPT, UNDO) == [KEPT, UNDO]
    assert Desk().come() == []


def test_an_edit_that_is_kept_ends_the_drag_and_one_after_it_begins_another():
    desk = Desk()
    assert desk.come(held(1), KEPT) == [KEPT]
    assert desk.come() == []
    assert desk.come(UNDO, held(2)) == [UNDO, held(2)]


@pytest.mark.parametrize("seconds", [0.005, 0.05])
def test_a_drag_takes_its_share_of_the_time_and_no_more(seconds):
    desk, begun = Desk(seconds), 10.0
    for k in range(600):
        desk.come(held(k))
        desk.now += 1 / 60  # of a frame, beside the edit
    share = seconds * len(desk.taken) / (desk.now - begun)
    assert share <= HELD_SHARE + 0.01
    assert share > 0.8 * min(HELD_SHARE, seconds / (seconds + 1 / 60))
    tickets = [command.ticket for command in desk.taken]
    assert tickets == sorted(tickets)


def test_the_last_of_a_drag_is_taken_once_it_is_time_though_nothing_follows():
    desk = Desk()
    assert desk.come(held(1)) == [held(1)]
    assert desk.come(held(2)) == []
    left = desk.back.wait(None, desk.now, busy=False)
    assert left == pytest.approx(0.02 / HELD_SHARE - 0.02)
    assert desk.back.wait(0.01, desk.now, busy=False) == 0.01
    desk.now += left
    assert desk.back.wait(None, desk.now, busy=False) == pytest.approx(0.0)
    desk.now += 1e-9
    assert desk.come() == [held(2)]
    assert desk.back.wait(None, desk.now, busy=False) is None


def test_while_one_is_worked_out_the_newest_waits_and_what_is_no_drag_does_not():
    desk = Desk()
    assert desk.come(held(1), busy=True) == []
    assert desk.come(held(2), Run(True), busy=True) == [Run(True)]
    assert desk.back.wait(None, desk.now, busy=True) == LOOK_SECONDS
    assert desk.come() == [held(2)]
    assert desk.back.wait(None, desk.now, busy=True) == LOOK_SECONDS, "until it is there"


def edited(count):
    """A history of so many edits, each a wider front."""
    history = History(squares())
    for _ in range(count):
        wider = {"kind": "scale_piece", "panel": "front", "factors": [1.1, 1.0]}
        history = wanted(history, ChangePattern("edit", 1, wider)).history
    return history


def test_an_undo_to_what_cannot_be_worn_goes_further_back_and_says_so():
    """Refused, it would stand between the designer and all that came before, for good."""
    history, error = edited(3), EditError("it is sewn shut", "edit", "Open it")
    waiting = WaitingChanges()
    for ticket, step in ((7, "undo"), (8, "redo")):
        command = ChangePattern(step, ticket)
        waiting.add(command, wanted(history if ticket == 7 else waiting.newest.history, command), 0.0)
    waiting.refuse_first(error, history, 1.0)
    undone, redone = waiting.first, waiting.newest
    assert [entry.id for entry in undone.history.done] == [1]
    assert undone.notes == ("edit 2 is taken back with it, for what it made can't be worn: it is sewn shut",)
    assert (undone.id, len(undone.history.undone)) == (3, 2)
    assert redone is undone, "what leads there again is refused"
    waiting.refuse_first(error, history, 2.0)
    assert waiting.first.history.done == ()
    assert len(waiting.first.notes) == 2
    waiting.refuse_first(error, history, 3.0)
    assert waiting.first is None, "there is nothing further back"
    refusals = waiting.take_refused()
    assert all(isinstance(one, EditRefused) for one in refusals)
    assert [one.ticket for one in refusals] == [7, 8]


def test_an_edit_that_cannot_be_worn_and_an_undo_that_is_given_up_are_refused():
    history, error = edited(2), EditError("it is sewn shut", "edit", "Open it")
    narrower = {"kind": "scale_piece", "panel": "front", "factors": [0.9, 1.0]}
    for command in (ChangePattern("edit", 5, narrower), ChangePattern("undo", 5)):
        waiting = WaitingChanges()
        waiting.add(command, wanted(history, command), 0.0)
        if command.step == "edit":
            waiting.refuse_first(error, history, 1.0)
        else:
            assert waiting.refuse(5, error, history, 1.0)
        assert [one.ticket for one in waiting.take_refused()] == [5]
