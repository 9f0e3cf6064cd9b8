"""Claims on moved handles: the curve bends as it is drawn, and the curve sewn to it is bent until it fits."""

import re

import numpy as np
import pytest
from pattern_measures import area, edge_points, length, seam_ratios, vertices

from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edits import MoveHandle


def middle(spec, panel, edge):
    return edge_points(spec, panel, edge, 3)[1]


def test_a_handle_of_a_cubic_moves_the_middle_by_three_eighths(tshirt):
    made = apply(tshirt, MoveHandle("front", 4, 0, (0.01, -0.02)))
    moved = middle(made.specification, "front", 4) - middle(tshirt, "front", 4)
    assert moved == pytest.approx(3 / 8 * (0.01 - 0.02j), abs=1e-9)
    assert np.array_equal(vertices(made.specification, "front"), vertices(tshirt, "front"))
    assert (made.change, made.notes) == ("value", ())


def test_a_handle_of_a_quadratic_moves_the_middle_by_half(tube):
    tube["pattern"]["panels"]["front"]["edges"][0]["curvature"] = [0.5, 0.1]
    made = apply(tube, MoveHandle("front", 0, 0, (0.02, 0.01))).specification
    assert middle(made, "front", 0) - middle(tube, "front", 0) == pytest.approx(0.01 + 0.005j, abs=1e-12)


def test_a_straight_edge_becomes_a_curve(tshirt):
    made = apply(tshirt, MoveHandle("front", 0, 1, (0.0, -0.04))).specification
    # The bump of one handle of a cubic, 3 t^2 (1 - t), has the area 1/4 under it.
    assert area(made, "front") - area(tshirt, "front") == pytest.approx(0.528 * 0.04 / 4, abs=1e-8)


@pytest.mark.parametrize("rise", [-0.4, -0.03, 0.05, 0.2])
def test_an_arc_stays_an_arc_through_its_moved_middle(skirt, rise):
    made = apply(skirt, MoveHandle("skirt_front", 0, 0, (0.01, rise))).specification
    points = edge_points(made, "skirt_front", 0)
    assert middle(made, "skirt_front", 0) - middle(skirt, "skirt_front", 0) == pytest.approx(1j * rise, abs=1e-6)
    ends = points[[0, len(points) // 2, -1]]
    # Through three points goes one circle: its centre is as far from all points.
    w = (ends[2] - ends[0]) / (ends[1] - ends[0])
    centre = ends[0] + (ends[1] - ends[0]) * (w - abs(w) ** 2) / (2j * w.imag)
    assert np.ptp(np.abs(points - centre)) < 1e-9


def test_an_arc_moved_onto_its_chord_is_a_line(skirt):
    rise = vertices(skirt, "skirt_front")[0].imag - middle(skirt, "skirt_front", 0).imag
    made = apply(skirt, MoveHandle("skirt_front", 0, 0, (0.0, rise))).specification
    assert "curvature" not in made["pattern"]["panels"]["skirt_front"]["edges"][0]
    assert length(made, "skirt_front", 0) == pytest.approx(2 * 0.39849)


def test_the_curve_of_a_sleeve_is_bent_until_it_fits_the_armhole(tshirt):
    made = apply(tshirt, MoveHandle("front", 2, 0, (-0.02, 0.0)))
    assert abs(length(made.specification, "front", 2) - length(tshirt, "front", 2)) > 1e-3
    assert seam_ratios(made.specification) == pytest.approx(seam_ratios(tshirt), abs=1e-6)
    assert made.notes == ("edge 0 of 'left_sleeve_front' is bent with it",)
    for panel in ("left_sleeve_front", "left_sleeve_back", "back"):
        assert np.array_equal(vertices(made.specification, panel), vertices(tshirt, panel))


def test_an_arc_is_bent_to_fit_as_well(dress):
    # The skirt's waist is an arc, sewn to the straight waist of the bodice: bent, that pulls the arc with it.
    made = apply(dress, MoveHandle("front", 0, 0, (0.0, -0.02))).specification
    assert length(made, "front", 0) > length(dress, "front", 0) + 2e-4
    assert seam_ratios(made) == pytest.approx(seam_ratios(dress), abs=1e-6)
    assert made["pattern"]["panels"]["skirt_front"]["edges"][2]["curvature"]["type"] == "circle"


def test_edges_drawn_alike_stay_alike(tshirt):
    made = apply(tshirt, MoveHandle("front", 1, 0, (0.02, 0.01))).specification
    front, back = edge_points(made, "front", 1), edge_points(made, "back", 8)[::-1]
    assert np.abs(front - edge_points(tshirt, "front", 1)).max() > 5e-3
    # The back's side is drawn where the front's is, as the two lie on each other.
    assert np.abs(front - back).max() < 1e-9


def test_a_straight_partner_can_not_follow_a_curve(dress):
    made = apply(dress, MoveHandle("skirt_front", 2, 0, (0.0, -0.03)))
    (note,) = made.notes
    told = [float(number) for number in re.findall(r"([\d.]+) cm", note)]
    lengths = [length(made.specification, panel, edge) * 100 for panel, edge in (("front", 0), ("skirt_front", 2))]
    assert told == pytest.approx(lengths, abs=0.051)
    assert lengths[1] > lengths[0] + 2
    assert "curvature" not in made.specification["pattern"]["panels"]["front"]["edges"][0]


def test_a_curve_can_not_follow_to_less_than_the_distance_of_its_ends(tube):
    panels = tube["pattern"]["panels"]
    panels["front"]["edges"][1]["curvature"] = [0.5, -0.3]
    panels["back"]["edges"][3]["curvature"] = [0.5, -0.05]
    made = apply(tube, MoveHandle("front", 1, 0, (-0.12, 0.0)))
    assert length(made.specification, "front", 1) == pytest.approx(0.4)
    assert made.specification["pattern"]["panels"]["back"] == tube["pattern"]["panels"]["back"]
    (note,) = made.notes
    assert "is now 40.0 cm long" in note
