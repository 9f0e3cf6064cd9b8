"""A drag's edits: the newest is shown, and none takes the frames more time than its share."""

import pytest

from tryon_server.runtime.waiting import HELD_SHARE, LOOK_SECONDS, HeldBack
from tryon_server.sessions.commands import ChangePattern, Run

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
