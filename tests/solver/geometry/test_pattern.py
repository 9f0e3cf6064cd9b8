"""Claims on reading patterns: metres, orientation, placement; each fault is refused by a message naming its place."""

import gzip
import json
import math

import numpy as np
import pytest

from tryon_solver.geometry.curves import is_straight
from tryon_solver.geometry.pattern import (
    NotJsonError,
    PatternError,
    load_pattern,
    parse_pattern,
    parse_pattern_bytes,
)


def test_lengths_are_converted_to_metres(two_squares):
    pattern = parse_pattern(two_squares)
    assert pattern.panel_names == ("left", "right")
    assert [edge.length for edge in pattern.panels[0].edges] == pytest.approx([0.4] * 4)
    assert pattern.panels[1].translation == pytest.approx([0.5, 0, 0])


def test_orientation_of_the_loop_is_the_side_of_the_fabric(two_squares):
    right = two_squares["pattern"]["panels"]["right"]
    right["vertices"] = [[0, 0], [0, 40], [40, 40], [40, 0]]
    pattern = parse_pattern(two_squares)
    assert [panel.clockwise for panel in pattern.panels] == [False, True]


def test_rotation_turns_about_x_then_y_then_z(two_squares):
    two_squares["pattern"]["panels"]["left"]["rotation"] = [90, 0, 90]
    # y goes to z about x and stays there about z; x goes to y about z.
    rotation = parse_pattern(two_squares).panels[0].rotation
    assert np.allclose(rotation @ [0, 1, 0], [0, 0, 1], atol=1e-15)
    assert np.allclose(rotation @ [1, 0, 0], [0, 1, 0], atol=1e-15)


def test_a_stitch_is_reversed_unless_it_says_right_wrong(two_squares):
    assert parse_pattern(two_squares).stitches[0].reversed
    two_squares["pattern"]["stitches"][0].append("right_wrong")
    assert not parse_pattern(two_squares).stitches[0].reversed


def test_a_declared_gather_may_be_long(two_squares):
    two_squares["pattern"]["panels"]["right"]["vertices"] = corners(40, 100)
    two_squares["pattern"]["stitches"][0].append("gather")
    assert parse_pattern(two_squares).stitches[0].gather


def test_panels_follow_the_stated_order(two_squares):
    two_squares["pattern"]["panel_order"] = ["right", "left"]
    pattern = parse_pattern(two_squares)
    assert pattern.panel_names == ("right", "left")
    assert pattern.stitches[0].first.panel == 1


def test_real_patterns_are_read(pattern_path):
    pattern = load_pattern(pattern_path)
    spec = json.loads(pattern_path.read_text())["pattern"]
    assert sorted(pattern.panel_names) == sorted(spec["panels"])
    assert len(pattern.stitches) == len(spec["stitches"])
    assert 0.1 < max(edge.length for panel in pattern.panels for edge in panel.edges) < 4.0


def corners(width, height):
    return [[0, 0], [width, 0], [width, height], [0, height]]


def curved(kind, params):
    def change(spec):
        spec["pattern"]["panels"]["left"]["edges"][0]["curvature"] = {"type": kind, "params": params}

    return change


def put(*path_and_value):
    *path, key, value = path_and_value

    def change(spec):
        target = spec["pattern"]
        for step in path:
            target = target[step]
        target[key] = value

    return change


def side(panel, edge):
    return {"panel": panel, "edge": edge}


FAULTS = {
    "no panels": (put("panels", {}), "panels", "no panels"),
    "panel without corners": (put("panels", "left", "vertices", []), "panels.left.vertices", "corner points"),
    "not a number": (put("panels", "left", "vertices", 2, ["40", 40]), "panels.left.vertices[2][0]", "not a number"),
    "NaN": (put("panels", "left", "vertices", 2, [math.nan, 40]), "panels.left.vertices[2][0]", "nan"),
    "infinity": (put("panels", "left", "translation", [0, math.inf, 0]), "panels.left.translation[1]", "inf"),
    "integer past floats": (put("panels", "left", "rotation", [10**400, 0, 0]), "panels.left.rotation[0]", "inf"),
    "placed far away": (put("panels", "left", "translation", [0, 2000, 0]), "panels.left.translation", "20 m"),
    "edge to a missing vertex": (
        put("panels", "left", "edges", 1, {"endpoints": [1, 7]}),
        "panels.left.edges[1].endpoints",
        "no vertex 7",
    ),
    "open loop": (
        put("panels", "left", "edges", [{"endpoints": [0, 1]}, {"endpoints": [1, 2]}, {"endpoints": [2, 3]}]),
        "panels.left.edges[2].endpoints",
        "do not close a loop",
    ),
    "detached vertex": (
        put("panels", "left", "vertices", [[0, 0], [40, 0], [40, 40], [0, 40], [20, 20]]),
        "panels.left.edges",
        "every vertex",
    ),
    "coinciding end points": (
        put("panels", "left", "vertices", [[0, 0], [40, 0], [40, 0], [0, 40]]),
        "panels.left.edges[1]",
        "coincide",
    ),
    "no area": (put("panels", "left", "vertices", [[0, 0], [20, 0], [40, 0], [20, 1e-6]]), "panels.left", "no area"),
    "crossing outline": (
        put("panels", "left", "vertices", [[0, 0], [40, 0], [0, 30], [30, 40]]),
        "panels.left.edges[3]",
        "edges 1 and 3",
    ),
    "curve across the opposite edge": (curved("quadratic", [[0.5, 2.5]]), "panels.left.edges[2]", "edges 0 and 2"),
    "unknown curve": (curved("spiral", [1]), "panels.left.edges[0].curvature.type", "'spiral'"),
    "too few control points": (
        curved("cubic", [[0.5, 0.1]]),
        "panels.left.edges[0].curvature.params",
        "2 control points",
    ),
    "absolute control points": (
        curved("quadratic", [[20, 40]]),
        "panels.left.edges[0].curvature.params",
        "40 edge lengths",
    ),
    "arc too small": (curved("circle", [19, 0, 1]), "panels.left.edges[0].curvature.params[0]", "0.4 m apart"),
    "arc with a negative radius": (curved("circle", [-30, 0, 1]), "panels.left.edges[0].curvature.params[0]", "-0.3 m"),
    "larger arc of a huge circle": (
        curved("circle", [1e300, 1, 1]),
        "panels.left.edges[0].curvature.params[0]",
        "does not fit",
    ),
    "turned without end": (put("panels", "left", "rotation", [0, 1e308, 0]), "panels.left.rotation", "degrees"),
    "bow tie": (
        put("panels", "left", "vertices", [[0, 0], [40, 40], [40, 0], [0, 40]]),
        "panels.left.edges[2]",
        "edges 0 and 2",
    ),
    "bow tie of no area in all": (
        put("panels", "left", "vertices", [[0, 0], [40, 0], [0, 40], [40, 40]]),
        "panels.left.edges[3]",
        "edges 1 and 3",
    ),
    "line there and back": (
        put("panels", "left", "vertices", [[0, 0], [10, 0], [40, 0], [20, 0]]),
        "panels.left",
        "no area",
    ),
    "arc flag": (curved("circle", [30, 2, 1]), "panels.left.edges[0].curvature.params", "circular arc"),
    "piece too large": (put("panels", "left", "vertices", corners(4000, 400)), "panels.left", "40 m across"),
    "piece too small": (put("panels", "left", "vertices", corners(0.4, 0.4)), "panels.left", "0.004 m across"),
    "label not text": (put("panels", "left", "label", 3), "panels.left.label", "text"),
    "panel order": (put("panel_order", ["left"]), "panel_order", "every panel"),
    "stitch of one side": (put("stitches", 0, [side("left", 1)]), "stitches[0]", "two edges"),
    "unknown panel": (put("stitches", 0, 1, side("rihgt", 3)), "stitches[0][1].panel", "'rihgt'"),
    "missing edge": (put("stitches", 0, 1, side("right", 4)), "stitches[0][1].edge", "no edge 4"),
    "negative edge": (put("stitches", 0, 0, side("left", -1)), "stitches[0][0].edge", "no edge -1"),
    "edge sewn twice": (
        put("stitches", [[side("left", 1), side("right", 3)], [side("left", 0), side("right", 3)]]),
        "stitches[1][1]",
        "sewn twice, first by stitches",
    ),
    "edge sewn to itself": (put("stitches", [[side("left", 1), side("left", 1)]]), "stitches[0][1]", "sewn twice"),
    "unknown word": (put("stitches", 0, [side("left", 1), side("right", 3), "wrong"]), "stitches[0][2]", "'wrong'"),
    "very different lengths": (
        put("panels", "right", "vertices", corners(40, 65)),
        "stitches[0]",
        "40.0 cm long and",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_each_fault_is_refused_and_its_place_named(two_squares, name):
    change, place, words = FAULTS[name]
    change(two_squares)
    with pytest.raises(PatternError, match=words) as caught:
        parse_pattern(two_squares)
    assert caught.value.place == place
    assert caught.value.remedy
    assert str(caught.value).startswith(place)


@pytest.mark.parametrize("spec", [None, [], 3, {}, {"pattern": []}, {"panels": {}}])
def test_other_json_is_not_a_pattern(spec):
    with pytest.raises(PatternError, match="not a sewing pattern") as caught:
        parse_pattern(spec)
    assert caught.value.place == "specification"


def test_a_garment_of_hand_size_is_drawn_in_another_unit(rectangle, specification):
    with pytest.raises(PatternError, match=r"only 0\.008 m") as caught:
        parse_pattern(specification({"left": rectangle(0.6, 0.8)}))
    assert caught.value.place == "panels.left"
    assert "units_in_meter" in caught.value.remedy


def test_the_unit_is_never_guessed(two_squares):
    del two_squares["properties"]
    with pytest.raises(PatternError, match="unit of length is not stated") as caught:
        parse_pattern(two_squares)
    assert caught.value.place == "properties.units_in_meter"


@pytest.mark.parametrize("units", [0, -100, 5e-324, 1e308, math.nan, "cm", None])
def test_what_is_no_unit_is_refused(two_squares, units):
    two_squares["properties"]["units_in_meter"] = units
    with pytest.raises(PatternError) as caught:
        parse_pattern(two_squares)
    assert caught.value.place == "properties.units_in_meter"


NOT_JSON = {
    "broken": (b'{"pattern":\n {,}}', "line 2 column 3", "property name"),
    "empty": (b"", "line 1 column 1", "Expecting value"),
    "nested too deeply": (b"[" * 100_000, "specification", "nested"),
    "nested objects": (b'{"a":' * 100_000, "specification", "nested"),
    "digits without end": (b"[" + b"9" * 5000 + b"]", "specification", "digits"),
    "another encoding": ('{"pattern": {}}'.encode("utf-16"), "byte 0", "UTF-8"),
    "bytes": (b'{"a": "\xff\xfe"}', "byte 7", "UTF-8"),
    "compressed": (gzip.compress(b"{}"), "byte 1", "UTF-8"),
}


@pytest.mark.parametrize("name", NOT_JSON)
def test_what_is_not_json_is_refused_with_the_place(name):
    content, place, words = NOT_JSON[name]
    with pytest.raises(NotJsonError, match=words) as caught:
        parse_pattern_bytes(content)
    assert caught.value.place == place
    assert "not a JSON file" in caught.value.message
    assert caught.value.remedy


@pytest.mark.parametrize("text", ["NaN", "-Infinity", "1e999", "9" * 400])
def test_a_number_that_is_none_is_named_by_its_place(two_squares, text):
    """Python writes and reads NaN in JSON, so patterns come with it: the place says more than that it is no JSON."""
    two_squares["pattern"]["panels"]["left"]["vertices"][1][0] = "here"
    content = json.dumps(two_squares).replace('"here"', text).encode()
    with pytest.raises(PatternError, match=r"the number is (nan|-?inf)") as caught:
        parse_pattern_bytes(content)
    assert caught.value.place == "panels.left.vertices[1][0]"


def test_a_byte_order_mark_is_no_fault(two_squares):
    content = b"\xef\xbb\xbf" + json.dumps(two_squares).encode()
    assert parse_pattern_bytes(content).panel_names == ("left", "right")


def test_a_key_that_stands_twice_loses_no_panel_without_a_word(two_squares):
    content = json.dumps(two_squares).replace('"right": {"vertices"', '"left": {"vertices"').encode()
    with pytest.raises(PatternError, match="'left' stands twice") as caught:
        parse_pattern_bytes(content)
    assert caught.value.remedy


def many_edges(count, curved):
    corners = [[30 * math.cos(2 * math.pi * i / count), 30 * math.sin(2 * math.pi * i / count)] for i in range(count)]
    bend = {"curvature": {"type": "quadratic", "params": [[0.5, -0.01]]}} if curved else {}
    edges = [{"endpoints": [i, (i + 1) % count], **bend} for i in range(count)]
    return {"vertices": corners, "edges": edges}


def test_edges_are_counted_before_any_is_looked_at(specification):
    """A million of them in one panel, or many panels of as many as one may have."""
    one = specification({"front": {"vertices": [[0, 0]], "edges": [{}] * 1_000_000}})
    with pytest.raises(PatternError, match="1000000 edges") as caught:
        parse_pattern(one)
    assert caught.value.place == "panels"
    many = specification({f"p{i}": many_edges(400, False) for i in range(6)})
    with pytest.raises(PatternError, match="2400 edges in all") as caught:
        parse_pattern(many)
    assert caught.value.place == "panels"
    with pytest.raises(PatternError, match="401 edges") as caught:
        parse_pattern(specification({"front": many_edges(401, False)}))
    assert caught.value.place == "panels.front.edges"


def test_a_panel_of_as_many_curves_as_it_may_have_is_read(specification):
    (panel,) = parse_pattern(specification({"front": many_edges(400, True)})).panels
    assert len(panel.edges) == 400


def test_an_arc_of_an_enormous_circle_is_straight(two_squares):
    for radius, straight in ((1e3, False), (1e7, True), (1e300, True)):
        two_squares["pattern"]["panels"]["left"]["edges"][0]["curvature"] = {"type": "circle", "params": [radius, 0, 1]}
        edge = parse_pattern(two_squares).panels[0].edges[0]
        assert is_straight(edge.curve) == straight
        assert edge.length == pytest.approx(0.4, rel=1e-4)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(PatternError, match="cannot be read") as caught:
        load_pattern(tmp_path / "none.json")
    assert caught.value.place.endswith("none.json")
