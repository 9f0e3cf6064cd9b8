"""Claims on darts: the wedge is out, its legs fit each other, the edge is shorter by its mouth, no hole is left."""

import numpy as np
import pytest
from pattern_measures import area, edge_points, length, rectangle, seams, sewn

from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.weld import weld
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import Dart


@pytest.mark.parametrize(("panel", "edge"), [("front", 0), ("back", 0), ("front", 1)])
def test_a_dart_on_a_straight_edge_takes_out_its_triangle(panel, edge, tshirt):
    spec = tshirt
    made = apply(spec, Dart(panel, edge, 0.4, 0.03, 0.12))
    result = made.specification
    assert area(spec, panel) - area(result, panel) == pytest.approx(0.03 * 0.12 / 2, abs=1e-9)
    parts = [length(result, panel, edge + k) for k in range(4)]
    whole = length(spec, panel, edge)
    leg = np.hypot(0.015, 0.12)
    assert parts == pytest.approx([0.4 * whole - 0.015, leg, leg, 0.6 * whole - 0.015], abs=1e-6)
    assert ((panel, edge + 1), (panel, edge + 2)) in seams(result)
    assert made.change == "topology"


def test_a_darts_point_is_across_from_the_middle_of_its_mouth(skirt):
    made = apply(skirt, Dart("skirt_front", 2, 0.3, 0.02, 0.1)).specification
    mouth = edge_points(made, "skirt_front", 3, 2)[0], edge_points(made, "skirt_front", 4, 2)[1]
    apex = edge_points(made, "skirt_front", 3, 2)[1]
    offset = (apex - sum(mouth) / 2) / (mouth[1] - mouth[0])
    assert offset.real == pytest.approx(0, abs=1e-9)
    assert abs(offset) * abs(mouth[1] - mouth[0]) == pytest.approx(0.1)
    old = edge_points(skirt, "skirt_front", 2)
    assert max(np.abs(old - point).min() for point in mouth) < 1e-4, "its mouth is on the edge"
    assert apex.imag < min(point.imag for point in mouth), "the waist is above: down is into the piece"
    waist = length(made, "skirt_front", 2) + length(made, "skirt_front", 5)
    assert waist == pytest.approx(length(skirt, "skirt_front", 2) - 0.02, abs=1e-6)


@pytest.mark.parametrize(
    ("name", "panel", "edge"), [("tshirt", "back", 0), ("skirt", "skirt_front", 2), ("dress", "front", 1)]
)
def test_a_dart_leaves_no_hole(name, panel, edge, request):
    spec = request.getfixturevalue(name)
    made = apply(spec, Dart(panel, edge, 0.4, 0.03, 0.08)).specification
    loops = [len(boundary_loops(weld(mesh_pattern(parse_pattern(s), 0.02)).vertex_of_corner)) for s in (spec, made)]
    assert loops[1] == loops[0]


def test_the_other_side_of_a_seam_is_divided_and_keeps_its_length(tshirt):
    made = apply(tshirt, Dart("front", 1, 0.4, 0.03, 0.12))
    result = made.specification
    whole = length(tshirt, "front", 1)
    share = (0.4 * whole - 0.015) / (whole - 0.03)
    # The back's side runs against the front's.
    assert [length(result, "back", k) for k in (8, 9)] == pytest.approx([(1 - share) * whole, share * whole], abs=1e-6)
    assert (("front", 1), ("back", 9)) in seams(result)
    assert (("front", 4), ("back", 8)) in seams(result)
    told = [note for note in made.notes if "cm long" in note]
    assert len(told) == 2, "three centimetres are eased in"
    assert "'back' is divided, too, where it is sewn to 'front'" in made.notes


@pytest.mark.parametrize(
    ("edit", "place", "words"),
    [
        (Dart("front", 0, 0.0, 0.03, 0.1), "position", "does not fit"),
        (Dart("front", 0, 0.98, 0.03, 0.1), "position", "does not fit"),
        (Dart("front", 0, 0.5, 0.6, 0.1), "position", "60.0 cm, does not fit on an edge of 52.8 cm"),
        (Dart("front", 0, 0.5, 0.03, 0.56), "panels.front.edges[8]", "crosses or touches itself"),
        (Dart("front", 9, 0.5, 0.03, 0.1), "edge", "no edge 9"),
        (Dart("from", 0, 0.5, 0.03, 0.1), "panel", "no piece 'from'"),
    ],
)
def test_a_dart_that_does_not_fit_is_refused(tshirt, edit, place, words):
    with pytest.raises(EditError) as caught:
        apply(tshirt, edit)
    assert caught.value.place == place
    assert words in caught.value.message
    assert caught.value.remedy


def test_a_dart_on_a_seam_of_the_piece_with_itself_divides_its_other_side():
    spec = sewn({"sleeve": rectangle(40, 40)}, ("sleeve", 1, "sleeve", 3))
    made = apply(spec, Dart("sleeve", 1, 0.25, 0.02, 0.1)).specification
    assert len(made["pattern"]["panels"]["sleeve"]["edges"]) == 4 + 3 + 1
    assert sorted(round(length(made, *one), 6) for one, _ in seams(made)) == pytest.approx(
        sorted([0.09, 0.29, np.hypot(0.01, 0.1)]), abs=1e-5
    )
    assert mesh_pattern(parse_pattern(made), 0.03).faces.shape[0] > 100
