"""What a pattern's edges carry is read, refused where it is wrong, and goes along with the edges through edits."""

import json

import numpy as np
import pytest
from pattern_measures import demo

from tryon_solver.geometry.named_lines import Cut
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import PatternError, parse_pattern
from tryon_solver.geometry.weld import weld
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.plain import parse_edit
from tryon_solver.worn_effects import effects_of

WAISTBAND = {"ratio": 0.9, "stiffness": 30.0}


@pytest.fixture
def skirt():
    """The demo's, its edges as plain JSON: hem, side, waist, side of either piece."""
    return demo("skirt")


def edges(spec, name="skirt_front"):
    return spec["pattern"]["panels"][name]["edges"]


def refused(spec):
    with pytest.raises(PatternError) as told:
        parse_pattern(spec)
    assert told.value.remedy
    return told.value.place


def test_the_demos_waistband_is_elastic_along_the_waist(skirt):
    found = parse_pattern(skirt).effects
    (line,) = found["elastic"]["lines"]
    assert line == {"along": [{"panel": name, "edge": 2} for name in ("skirt_front", "skirt_back")], **WAISTBAND}
    assert set(found) == {"elastic"}


@pytest.mark.parametrize("name", ["tshirt", "dress"])
def test_a_pattern_that_carries_nothing_calls_for_nothing(name):
    assert parse_pattern(demo(name)).effects == {}


def test_edges_that_carry_the_same_are_one_line(skirt):
    edges(skirt)[0]["elastic"] = dict(WAISTBAND)
    edges(skirt, "skirt_back")[0]["elastic"] = {**WAISTBAND, "ratio": 0.7}
    lines = parse_pattern(skirt).effects["elastic"]["lines"]
    assert [len(line["along"]) for line in lines] == [3, 1]


def test_creases_and_fasteners_are_read_with_what_is_usual(skirt):
    edges(skirt)[1]["crease"] = {}
    edges(skirt)[0]["fastened"] = {"as": "hem", "buttons": 3}
    edges(skirt, "skirt_back")[0]["fastened"] = {"as": "hem", "buttons": 3}
    found = parse_pattern(skirt).effects
    assert found["creases"]["lines"] == [{"along": [{"panel": "skirt_front", "edge": 1}], "angle": 60.0}]
    (row,) = found["fasteners"]["rows"]
    assert row["first"] == [{"panel": "skirt_front", "edge": 0}]
    assert row["second"] == [{"panel": "skirt_back", "edge": 0}]
    assert (row["buttons"], row["closed"]) == (3, 1.0)


@pytest.mark.parametrize(
    ("effect", "place"),
    [
        ({"elastic": {"ratio": 7}}, ".elastic.ratio"),
        ({"elastic": {"length": 0.3}}, ".elastic.length"),
        ({"elastic": 0.9}, ".elastic"),
        ({"crease": {"angle": 179}}, ".crease.angle"),
        ({"crease": {}}, ".crease"),  # its hem: nothing is sewn to it
        ({"fastened": {"buttons": 3}}, ".fastened.as"),
        ({"fastened": {"as": "fly"}}, ".fastened"),
    ],
)
def test_a_fault_names_its_place(skirt, effect, place):
    edges(skirt)[0] |= effect
    assert refused(skirt) == f"panels.skirt_front.edges[0]{place}"


@pytest.mark.parametrize(
    ("word", "field", "here", "there"),
    [("crease", "angle", {"angle": 70}, {"angle": -70}), ("elastic", "ratio", {"ratio": 0.7}, {"ratio": 0.9})],
)
def test_the_sides_of_a_seam_say_the_same_of_it_or_are_refused(skirt, word, field, here, there):
    edges(skirt)[1][word] = dict(here)
    edges(skirt, "skirt_back")[3][word] = dict(here)
    lines = parse_pattern(skirt).effects[{"crease": "creases"}.get(word, word)]["lines"]
    seam = [{"panel": "skirt_front", "edge": 1}, {"panel": "skirt_back", "edge": 3}]
    assert seam in [line["along"] for line in lines]
    edges(skirt, "skirt_back")[3][word] = dict(there)
    with pytest.raises(PatternError) as told:
        parse_pattern(skirt)
    both = {f"panels.{name}.edges[{k}].{word}" for name, k in (("skirt_front", 1), ("skirt_back", 3))}
    assert told.value.place.removesuffix(f".{field}") in both
    assert (both - {told.value.place.removesuffix(f".{field}")}).pop() in told.value.message


def test_a_line_around_the_end_of_the_list_of_edges_is_one_side(skirt):
    for number in (3, 0):
        edges(skirt)[number]["fastened"] = {"as": "wrap"}
    edges(skirt, "skirt_back")[0]["fastened"] = {"as": "wrap"}
    (row,) = parse_pattern(skirt).effects["fasteners"]["rows"]
    assert row["first"] == [{"panel": "skirt_front", "edge": number} for number in (3, 0)]


@pytest.mark.parametrize(
    "edit",
    [
        {"kind": "scale_garment", "factors": [1.1, 1.0]},
        {"kind": "lengthen", "panel": "skirt_front", "edge": 0, "by": 0.05},
        {"kind": "dart", "panel": "skirt_front", "edge": 2, "position": 0.4, "width": 0.02, "depth": 0.1},
        {"kind": "cut", "panel": "skirt_front", "line": [[0.05, -1.0], [0.05, 1.0]], "sewn": True},
    ],
)
def test_elastic_goes_along_with_its_edges(skirt, edit):
    """After each edit it runs around the whole waist, and nowhere else; a dart takes its mouth out of it."""
    after = apply(skirt, parse_edit(edit)).specification
    pattern = parse_pattern(json.loads(json.dumps(after)))
    panels = mesh_pattern(pattern, 0.03)
    welded = weld(panels)
    counts = tuple(len(panel.edges) for panel in pattern.panels)
    cut = Cut.of_pattern(welded.garment(), panels, welded, counts)
    (spec,) = effects_of(pattern.effects, cut)
    (line,) = spec.lines
    height = welded.mean_of_vertices(panels.placed)[:, 1]
    assert height[line.edges].min() > np.quantile(height, 0.85), "the waist is at the top"
    corners = cut.garment.uv_corners
    found = sum(_length(cut.garment.faces, corners, edge) for edge in line.edges)
    named = pattern.effects["elastic"]["lines"][0]["along"]
    panel_of = {panel.name: panel for panel in pattern.panels}
    drawn = sum(panel_of[entry["panel"]].edges[entry["edge"]].length for entry in named)
    assert found == pytest.approx(drawn, rel=0.01)
    assert drawn == pytest.approx(0.773 * edit.get("factors", [1.0])[0] - edit.get("width", 0.0), rel=0.02)


def _length(faces, corners, edge):
    """m, of an edge of the mesh in the pattern."""
    at = np.argwhere((np.isin(faces, edge)).sum(1) == 2)[0, 0]
    a, b = (corners[at][faces[at] == vertex][0] for vertex in edge)
    return np.linalg.norm(a - b)
