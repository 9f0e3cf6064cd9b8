"""Why an edit of a garment that was made small can't be worn: what could not be put on, and which edit is to blame."""

import json
from pathlib import Path

import analytic_drape
import pytest
from scripted_worker import allow, work

import tryon_server
from tryon_server.runtime.tightness import (
    SEWN_SHUT,
    TOO_TIGHT,
    UnfitError,
    openings,
    refuse_what_is_too_tight,
    tightening,
    with_cause,
)
from tryon_server.sessions.commands import ChangePattern, Run
from tryon_server.sessions.events import EditMade, EditRefused
from tryon_solver.redesign import edits
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.history import History

TSHIRT = json.loads((Path(tryon_server.__file__).parent / "demo" / "patterns" / "tshirt.json").read_text())
DART = edits.Dart("front", 0, 0.5, 0.03, 0.1)
CUT = edits.Cut("front", ((-0.5, 0.2), (0.5, 0.2)), True)


def edited(*made):
    """The history of a T-shirt that was edited so."""
    history = History(TSHIRT)
    for edit in made:
        history = history.append(edit, apply(history.specification, edit).specification)
    return history


def test_the_edit_that_made_it_smallest_is_found_among_others():
    shrunk, widened = edits.ScaleGarment((0.85, 0.85)), edits.ScaleGarment((1.02, 1.0))
    entry, left = tightening(edited(widened, edits.ScalePiece("back", (0.98, 1.0)), shrunk, DART, CUT))
    assert (entry.id, entry.edit) == (3, shrunk)
    assert left == pytest.approx(0.85**2, abs=1e-3)


@pytest.mark.parametrize("made", [(), (DART, CUT), (edits.ScaleGarment((1.1, 1.0)),), (edits.OpenSeam("front", 1),)])
def test_where_none_made_it_smaller_none_is_to_blame(made):
    assert tightening(edited(*made)) is None
    error = UnfitError("it is too tight", "garment", "Make it larger")
    assert with_cause(error, edited(*made), DART, TSHIRT) is error


def test_a_refusal_names_the_edit_and_what_to_do_and_one_of_another_kind_is_as_it_was():
    history = edited(edits.ScaleGarment((0.85, 0.85)))
    said = with_cause(UnfitError("a seam stays open.", "panels.front", "Enlarge front."), history, DART, TSHIRT)
    assert said.message == "a seam stays open; edit 1 (scale_garment) left 72 % of the area of its pieces"
    assert said.place == "panels.front"
    back = "take edit 1 (scale_garment) back, make this one first, and that one after it"
    assert said.remedy == f"Enlarge front; or {back}"
    other = EditError("it crosses itself", "edit", "Draw it otherwise")
    assert with_cause(other, history, DART, TSHIRT) is other
    late = UnfitError("it is not worn after 120 s", "edit", "Ask for it again")
    assert with_cause(late, history, None, TSHIRT) is late, "what takes an edit back was worn before"


HEM = edits.CloseSeam("front", 0, "back", 0)
CUFF = edits.CloseSeam("left_sleeve_front", 2, "left_sleeve_back", 1)
CUFF_TO_CUFF = edits.CloseSeam("left_sleeve_front", 2, "right_sleeve_front", 1)


@pytest.mark.parametrize(
    ("made", "count"),
    [
        ((), 4),
        ((CUFF,), 3),
        ((CUFF, HEM), 2),
        ((CUFF_TO_CUFF,), 3),
        ((edits.OpenSeam("front", 1),), 4),  # the side: the hem and the sleeve's seam end in one slit
        ((edits.Pocket("front", (0.0, 0.2), 0.1, 0.1),), 4),
        ((CUT,), 4),
    ],
    ids=["as it is", "a cuff", "cuff and hem", "cuff to cuff", "a side opened", "a pocket", "a cut that is sewn"],
)
def test_openings_are_counted_as_the_sewn_garment_has_them(made, count):
    assert openings(edited(*made).specification) == count


@pytest.mark.parametrize("edit", [HEM, CUFF])
def test_of_what_is_sewn_shut_no_size_is_advised(edit):
    history = edited(edits.ScaleGarment((0.85, 0.85)))
    wanted = apply(history.specification, edit).specification
    said = with_cause(UnfitError("a seam stays open.", "panels.front", "Enlarge front."), history, edit, wanted)
    assert said.message == "a seam stays open; of 4 openings the seam leaves 3"
    assert "Leave these edges open" in said.remedy
    assert "nlarge" not in said.remedy


def test_a_seam_that_shuts_nothing_is_refused_as_ever():
    side = edited(edits.OpenSeam("front", 1))
    closed = edits.CloseSeam("front", 1, "back", 8)
    error = UnfitError("it is too tight", "garment", "Make it larger")
    assert with_cause(error, side, closed, TSHIRT) is error


def test_what_gives_no_room_is_refused_of_what_is_too_tight_and_what_may_is_tried():
    with pytest.raises(UnfitError, match="26 % of what is worn"):
        refuse_what_is_too_tight(DART, TOO_TIGHT + 0.01)
    refuse_what_is_too_tight(DART, TOO_TIGHT)
    for edit in (edits.OpenSeam("front", 1), edits.ChangeFabric("silk_satin"), edits.ScaleGarment((1.2, 1.2)), None):
        refuse_what_is_too_tight(edit, 0.9)


def answers_to(*commands, overstretched=0.0, **more):
    """What a running worker answers, and when [s], of a sheet so much of which is stretched too far."""

    def build(order, progress):
        sheet = analytic_drape.build(order, progress)
        sheet.overstretched = overstretched
        return sheet

    script = [(0.001, Run(True)), (0.001, allow(1000)), *((0.5 + 2 * k, each) for k, each in enumerate(commands))]
    connection = work(script, 8.0, build=build, seconds_beside=0.5, **more)
    told = zip(connection.times, connection.events)
    return [(t, event) for t, event in told if isinstance(event, EditMade | EditRefused)]


def narrowed(ticket, kind, factor):
    """The first square so many times as wide."""
    return ChangePattern("edit", ticket, {"kind": kind, "panel": "front", "factors": [factor, 1.0]})


def test_in_a_session_it_is_told_why_neither_way_works_and_since_which_edit():
    (_, made), (_, refused) = answers_to(narrowed(1, "scale_piece", 0.8), narrowed(2, "scale_piece", 0.7))
    assert made.id == 1
    assert refused.message == (
        "so it can't be worn: where the garment is worn, it would be stretched; and it is too tight; "
        "edit 1 (scale_piece) left 90 % of the area of its pieces"
    )
    assert refused.remedy.startswith("Make it wider; or take edit 1 (scale_piece) back")


def test_one_that_takes_too_long_tells_what_has_come_of_it():
    _, (_, refused) = answers_to(narrowed(1, "scale_piece", 0.8), narrowed(2, "scale_piece", 0.8), edit_seconds=0.8)
    assert refused.message.startswith(
        "it is not worn after 0.8 s, the most that an edit may take: where the garment is worn, it would be stretched, "
        "so it is put on anew (Putting it on anew); edit 1 (scale_piece) left 90 %"
    )


NEW_DART = {"kind": "dart", "panel": "front", "edge": 0, "position": 0.5, "width": 0.03, "depth": 0.1}
SHUT = {"kind": "close_seam", "panel": "front", "edge": 0, "to_panel": "back", "to_edge": 0}


@pytest.mark.parametrize(
    ("edit", "remedy"), [(NEW_DART, "Make the garment larger"), (SHUT, SEWN_SHUT)], ids=["dart", "sewn shut"]
)
def test_one_that_can_not_be_put_on_anew_is_refused_without_trying(edit, remedy):
    """Made of the tight sheet, from which it can't be carried over."""

    class Torn(analytic_drape.WavingSheet):
        def recut(self, cut, hung=None):  # noqa: ARG002
            self.not_carried = "where the garment is worn, front would be stretched to 2.31 times its length"
            return iter(())

    dressed = []

    def build(order, progress):
        dressed.append(order)
        sheet = analytic_drape.build(order, progress)
        sheet.__class__ = Torn
        sheet.overstretched = 0.3
        sheet.reshape = lambda specification, shape=None: "it has another structure"  # noqa: ARG005
        return sheet

    script = [(0.001, Run(True)), (0.001, allow(1000)), (0.5, ChangePattern("edit", 1, edit))]
    connection = work(script, 4.0, build=build, seconds_beside=0.5)
    (refused,) = (event for event in connection.events if isinstance(event, EditRefused))
    assert len(dressed) == 1
    assert refused.message.startswith(
        "so it can't be worn: where the garment is worn, front would be stretched to 2.31 times its length; and it "
        "can't be put on anew: 30 % of what is worn are stretched by more than the fabric bears already"
    )
    assert refused.remedy == remedy
