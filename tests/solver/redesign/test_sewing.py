"""Claims on seams gathered, eased, opened and closed, and on pieces taken away."""

import json
import re

import pytest
from pattern_measures import rectangle, seam_ratios, seams, sewn

from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import PatternError, parse_pattern
from tryon_solver.geometry.weld import weld
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.draft import read_draft
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import CloseSeam, Cut, Dart, Ease, Gather, MoveHandle, OpenSeam, RemovePiece


def stitch_of(spec, panel, edge):
    (found,) = [s for s in spec["pattern"]["stitches"] if {"panel": panel, "edge": edge} in s[:2]]
    return found


def test_a_gathered_seam_bears_what_a_plain_one_does_not(tube):
    # Its partner is straight and can't follow: bent to 30 cm beside the seam, this edge is over 1.5 times as long.
    tube["pattern"]["panels"]["front"]["edges"][1]["curvature"] = [0.5, -0.1]
    bend = MoveHandle("front", 1, 0, (0.5, 0.0))
    with pytest.raises(EditError, match=r"a ratio of 1\.76 over 1\.5") as caught:
        apply(tube, bend)
    assert caught.value.place == "stitches[0]"
    assert "gather the seam" in caught.value.remedy
    gathered = apply(tube, Gather("front", 1))
    assert stitch_of(gathered.specification, "front", 1)[2:] == ["gather"]
    assert gathered.change == "value"
    assert apply(gathered.specification, Gather("front", 1)).specification == gathered.specification
    made = apply(gathered.specification, bend).specification
    assert 1.5 < seam_ratios(made)[0] < 2


def test_a_seam_of_a_large_ratio_can_not_be_eased():
    panels = {"a": rectangle(40, 80), "b": rectangle(40, 40)}
    spec = sewn(panels, ("a", 1, "b", 3, "gather"), ("a", 3, "b", 1, "gather"))
    with pytest.raises(EditError, match=r"ratio of 2.00 over 1.5") as caught:
        apply(spec, Ease("b", 3))
    assert caught.value.place == "stitches[0]"


def test_easing_takes_the_gather_back(tube):
    gathered = apply(tube, Gather("front", 1)).specification
    assert gathered != tube
    assert apply(gathered, Ease("back", 3)).specification == tube


def test_an_opened_seam_is_gone_and_the_others_are_not(tshirt):
    made = apply(tshirt, OpenSeam("back", 8))
    gone = set(numbers_of(tshirt)) - set(numbers_of(made.specification))
    assert gone == {frozenset({"edge 1 of 'front'", "edge 8 of 'back'"})}
    assert len(made.specification["pattern"]["stitches"]) == 11
    assert made.change == "topology"
    meshes = [weld(mesh_pattern(parse_pattern(spec), 0.03)) for spec in (tshirt, made.specification)]
    assert meshes[1].vertex_count == meshes[0].vertex_count + round(0.38 / 0.03), "all but the one at the armhole"


def test_closing_sews_what_opening_undid(tshirt):
    opened = apply(tshirt, OpenSeam("front", 1)).specification
    closed = apply(opened, CloseSeam("front", 1, "back", 8))
    assert sorted(seams(closed.specification)) == sorted(seams(tshirt))
    assert closed.change == "topology"
    assert closed.notes == ()


def test_a_cut_that_was_left_open_is_closed_to_what_it_is_when_it_is_sewn(tshirt):
    line = (-0.5, 0.2), (0.5, 0.25)
    sewn, left_open = (apply(tshirt, Cut("front", line, sewn)).specification for sewn in (True, False))
    (new,) = [each for each in sewn["pattern"]["stitches"] if each not in left_open["pattern"]["stitches"]]
    one, other = new[:2]
    edit = CloseSeam(one["panel"], one["edge"], other["panel"], other["edge"])
    closed = apply(left_open, edit).specification["pattern"]
    assert sorted(map(str, closed["stitches"])) == sorted(map(str, sewn["pattern"]["stitches"]))
    one, other = (spec["panels"] for spec in (closed, sewn["pattern"]))
    assert one.keys() == other.keys()
    for name, piece in one.items():  # where a piece is placed to be put on is left: what was cut off lies apart
        assert (piece["vertices"], piece["edges"]) == (other[name]["vertices"], other[name]["edges"])


def test_closing_edges_of_different_lengths_tells_both(tshirt):
    made = apply(tshirt, CloseSeam("left_sleeve_front", 2, "right_sleeve_front", 1))
    assert made.notes == ()
    opened = apply(tshirt, OpenSeam("left_sleeve_front", 3)).specification
    made = apply(opened, CloseSeam("left_sleeve_front", 2, "left_sleeve_front", 3))
    (note,) = made.notes
    assert "18.0 cm" in note
    assert "19.0 cm" in note


def test_the_words_of_a_closed_seam_are_written(tshirt):
    made = apply(tshirt, CloseSeam("front", 4, "back", 5, gather=True, right_wrong=True)).specification
    assert stitch_of(made, "front", 4)[2:] == ["right_wrong", "gather"]
    sewn_now = parse_pattern(made).stitches[-1]
    assert sewn_now.gather
    assert not sewn_now.reversed


@pytest.mark.parametrize(
    ("edit", "place", "words"),
    [
        (CloseSeam("front", 0, "back", 8), "to_edge", "sewn already, to edge 1 of 'front'"),
        (CloseSeam("front", 1, "back", 0), "edge", "sewn already, to edge 8 of 'back'"),
        (CloseSeam("front", 0, "front", 0), "to_edge", "to itself"),
        (CloseSeam("front", 0, "bakc", 0), "to_panel", "no piece 'bakc'"),
        (CloseSeam("front", 0, "back", 9), "to_edge", "no edge 9"),
        (OpenSeam("front", 0), "edge", "not sewn"),
        (Gather("front", 4), "edge", "not sewn"),
        (RemovePiece("sleeve"), "panel", "no piece 'sleeve'"),
    ],
    ids=lambda value: getattr(value, "kind", None),
)
def test_seams_that_can_not_be_are_refused(tshirt, edit, place, words):
    with pytest.raises(EditError) as caught:
        apply(tshirt, edit)
    assert caught.value.place == place
    assert words in caught.value.message
    assert caught.value.remedy


def test_a_seam_that_alone_holds_the_garment_is_not_opened(skirt):
    with pytest.raises(EditError, match="it would fall off") as caught:
        apply(skirt, OpenSeam("skirt_front", 1))
    assert "Close another seam" in caught.value.remedy


def test_what_could_not_be_worn_before_may_be_opened_further(skirt):
    skirt["pattern"]["stitches"].pop()
    assert apply(skirt, OpenSeam("skirt_front", 1)).specification["pattern"]["stitches"] == []


def test_a_removed_piece_leaves_its_partners_open(tshirt):
    tshirt["pattern"]["panels"]["front"]["label"] = "body"
    made = apply(tshirt, RemovePiece("left_sleeve_back"))
    panels = made.specification["pattern"]["panels"]
    assert sorted(panels) == sorted(set(tshirt["pattern"]["panels"]) - {"left_sleeve_back"})
    assert made.specification["pattern"]["panel_order"] == list(panels)
    assert len(made.specification["pattern"]["stitches"]) == 9
    assert set(made.notes) == {
        "edge 7 of 'back' is open now",
        "edge 1 of 'left_sleeve_front' is open now",
        "edge 3 of 'left_sleeve_front' is open now",
    }
    assert made.change == "topology"


def test_the_only_piece_stays():
    spec = sewn({"a": rectangle(40, 40)}, ("a", 1, "a", 3))
    with pytest.raises(EditError, match="only piece"):
        apply(spec, RemovePiece("a"))


def numbers_of(spec):
    """The numbers of a pattern's seams, by which edges they join."""
    draft = read_draft(spec)
    return {frozenset(map(draft.said, (seam.first, seam.second))): seam.number for seam in draft.seams}


def test_seams_keep_their_numbers_when_others_are_opened_closed_and_divided(tshirt):
    before = numbers_of(tshirt)
    assert sorted(before.values()) == list(range(1, len(before) + 1))
    opened = apply(tshirt, OpenSeam("front", 8)).specification
    after = numbers_of(opened)
    assert after == {seam: number for seam, number in before.items() if "edge 8 of 'front'" not in seam}
    assert numbers_of(json.loads(json.dumps(opened))) == after, "a file tells them"
    parse_pattern(opened)
    closed = numbers_of(apply(opened, CloseSeam("front", 8, "back", 1)).specification)
    assert closed == after | {frozenset({"edge 8 of 'front'", "edge 1 of 'back'"}): len(before) + 1}
    darted = apply(opened, Dart("front", 1, 0.5, 0.03, 0.1)).specification
    assert sorted(numbers_of(darted).values()) == sorted([*after.values(), len(before) + 1, len(before) + 2])
    cut = apply(opened, Cut("back", ((-0.5, 0.2), (0.5, 0.2)), True)).specification
    assert set(after.values()) <= set(numbers_of(cut).values())
    assert len(set(numbers_of(cut).values())) == len(numbers_of(cut))


def test_a_seam_at_its_place_is_written_without_its_number(tshirt):
    gathered = apply(tshirt, Gather("front", 1)).specification
    assert "seam_number" not in json.dumps(gathered)


@pytest.mark.parametrize(
    ("number", "words"), [(0, "no number from 1 on"), ("2", "no number"), (1.5, "no number"), (1, "of stitches[0]")]
)
def test_a_number_that_is_none_or_another_seam_s_is_refused(tshirt, number, words):
    spec = json.loads(json.dumps(tshirt))
    spec["pattern"]["stitches"][2][0]["seam_number"] = number
    with pytest.raises(PatternError, match=re.escape(words)) as refused:
        parse_pattern(spec)
    assert refused.value.place == "stitches[2][0].seam_number"
    assert "Give each seam a number of its own" in refused.value.remedy
