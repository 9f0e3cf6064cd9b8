"""Claims on scaled pieces and garments: areas and lengths by the factors, the top where it was, seams that follow."""

import numpy as np
import pytest
from pattern_measures import area, length, outline, placed, rectangle, seam_ratios, sewn

from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.size import mesh_in_size
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import ScaleGarment, ScalePiece


def extent(spec, panel):
    points = outline(spec, panel)
    return np.array([np.ptp(points.real), np.ptp(points.imag)])


def top(spec):
    return max(placed(spec, panel, outline(spec, panel))[:, 1].max() for panel in spec["pattern"]["panels"])


@pytest.mark.parametrize("factors", [(1.1, 1.1), (1.2, 0.9)])
def test_a_piece_grows_by_the_factors_about_its_middle(tshirt, skirt, factors):
    for spec, panel in ((tshirt, "front"), (skirt, "skirt_front")):
        made = apply(spec, ScalePiece(panel, factors)).specification
        assert area(made, panel) == pytest.approx(factors[0] * factors[1] * area(spec, panel), rel=2e-5)
        assert extent(made, panel) == pytest.approx(factors * extent(spec, panel), rel=2e-5)
        old, new = outline(spec, panel), outline(made, panel)
        middles = [(p.real.min() + p.real.max()) / 2 + 1j * (p.imag.min() + p.imag.max()) / 2 for p in (old, new)]
        assert middles[1] == pytest.approx(middles[0], abs=1e-5)


def test_what_is_sewn_to_a_scaled_piece_follows(tshirt):
    made = apply(tshirt, ScalePiece("front", (1.1, 1.05)))
    assert seam_ratios(made.specification) == pytest.approx(seam_ratios(tshirt), abs=1e-6)
    assert length(made.specification, "back", 3) > length(tshirt, "back", 3) + 0.005
    assert {note.split("'")[1] for note in made.notes} == set(tshirt["pattern"]["panels"]) - {"front"}
    assert made.change == "value"


def test_an_arc_scaled_unevenly_is_part_of_an_ellipse(skirt):
    made = apply(skirt, ScalePiece("skirt_front", (1.3, 1.0))).specification
    angle = np.linspace(-1, 1, 20001) * np.arcsin(0.39849 / 0.9429)
    ellipse = 0.9429 * (1.3 * np.sin(angle) - 1j * np.cos(angle))
    assert length(made, "skirt_front", 0) == pytest.approx(np.abs(np.diff(ellipse)).sum(), rel=2e-5)


def test_half_a_circle_can_only_be_scaled_evenly():
    panel = rectangle(40, 40)
    panel["edges"][0]["curvature"] = {"type": "circle", "params": [20, 0, 1]}
    spec = sewn({"a": panel})
    even = apply(spec, ScalePiece("a", (1.5, 1.5))).specification
    assert area(even, "a") == pytest.approx(1.5**2 * (0.16 + np.pi * 0.2**2 / 2), rel=1e-6)
    with pytest.raises(EditError, match="more than a quarter circle") as caught:
        apply(spec, ScalePiece("a", (1.5, 1.0)))
    assert caught.value.place == "factors"
    assert "same factor" in caught.value.remedy


@pytest.mark.parametrize("name", ["tshirt", "dress", "skirt", "trousers"])
def test_a_garment_scaled_evenly_is_the_garment_in_that_size(name, request):
    spec = request.getfixturevalue(name)
    made = apply(spec, ScaleGarment((1.25, 1.25)))
    mesh = mesh_pattern(parse_pattern(made.specification), 0.05)
    wanted = mesh_in_size(parse_pattern(spec), 0.05, 1.25)
    assert mesh.placed.max(axis=0) == pytest.approx(wanted.placed.max(axis=0), abs=1e-3)
    assert mesh.placed.min(axis=0) == pytest.approx(wanted.placed.min(axis=0), abs=1e-3)
    assert made.notes == ()
    assert made.change == "value"
    for panel in spec["pattern"]["panels"]:
        assert area(made.specification, panel) == pytest.approx(1.25**2 * area(spec, panel), rel=1e-9)


def test_a_garment_scaled_unevenly_keeps_its_top_and_tells_what_fits_no_longer(tshirt):
    made = apply(tshirt, ScaleGarment((1.2, 1.0)))
    assert top(made.specification) == pytest.approx(top(tshirt), abs=1e-6)
    for panel in tshirt["pattern"]["panels"]:
        assert extent(made.specification, panel) == pytest.approx((1.2, 1) * extent(tshirt, panel), rel=1e-6)
    changed = np.array(seam_ratios(made.specification)) / seam_ratios(tshirt) - 1
    assert len(made.notes) == np.count_nonzero(np.abs(changed) * 0.24 > 1e-3)
    assert len(made.notes) == 4, "both sleeves at front and back"
