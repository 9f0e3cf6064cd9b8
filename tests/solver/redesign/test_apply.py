"""Claims on applying any edit: what goes in stays as it is, what is untouched is written as it was, faults are told."""

import json
from copy import deepcopy

import pytest
from pattern_measures import demo, rectangle, seams, sewn, two_squares
from tshirt_edits import EDITS

from tryon_solver.geometry.pattern import PatternError, parse_pattern
from tryon_solver.redesign import edits
from tryon_solver.redesign.apply import CHANGES, apply
from tryon_solver.redesign.edit_error import EditError

TOPOLOGY = (
    edits.OpenSeam,
    edits.CloseSeam,
    edits.Cut,
    edits.Dart,
    edits.Patch,
    edits.Pocket,
    edits.RemovePiece,
    edits.ChangeFabric,
)


def test_every_edit_can_be_applied_and_is_tried_here():
    assert set(CHANGES) == set(edits.KINDS.values()) == {type(edit) for edit in EDITS}


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: edit.kind)
def test_the_garment_it_is_applied_to_stays_and_the_result_is_json_of_its_own(edit, tshirt):
    before = deepcopy(tshirt)
    made = apply(tshirt, edit)
    assert tshirt == before
    assert json.loads(json.dumps(made.specification, allow_nan=False)) == made.specification
    assert (made.specification == tshirt) == isinstance(edit, edits.Ease), "the seam was plain"
    parse_pattern(made.specification)
    assert made.change == ("topology" if isinstance(edit, TOPOLOGY) else "value")
    # Nothing is shared: who changes the one does not change the other.
    for panel in made.specification["pattern"]["panels"].values():
        panel["vertices"][0][0] = 1e6
        panel["edges"][0]["label"] = "changed"
    made.specification["properties"]["units_in_meter"] = 1
    assert tshirt == before


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: edit.kind)
def test_what_the_parser_does_not_read_is_kept(edit, tshirt):
    tshirt["parameters"] = {"kept": [1, 2]}
    tshirt["pattern"]["note"] = "kept"
    tshirt["pattern"]["panels"]["right_sleeve_back"]["colour"] = "kept"
    tshirt["pattern"]["panels"]["right_sleeve_back"]["edges"][2]["label"] = "kept"
    made = apply(tshirt, edit).specification
    assert made["parameters"] == {"kept": [1, 2]}
    assert made["pattern"]["note"] == "kept"
    assert made["pattern"]["panels"]["right_sleeve_back"]["colour"] == "kept"
    assert made["pattern"]["panels"]["right_sleeve_back"]["edges"][2]["label"] == "kept"


def test_pieces_that_no_edit_touches_are_written_to_the_digit(tshirt):
    made = apply(tshirt, edits.Lengthen("front", 0, 0.05)).specification
    for name, panel in tshirt["pattern"]["panels"].items():
        same = json.dumps(made["pattern"]["panels"][name]["edges"]) == json.dumps(panel["edges"])
        assert same, "no curve changes, seen from its ends"
        digits = [json.dumps(spec["pattern"]["panels"][name]["vertices"][2:]) for spec in (made, tshirt)]
        assert digits[0] == digits[1]
    assert made["pattern"]["panels"]["front"]["vertices"][0] != tshirt["pattern"]["panels"]["front"]["vertices"][0]


def test_lengths_are_metres_whatever_the_files_unit(tshirt):
    inches = demo("tshirt")
    inches["properties"]["units_in_meter"] = 1000
    for panel in inches["pattern"]["panels"].values():
        panel["vertices"] = [[10 * x, 10 * y] for x, y in panel["vertices"]]
        panel["translation"] = [10 * x for x in panel["translation"]]
    for edit in EDITS:
        one, other = (apply(spec, edit).specification for spec in (tshirt, inches))
        for name, panel in one["pattern"]["panels"].items():
            in_millimetres = [10 * x for point in panel["vertices"] for x in point]
            got = [x for point in other["pattern"]["panels"][name]["vertices"] for x in point]
            assert got == pytest.approx(in_millimetres, abs=1e-5), edit
        assert seams(one) == seams(other)


def vertices_out_of_order():
    """The tube with its front's vertices listed in another order than its edges run."""
    spec = two_squares()
    front = spec["pattern"]["panels"]["front"]
    front["vertices"] = [[40, 40], [0, 0], [0, 40], [40, 0]]
    front["edges"] = [{"endpoints": ends} for ends in ([1, 3], [3, 0], [0, 2], [2, 1])]
    return spec


def test_vertices_are_counted_as_the_file_lists_them():
    made = apply(vertices_out_of_order(), edits.MoveVertex("front", 3, (0.01, 0.0))).specification
    front = made["pattern"]["panels"]["front"]
    assert front["vertices"][3] == pytest.approx([41, 0])
    assert [edge["endpoints"] for edge in front["edges"]] == [[1, 3], [3, 0], [0, 2], [2, 1]]


REFUSED = {
    "unknown piece": (edits.MoveVertex("frnt", 0, (0, 0)), "panel", "no piece 'frnt'", "Did you mean 'front'?"),
    "piece like no other": (edits.RemovePiece("xyz"), "panel", "no piece 'xyz'", "Use one of front, back, left_sleeve"),
    "unknown vertex": (edits.MoveVertex("front", 9, (0, 0)), "vertex", "no vertex 9", "Use 0 to 8"),
    "unknown edge": (edits.Lengthen("front", 9, 0.1), "edge", "no edge 9", "Use 0 to 8"),
    "unknown handle": (edits.MoveHandle("front", 4, 2, (0, 0)), "handle", "no handle 2", "Use 0 to 1"),
    "not sewn": (edits.TakeIn("front", 0, 0.1), "edge", "edge 0 of 'front' is not sewn", "close a seam there"),
    "crossing": (edits.Lengthen("front", 0, -0.6), "panels.front.edges[3]", "crosses or touches", "less far"),
    "vertex on vertex": (edits.MoveVertex("front", 0, (0.528, 0)), "panels.front.edges[0]", "coincide", "less far"),
    "vertex across": (edits.MoveVertex("front", 2, (-0.7, 0)), "panels.front.edges[8]", "crosses", "less far"),
    "handle far away": (edits.MoveHandle("front", 3, 0, (0, -2.0)), "panels.front.edges[", "crosses", "less far"),
    "turned over": (edits.Lengthen("front", 0, -0.64), "panels.front", "'front' is turned over", "less far"),
    "sleeve turned over": (
        edits.Lengthen("left_sleeve_front", 2, -0.22),
        "panels.left_sleeve_front",
        "'left_sleeve_front' is turned over",
        "less far",
    ),
    "past the other side": (edits.Lengthen("front", 1, -0.6), "panels.front", "crosses", "less far"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_refused_edit_names_place_and_remedy_and_changes_nothing(tshirt, name):
    edit, place, words, remedy = REFUSED[name]
    before = deepcopy(tshirt)
    with pytest.raises(EditError) as caught:
        apply(tshirt, edit)
    assert caught.value.place.startswith(place)
    assert words in caught.value.message
    assert remedy in caught.value.remedy
    assert tshirt == before


def test_what_is_no_pattern_is_the_parsers_to_refuse(tshirt):
    tshirt["pattern"]["panels"]["front"]["vertices"][0] = [0, "0"]
    with pytest.raises(PatternError):
        apply(tshirt, edits.Ease("front", 1))


def test_a_pattern_without_stitches_or_order_can_be_edited():
    spec = sewn({"a": rectangle(40, 40)})
    del spec["pattern"]["stitches"]
    made = apply(spec, edits.Lengthen("a", 0, 0.1)).specification
    assert made["pattern"]["panels"]["a"]["vertices"][:2] == [[0.0, -10.0], [40.0, -10.0]]
    assert "panel_order" not in made["pattern"]


def test_the_stated_order_of_pieces_is_kept(tshirt):
    order = tshirt["pattern"]["panel_order"][::-1]
    tshirt["pattern"]["panel_order"] = order
    assert apply(tshirt, edits.Lengthen("front", 0, 0.1)).specification["pattern"]["panel_order"] == order
    made = apply(tshirt, edits.Cut("front", ((-1.0, 0.2), (1.0, 0.2)))).specification
    assert made["pattern"]["panel_order"] == [*order, "front_2"]
