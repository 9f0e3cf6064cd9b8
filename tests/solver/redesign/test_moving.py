"""Claims on moved vertices and edges: they are where they were moved, and what is sewn to them still fits."""

import numpy as np
import pytest
from pattern_measures import area, edge_points, length, rectangle, seam_ratios, sewn, two_squares, vertices

from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edits import Dart, Lengthen, MoveVertex, TakeIn


def away(point, line):
    """Distance of a complex point from the line through the two complex points, positive on its left."""
    along = (line[1] - line[0]) / abs(line[1] - line[0])
    return float(np.imag((point - line[0]) * np.conj(along)))


def test_a_vertex_goes_where_it_is_moved_and_the_others_of_its_piece_stay(tshirt):
    made = apply(tshirt, MoveVertex("front", 2, (0.02, -0.01)))
    moved = vertices(made.specification, "front") - vertices(tshirt, "front")
    assert moved[2] == pytest.approx(0.02 - 0.01j, abs=1e-12)
    assert np.abs(np.delete(moved, 2)).max() == 0
    assert made.change == "value"


def test_all_seams_at_a_moved_vertex_keep_the_ratio_of_their_lengths(tshirt):
    made = apply(tshirt, MoveVertex("front", 2, (0.02, -0.01)))
    assert seam_ratios(made.specification) == pytest.approx(seam_ratios(tshirt), abs=1e-6)
    assert abs(length(made.specification, "front", 2) - length(tshirt, "front", 2)) > 5e-3, "there was one to keep"
    assert any(note.startswith("'left_sleeve_front' follows") for note in made.notes)
    assert not any("right" in note for note in made.notes)


def test_a_partner_at_one_seam_moves_along_it_and_no_further_than_it_must(tshirt):
    made = apply(tshirt, MoveVertex("front", 1, (0.01, -0.03))).specification
    # The back's corner lies at the same hem; its side runs from there to vertex 8, which stays.
    old, new = vertices(tshirt, "back"), vertices(made, "back")
    direction = (old[0] - old[8]) / abs(old[0] - old[8])
    grown = length(made, "front", 1) - length(tshirt, "front", 1)
    assert grown > 0.02
    assert new[0] - old[0] == pytest.approx(grown * direction, abs=1e-7)
    assert np.array_equal(new[1:], old[1:])


def test_a_curve_keeps_its_shape_in_proportion_when_its_end_moves(tshirt, skirt):
    for spec, panel, vertex, edge in ((tshirt, "front", 5, 4), (skirt, "skirt_front", 1, 0)):
        made = apply(spec, MoveVertex(panel, vertex, (0.0, -0.03))).specification
        old, new = edge_points(spec, panel, edge), edge_points(made, panel, edge)
        shape = (old - old[0]) / (old[-1] - old[0])
        assert np.abs((new - new[0]) / (new[-1] - new[0]) - shape).max() < 1e-9
        assert abs(new[-1] - new[0]) != pytest.approx(abs(old[-1] - old[0]), abs=1e-4)


def test_what_can_not_follow_is_told_with_both_lengths():
    spec = apply(two_squares(), Dart("front", 0, 0.5, 0.04, 0.1)).specification
    (apex,) = (i for i, at in enumerate(vertices(spec, "front")) if abs(at - (0.2 + 0.1j)) < 1e-9)
    made = apply(spec, MoveVertex("front", apex, (0.03, 0.0)))
    legs = [abs(0.03 + 0.02 + 0.1j), abs(0.03 - 0.02 + 0.1j)]
    (note,) = made.notes
    assert all(f"{leg * 100:.1f} cm" in note for leg in legs), note
    assert "edge 1 of 'front'" in note
    assert "edge 2 of 'front'" in note


def test_a_straight_hem_moves_parallel_to_itself_and_the_sides_go_on(tshirt):
    made = apply(tshirt, Lengthen("front", 0, 0.05))
    spread = 0.264 + 0.05 * (0.264 - 0.2615) / 0.38  # the sides of the shirt spread downwards
    assert vertices(made.specification, "front")[:2] == pytest.approx([-spread - 0.05j, spread - 0.05j], abs=1e-9)
    assert area(made.specification, "front") - area(tshirt, "front") == pytest.approx((0.264 + spread) * 0.05, abs=1e-8)


def test_the_back_follows_a_lengthened_front(tshirt):
    made = apply(tshirt, Lengthen("front", 0, 0.05))
    assert area(made.specification, "back") - area(tshirt, "back") == pytest.approx(
        area(made.specification, "front") - area(tshirt, "front"), abs=1e-8
    )
    (note,) = made.notes
    assert "'back' follows" in note
    assert "vertices 0, 1 by up to 5.0 cm" in note


def test_a_hem_that_is_an_arc_becomes_a_concentric_one(skirt):
    made = apply(skirt, Lengthen("skirt_front", 0, 0.1)).specification
    radius = 0.9429
    turn = 2 * np.arcsin(0.39849 / radius)
    gained = turn / 2 * ((radius + 0.1) ** 2 - radius**2)
    assert area(made, "skirt_front") - area(skirt, "skirt_front") == pytest.approx(gained, rel=2e-3)
    hem = made["pattern"]["panels"]["skirt_front"]["edges"][0]
    assert hem["curvature"]["params"][0] == pytest.approx(104.29, rel=1e-3)
    assert seam_ratios(made) == pytest.approx(seam_ratios(skirt), abs=1e-6)


def test_shortening_undoes_lengthening(tshirt):
    longer = apply(tshirt, Lengthen("left_sleeve_front", 2, 0.1)).specification
    back = apply(longer, Lengthen("left_sleeve_front", 2, -0.1)).specification
    for panel in ("left_sleeve_front", "left_sleeve_back"):
        assert area(longer, panel) > area(tshirt, panel) + 0.015
        assert vertices(back, panel) == pytest.approx(vertices(tshirt, panel), abs=1e-6)


def test_outwards_is_outwards_on_a_piece_drawn_clockwise():
    spec = sewn({"a": rectangle(40, 40), "b": rectangle(40, 40)})
    spec["pattern"]["panels"]["b"]["vertices"] = [[0, 0], [-40, 0], [-40, 40], [0, 40]]
    for panel in "ab":
        assert area(apply(spec, Lengthen(panel, 1, 0.05)).specification, panel) == pytest.approx(0.45 * 0.4)


def test_beside_an_edge_that_runs_almost_along_it_an_end_moves_straight_out():
    # The edges beside the top are nearly level: going on along them, its ends would fly far apart.
    spec = sewn({"a": rectangle(40, 40)})
    spec["pattern"]["panels"]["a"]["vertices"] = [[0, 0], [40, 0], [24, 2], [16, 2]]
    made = apply(spec, Lengthen("a", 2, 0.01)).specification
    assert vertices(made, "a")[2:] == pytest.approx([0.24 + 0.03j, 0.16 + 0.03j], abs=1e-12)


@pytest.mark.parametrize("by", [0.015, -0.02])
def test_both_sides_of_a_seam_are_taken_in_by_the_distance(tshirt, by):
    made = apply(tshirt, TakeIn("front", 1, by)).specification
    # Both are drawn as they lie on the body: upwards along this side the piece is on the left.
    for panel, ends in (("front", [1, 2]), ("back", [0, 8])):
        old, new = vertices(tshirt, panel)[ends], vertices(made, panel)[ends]
        inwards = [away(point, old) for point in new]
        assert inwards == pytest.approx([by, by], abs=1e-9), panel
    assert seam_ratios(made) == pytest.approx(seam_ratios(tshirt), abs=1e-6)
    assert area(made, "left_sleeve_front") != pytest.approx(area(tshirt, "left_sleeve_front"), rel=1e-3), "it followed"


def test_a_seam_is_named_by_either_side(tshirt):
    assert apply(tshirt, TakeIn("front", 1, 0.01)) == apply(tshirt, TakeIn("back", 8, 0.01))


def test_a_dart_taken_in_opens_at_its_mouth_and_keeps_its_point():
    spec = apply(two_squares(), Dart("front", 0, 0.5, 0.04, 0.1)).specification
    made = apply(spec, TakeIn("front", 1, 0.005)).specification
    points = edge_points(made, "front", 1, 2)
    leg = np.array([0.18 + 0j, 0.2 + 0.1j])
    assert points[1] == pytest.approx(leg[1], abs=1e-12)
    assert abs(away(points[0], leg)) == pytest.approx(0.005, abs=1e-9)
    assert points[0].real < 0.18
    assert points[0].imag == pytest.approx(0, abs=1e-12)
    assert length(made, "front", 1) == pytest.approx(length(made, "front", 2), abs=1e-9)
    assert area(made, "front") < area(spec, "front")


def test_who_would_have_to_go_much_further_than_the_edit_does_not_follow():
    # One centimetre more on the short side of this gather were four on its long side.
    panels = {"short": rectangle(10, 10), "long": rectangle(40, 38)}
    spec = sewn(panels, ("short", 1, "long", 3, "gather"))
    made = apply(spec, MoveVertex("short", 2, (0.0, 0.01)))
    assert made.specification["pattern"]["panels"]["long"] == panels["long"]
    (note,) = made.notes
    assert "edge 1 of 'short' is now 11.0 cm long and edge 3 of 'long', sewn to it, 38.0 cm" in note
    nearer = apply(spec, MoveVertex("long", 3, (0.0, 0.01)))
    assert length(nearer.specification, "short", 1) == pytest.approx(0.1 * 39 / 38)
    assert nearer.notes == ("'short' follows so that its seams fit: vertex 2 by 0.3 cm",)
