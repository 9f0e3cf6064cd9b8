"""Claims on edits as JSON: each comes back as itself, and what is none is refused by the field that is at fault."""

import json

import pytest
from tshirt_edits import EDITS

from tryon_solver.redesign import edits
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.plain import parse_edit, plain

FLAGGED = edits.CloseSeam("front", 1, "back", 8, True, False)


def test_the_list_has_every_kind():
    assert [type(edit) for edit in EDITS] == list(edits.KINDS.values())


@pytest.mark.parametrize("edit", [*EDITS, FLAGGED], ids=lambda edit: edit.kind)
def test_an_edit_comes_back_from_json_as_itself(edit):
    written = json.dumps(plain(edit), allow_nan=False)
    assert json.loads(written)["kind"] == edit.kind
    assert parse_edit(json.loads(written)) == edit


def test_what_has_a_default_may_be_left_out():
    given = {"kind": "close_seam", "panel": "a", "edge": 0, "to_panel": "b", "to_edge": 1}
    assert parse_edit(given) == edits.CloseSeam("a", 0, "b", 1, gather=False, right_wrong=False)


MOVE = {"kind": "move_vertex", "panel": "front", "vertex": 2, "by": [0.01, 0.02]}
DART = {"kind": "dart", "panel": "front", "edge": 0, "position": 0.5, "width": 0.03, "depth": 0.1}
FAULTS = {
    "no object": ([1], "edit", "not an edit", "kind"),
    "no kind": ({"panel": "front"}, "kind", "not stated", "move_vertex"),
    "kind not text": ({"kind": 3}, "kind", "not stated", "move_vertex"),
    "unknown kind": ({"kind": "move_vertx"}, "kind", "'move_vertx'", "'move_vertex'"),
    "missing field": ({k: v for k, v in MOVE.items() if k != "by"}, "by", "needs the field 'by'", "Give it"),
    "unknown field": ({**MOVE, "vertx": 2}, "vertx", "no field 'vertx'", "'vertex'"),
    "NaN": ({**MOVE, "by": [0.0, float("nan")]}, "by[1]", "nan", "-2 to 2 m"),
    "infinite": ({**MOVE, "by": [float("-inf"), 0.0]}, "by[0]", "inf", "-2 to 2 m"),
    "number as text": ({**MOVE, "by": ["1", 0.0]}, "by[0]", "not a number", "-2 to 2 m"),
    "boolean as number": ({**MOVE, "by": [True, 0.0]}, "by[0]", "True is not a number", "-2 to 2 m"),
    "null": ({**MOVE, "by": None}, "by", "not a move", "list of two"),
    "three coordinates": ({**MOVE, "by": [0.0, 0.0, 0.0]}, "by", "not a move", "list of two"),
    "text of two": ({**MOVE, "by": "ab"}, "by", "not a move", "list of two"),
    "in centimetres": ({**MOVE, "by": [0.0, 5.0]}, "by[1]", "5.0 is outside", "-2 to 2 m"),
    "integer past floats": ({**MOVE, "by": [10**400, 0.0]}, "by[0]", "is outside", "-2 to 2 m"),
    "integer past words": ({**MOVE, "by": [10**5000, 0.0]}, "by[0]", "thousands of digits", "-2 to 2 m"),
    "index as float": ({**MOVE, "vertex": 2.0}, "vertex", "2.0 is not an index", "whole number"),
    "boolean as index": ({**MOVE, "vertex": True}, "vertex", "True is not an index", "whole number"),
    "negative index": ({**MOVE, "vertex": -1}, "vertex", "no such index", "from 0"),
    "panel not text": ({**MOVE, "panel": 3}, "panel", "not a name", "name of a piece"),
    "endless panel": ({**MOVE, "panel": "x" * 1000}, "panel", "not a name", "name of a piece"),
    "flag as number": (
        {"kind": "cut", "panel": "front", "line": [[0, 0], [1, 1]], "sewn": 1}, "sewn", "neither true", "true or false",
    ),
    "line of one point": ({"kind": "cut", "panel": "front", "line": [[0, 0]]}, "line", "not two points", "list of two"),
    "point of a line": ({"kind": "cut", "panel": "front", "line": [[0, 0], 1]}, "line[1]", "not coord", "list of two"),
    "share over 1": ({**DART, "position": 1.5}, "position", "outside 0 to 1", "0 to 1"),
    "no width": ({**DART, "width": 0}, "width", "outside 0.001 to 2 m", "0.001 to 2 m"),
    "negative depth": ({**DART, "depth": -0.1}, "depth", "outside 0.001 to 2 m", "0.001 to 2 m"),
    "factor of 3": ({"kind": "scale_garment", "factors": [1, 3]}, "factors[1]", "outside 0.5 to 2", "0.5 to 2"),
    "factor of 0": ({"kind": "scale_piece", "panel": "a", "factors": [0, 1]}, "factors[0]", "outside", "0.5 to 2"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_each_fault_is_refused_and_its_field_named(name):
    given, place, words, remedy = FAULTS[name]
    with pytest.raises(EditError) as caught:
        parse_edit(given)
    assert caught.value.place == place
    assert words in caught.value.message
    assert remedy in caught.value.remedy


def test_an_edit_made_in_python_passes_the_same_checks():
    with pytest.raises(EditError, match="True is not a number"):
        edits.Lengthen("front", 0, True)
    assert edits.MoveVertex("front", 0, [0, 1]).by == (0.0, 1.0)
