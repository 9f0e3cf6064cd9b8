"""Claims on the history: undo and redo give back what was, ids are given once, and the limit is what it says."""

from copy import deepcopy

import pytest

from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import Lengthen, RemovePiece
from tryon_solver.redesign.history import UNDO_MAX, History


def test_undo_of_all_and_redo_of_all_pass_the_same_garments(tshirt):
    edits = [Lengthen("front", 0, 0.05), Lengthen("front", 0, -0.02), RemovePiece("left_sleeve_front")]
    history = History(tshirt)
    passed = [history.specification]
    for edit in edits:
        history = history.append(edit, apply(history.specification, edit).specification)
        passed.append(history.specification)
    assert [entry.id for entry in history.done] == [1, 2, 3]
    assert [entry.edit for entry in history.done] == edits
    assert len({str(each) for each in passed}) == 4
    for wanted in passed[-2::-1]:
        history = history.undo()
        assert history.specification == wanted
    assert history.specification is tshirt
    for wanted in passed[1:]:
        history = history.redo()
        assert history.specification == wanted


def test_an_edit_after_an_undo_forgets_what_was_undone_and_takes_a_new_id(tshirt):
    first = History(tshirt).append(Lengthen("front", 0, 0.1), {"made": 1})
    second = first.undo().append(Lengthen("front", 0, 0.2), {"made": 2})
    assert [entry.id for entry in second.done] == [2]
    assert second.specification == {"made": 2}
    with pytest.raises(EditError, match="no edit to redo"):
        second.redo()
    assert first.specification == {"made": 1}, "a history is a value"


def test_nothing_to_undo_is_said(tshirt):
    with pytest.raises(EditError, match="no edit to undo") as caught:
        History(tshirt).undo()
    assert f"{UNDO_MAX}" in caught.value.remedy


def test_a_thousand_edits_can_be_undone_and_hold_what_they_share_once(tshirt):
    """A history in which each held all of its pattern would be 25 MB of T-shirts."""
    history = History(tshirt)
    for number in range(1000):
        edit = Lengthen("front", 0, 1e-3 * (-1) ** number)
        history = history.append(edit, apply(history.specification, edit).specification)
    one, other = (history.done[k].specification["pattern"]["panels"] for k in (0, -1))
    assert one["front"] is not other["front"]
    assert one["left_sleeve_front"] is other["left_sleeve_front"] is tshirt["pattern"]["panels"]["left_sleeve_front"]
    for _ in range(1000):
        history = history.undo()
    assert history.specification is tshirt


def test_what_is_held_once_is_what_was_made(tshirt):
    edit = RemovePiece("left_sleeve_front")
    made = apply(tshirt, edit).specification
    before = deepcopy(tshirt), deepcopy(made)
    history = History(tshirt).append(edit, made)
    assert history.specification == made
    assert list(history.specification["pattern"]["panels"]) == list(made["pattern"]["panels"])
    assert (tshirt, made) == before


def test_the_oldest_edits_can_be_undone_no_more():
    history = History({"made": 0})
    for number in range(1, UNDO_MAX + 4):
        history = history.append(Lengthen("front", 0, 0.1), {"made": number})
    assert len(history.done) == UNDO_MAX
    assert history.done[-1].id == UNDO_MAX + 3
    for _ in range(UNDO_MAX):
        history = history.undo()
    assert history.specification == {"made": 3}
    with pytest.raises(EditError, match="no edit to undo"):
        history.undo()
