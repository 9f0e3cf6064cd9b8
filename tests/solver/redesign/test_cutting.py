"""Claims on cuts: nothing of the fabric is lost, both parts end at the line, and seams are divided on both sides."""

import numpy as np
import pytest
from pattern_measures import area, edge_points, length, outline, placed, rectangle, seams, sewn, two_squares, vertices

from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.weld import weld
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import Cut

LEVEL = ((-1.0, 0.2), (1.0, 0.2))
UPRIGHT = ((0.0, -1.0), (0.0, 1.0))


def cut_edges(spec, parts, line):
    """(panel, edge) of the straight edges that lie on the line."""
    a, b = (complex(*point) for point in line)
    found = []
    for panel in parts:
        for edge in range(len(spec["pattern"]["panels"][panel]["edges"])):
            if np.abs(np.imag((edge_points(spec, panel, edge, 9) - a) * np.conj(b - a))).max() < 1e-9:
                found.append((panel, edge))
    return found


@pytest.mark.parametrize("is_sewn", [False, True])
@pytest.mark.parametrize(
    ("name", "panel", "line"),
    [
        ("tshirt", "front", LEVEL),
        ("tshirt", "front", UPRIGHT),
        ("tshirt", "back", ((-1.0, 0.1), (1.0, 0.3))),
        ("tshirt", "left_sleeve_front", ((0.15, -1.0), (0.15, 1.0))),
        ("dress", "front", ((-1.0, 0.25), (1.0, 0.25))),
        ("dress", "skirt_front", UPRIGHT),
        ("dress", "skirt_front", ((-0.1, 1.0), (0.3, -1.0))),
        ("skirt", "skirt_back", ((-1.0, -0.2), (1.0, -0.2))),
    ],
)
def test_a_cut_piece_is_two_that_end_at_the_line(name, panel, line, is_sewn, request):
    spec = request.getfixturevalue(name)
    made = apply(spec, Cut(panel, line, is_sewn))
    result = made.specification
    parts = (panel, f"{panel}_2")
    assert set(result["pattern"]["panels"]) == {*spec["pattern"]["panels"], parts[1]}
    assert sum(area(result, part) for part in parts) == pytest.approx(area(spec, panel), abs=1e-8)
    assert area(result, parts[0]) > area(result, parts[1]) - 1e-9
    assert area(result, parts[1]) > 0.003
    a, b = (complex(*point) for point in line)
    sides = [np.imag((outline(result, part) - a) * np.conj(b - a)) for part in parts]
    assert (sides[0].min() > -1e-9) != (sides[0].max() < 1e-9), "on one side of it"
    assert (sides[1].min() > -1e-9) == (sides[0].max() < 1e-9), "on the other"
    on_line = cut_edges(result, parts, line)
    assert [part for part, _ in on_line] == list(parts)
    assert length(result, *on_line[0]) == pytest.approx(length(result, *on_line[1]))
    assert (set(on_line) in [set(seam) for seam in seams(result)]) == is_sewn
    assert made.change == "topology"
    assert mesh_pattern(parse_pattern(result), 0.03).faces.shape[0] > 100


def test_what_is_drawn_at_a_place_stays_there(tshirt):
    made = apply(tshirt, Cut("front", LEVEL)).specification
    for part in ("front", "front_2"):
        for point in outline(made, part, 5):
            on_line = abs(point.imag - 0.2) < 1e-9
            assert on_line or np.abs(outline(tshirt, "front") - point).min() < 1e-4


def test_the_other_side_of_a_seam_is_divided_at_the_same_share(tshirt):
    made = apply(tshirt, Cut("front", ((-1.0, 0.1), (1.0, 0.1)))).specification
    # The side seams are straight and 38 cm high, so a cut at 10 cm is at 10/38 of them, counted from the hem.
    side = length(tshirt, "front", 1)
    pairs = [pair for pair in seams(made) if {side[0] for side in pair} & {"front_2"}]
    assert len(seams(made)) == len(seams(tshirt)) + 2
    assert [length(made, *one) for pair in pairs for one in pair] == pytest.approx([side * 10 / 38] * 4, abs=1e-6)
    assert [sorted(panel for panel, _ in pair) for pair in pairs] == [["back", "front_2"]] * 2
    above = [pair for pair in seams(made) if {panel for panel, _ in pair} == {"front", "back"}]
    lengths = [length(made, *one) for pair in above for one in pair]
    assert sorted(lengths)[-4:] == pytest.approx([side * 28 / 38] * 4, abs=1e-6)


def test_a_cut_sewn_again_is_the_garment_with_one_seam_more(tshirt):
    made = apply(tshirt, Cut("front", LEVEL, sewn=True)).specification
    loops = [len(boundary_loops(weld(mesh_pattern(parse_pattern(s), 0.03)).vertex_of_corner)) for s in (tshirt, made)]
    assert loops == [4, 4]


def test_the_sides_of_an_open_cut_do_not_touch(tshirt):
    made = apply(tshirt, Cut("front", UPRIGHT)).specification
    one, other = (
        placed(made, panel, edge_points(made, panel, edge, 2))
        for panel, edge in cut_edges(made, ("front", "front_2"), UPRIGHT)
    )
    assert np.linalg.norm(one - other[::-1], axis=1) == pytest.approx([0.02, 0.02])
    # The parts were moved apart, not into each other.
    both = np.vstack([placed(made, part, outline(made, part, 9)) for part in ("front", "front_2")])
    whole = placed(tshirt, "front", outline(tshirt, "front", 9))
    assert np.ptp(both[:, 0]) == pytest.approx(np.ptp(whole[:, 0]) + 0.02)


def test_a_cut_near_a_vertex_goes_through_it(tshirt):
    made = apply(tshirt, Cut("front", ((0.001, -1.0), (0.001, 1.0)), sewn=True)).specification
    # The line passes the lowest point of the neck by a millimetre, and crosses the hem where no vertex is.
    assert sum(len(vertices(made, part)) for part in ("front", "front_2")) == 9 + 1 + 2
    assert all(np.abs(vertices(made, part) - 0.545j).min() < 1e-12 for part in ("front", "front_2"))


def test_a_cut_across_a_seam_of_the_piece_with_itself_divides_both_sides():
    spec = sewn({"sleeve": rectangle(40, 40)}, ("sleeve", 1, "sleeve", 3))
    made = apply(spec, Cut("sleeve", ((-1.0, 0.1), (1.0, 0.1)))).specification
    # Both sides of the seam are crossed at the same height: each part closes onto itself.
    assert sorted(tuple(sorted(side[0] for side in pair)) for pair in seams(made)) == [
        ("sleeve", "sleeve"),
        ("sleeve_2", "sleeve_2"),
    ]
    assert {round(length(made, *one), 9) for one, _ in seams(made)} == {0.1, 0.3}
    assert [round(length(made, *one) - length(made, *other), 9) for one, other in seams(made)] == [0, 0]


def test_a_slanted_cut_across_a_seam_of_the_piece_with_itself_divides_it_twice():
    spec = sewn({"sleeve": rectangle(40, 40)}, ("sleeve", 1, "sleeve", 3))
    made = apply(spec, Cut("sleeve", ((-0.4, 0.0), (0.8, 0.3)))).specification
    # It crosses the left side at 10 cm and the right one at 20: three seams of 10, 10 and 20 cm.
    assert sorted(round(length(made, *one), 9) for one, _ in seams(made)) == [0.1, 0.1, 0.2]
    for one, other in seams(made):
        assert length(made, *one) == pytest.approx(length(made, *other), abs=1e-9)


def test_a_cut_that_crosses_one_curved_edge_twice_takes_a_slice_off(skirt):
    # The hem hangs below its ends: a level line under these crosses it twice.
    made = apply(skirt, Cut("skirt_front", ((-1.0, -0.45), (1.0, -0.45)), sewn=True)).specification
    depth = -0.45 - outline(skirt, "skirt_front").imag.min()
    radius = 0.9429
    slice_area = radius**2 * np.arccos(1 - depth / radius) - (radius - depth) * np.sqrt(2 * radius * depth - depth**2)
    assert area(made, "skirt_front_2") == pytest.approx(slice_area, abs=1e-8)


def test_an_open_cut_takes_away_what_is_sewn_to_nothing(skirt):
    sewn_on = apply(skirt, Cut("skirt_front", ((-1.0, -0.45), (1.0, -0.45)), sewn=True)).specification
    made = apply(skirt, Cut("skirt_front", ((-1.0, -0.45), (1.0, -0.45))))
    assert list(made.specification["pattern"]["panels"]) == ["skirt_front", "skirt_back"]
    assert area(made.specification, "skirt_front") == pytest.approx(area(sewn_on, "skirt_front"))
    assert made.notes == ("'skirt_front' is cut: the other part is sewn to nothing and is taken away",)


def test_an_open_cut_that_lets_the_garment_fall_is_refused(skirt):
    with pytest.raises(EditError, match="it would fall off") as caught:
        apply(skirt, Cut("skirt_front", UPRIGHT))
    assert "have the parts sewn together" in caught.value.remedy


def test_names_of_parts_are_new(tube):
    first = apply(tube, Cut("front", ((0.2, -1.0), (0.2, 1.0)), sewn=True)).specification
    second = apply(first, Cut("front", ((-1.0, 0.1), (1.0, 0.1)), sewn=True)).specification
    assert list(second["pattern"]["panels"]) == ["front", "front_3", "front_2", "back"]


def hooked():
    """A U: a level line through both arms crosses its outline four times."""
    panel = {
        "vertices": [[0, 0], [30, 0], [30, 30], [20, 30], [20, 10], [10, 10], [10, 30], [0, 30]],
        "edges": [{"endpoints": [i, (i + 1) % 8]} for i in range(8)],
    }
    return sewn({"front": panel})


REFUSED = {
    "beside the piece": (two_squares, ((-1.0, 0.9), (1.0, 0.9)), "does not cross"),
    "ends inside": (two_squares, ((-1.0, 0.2), (0.2, 0.2)), "crosses only once"),
    "inside alone": (two_squares, ((0.1, 0.2), (0.3, 0.2)), "does not cross"),
    "through both arms": (hooked, ((-1.0, 0.2), (1.0, 0.2)), "crosses 4 times"),
    "from arm to arm": (hooked, ((0.05, 0.2), (0.25, 0.2)), "runs outside"),
    "along an edge": (two_squares, ((-1.0, 0.0), (1.0, 0.0)), "runs along edge 0 of 'front'"),
    "along a part of an edge": (two_squares, ((0.1, 0.0), (0.3, 0.0)), "runs along edge 0 of 'front'"),
    "along an edge and through": (hooked, ((-1.0, 0.1), (1.0, 0.1)), "runs along edge 4 of 'front'"),
    "a point": (two_squares, ((0.1, 0.2), (0.1, 0.2)), "two points of the line are one"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_line_that_does_not_cut_in_two_is_refused(name):
    make, line, words = REFUSED[name]
    with pytest.raises(EditError, match=words) as caught:
        apply(make(), Cut("front", line))
    assert caught.value.place == "line"
    several = words.startswith(("crosses ", "runs along ")) and "once" not in words
    remedy = "enters the piece once and leaves it once" if several else "outside of the piece across it"
    assert remedy in caught.value.remedy


@pytest.mark.parametrize("height", [-0.001, 0.001])
def test_a_line_that_cuts_off_less_than_a_cutter_can_is_refused(tube, height):
    with pytest.raises(EditError):
        apply(tube, Cut("front", ((-1.0, height), (1.0, height)), sewn=True))


def test_an_arc_of_more_than_half_a_circle_is_divided_into_arcs():
    panel = rectangle(40, 40)
    panel["edges"][0]["curvature"] = {"type": "circle", "params": [22, 1, 1]}
    spec = sewn({"a": panel})
    # The arc's centre is 9.2 cm below its ends: 5 cm below them the line leaves more than half a circle under it.
    made = apply(spec, Cut("a", ((-1.0, -0.05), (1.0, -0.05)), sewn=True)).specification
    parts = ("a", "a_2")
    assert sum(area(made, part) for part in parts) == pytest.approx(area(spec, "a"), abs=1e-8)
    edges = [edge for part in parts for edge in made["pattern"]["panels"][part]["edges"] if "curvature" in edge]
    arcs = sorted(edge["curvature"]["params"][1:] for edge in edges)
    assert arcs == [[0, 1], [0, 1], [1, 1]]


def test_the_ease_of_a_seam_is_divided_with_it():
    panels = {"long": rectangle(40, 40), "short": rectangle(40, 36)}
    spec = sewn(panels, ("long", 1, "short", 3), ("short", 1, "long", 3))
    for panel in panels:
        made = apply(spec, Cut(panel, ((-1.0, 0.09), (1.0, 0.09)), sewn=True))
        assert not any("cm long" in note for note in made.notes), "what was eased in is no news"
        sides = [pair for pair in seams(made.specification) if pair[0][0].split("_")[0] != pair[1][0].split("_")[0]]
        ratios = sorted(length(made.specification, *one) / length(made.specification, *other) for one, other in sides)
        assert ratios == pytest.approx([0.9, 0.9, 1 / 0.9, 1 / 0.9])
        firsts = [one.split("_")[0] for (one, _), _ in sides]
        assert sorted(firsts) == ["long", "long", "short", "short"], "what was the first side stays it"


def test_an_arm_alone_can_be_cut():
    made = apply(hooked(), Cut("front", ((-0.1, 0.2), (0.15, 0.2)))).specification
    assert area(made, "front_2") == pytest.approx(0.01)
