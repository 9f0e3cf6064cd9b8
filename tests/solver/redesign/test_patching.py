"""Claims on pockets and patches: where they come to, what becomes of them when what they are sewn on changes."""

import numpy as np
import pytest
from pattern_measures import area

from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.both_sides import apply_to_both
from tryon_solver.redesign.drag import begin_drag
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import (
    Cut,
    Dart,
    Lengthen,
    MoveVertex,
    Patch,
    Pocket,
    RemovePiece,
    ScaleGarment,
    ScalePiece,
)
from tryon_solver.redesign.remesh import Remesh

POCKET = Pocket("front", (0.08, 0.4), 0.1, 0.12)


@pytest.fixture
def pocketed(tshirt):
    return apply(tshirt, POCKET).specification


def patches(spec):
    """By name: what they lie on, their corners there (K, 2) m, and the open edges."""
    pattern = parse_pattern(spec)
    return {
        pattern.panels[p.panel].name: (
            pattern.panels[p.host].name,
            p.on_host(pattern.panels[p.panel].corners),
            sorted(p.open),
        )
        for p in pattern.patches
    }


def test_a_pocket_is_a_rectangle_about_its_middle_open_at_the_top(tshirt, pocketed):
    host, corners, opened = patches(pocketed)["pocket"]
    assert host == "front"
    np.testing.assert_allclose(corners, [[0.03, 0.34], [0.13, 0.34], [0.13, 0.46], [0.03, 0.46]], atol=1e-12)
    assert opened == [2]
    assert area(pocketed, "front") == area(tshirt, "front")
    made = apply(pocketed, Patch("front", (-0.1, 0.2), 0.08, 0.06, 90.0))
    assert made.change == "topology"
    host, corners, opened = patches(made.specification)["patch"]
    assert (host, opened) == ("front", [])
    np.testing.assert_allclose(np.ptp(corners, axis=0), [0.06, 0.08], atol=1e-12)
    second = apply(pocketed, Pocket("front", (-0.08, 0.4), 0.1, 0.12)).specification
    assert list(patches(second)) == ["pocket", "pocket_2"]


def test_of_a_piece_drawn_the_other_way_round_it_is_the_upper_edge_too(tube):
    edges = tube["pattern"]["panels"]["back"]["edges"]
    tube["pattern"]["panels"]["back"]["edges"] = [{"endpoints": edge["endpoints"][::-1]} for edge in edges[::-1]]
    tube["pattern"]["stitches"] = []
    tube["pattern"]["stitches"] = [
        [{"panel": "front", "edge": 1}, {"panel": "back", "edge": 0}],
        [{"panel": "front", "edge": 3}, {"panel": "back", "edge": 2}],
    ]
    pattern = parse_pattern(apply(tube, Pocket("back", (0.2, 0.2), 0.1, 0.12)).specification)
    (pocket,) = pattern.patches
    panel = pattern.panels[pocket.panel]
    assert panel.clockwise
    (opened,) = pocket.open
    ends = panel.edges[opened].curve.points([0.0, 1.0])
    np.testing.assert_allclose(ends[:, 1], 0.06)


@pytest.mark.parametrize(
    ("edit", "place", "words"),
    [
        (Pocket("frnt", (0.0, 0.3), 0.1, 0.1), "panel", "no piece 'frnt'"),
        (Pocket("front", (0.22, 0.3), 0.1, 0.1), "panels.pocket_2.on.at", "reaches over the edge"),
        (Patch("front", (0.1, 0.45), 0.1, 0.1), "panels.patch.on.at", "overlap"),
        (Patch("pocket", (0.0, 0.0), 0.02, 0.02), "panel", "nothing can be sewn on it"),
        (Dart("pocket", 0, 0.5, 0.01, 0.02), "panel", "it can have no dart"),
        (Cut("pocket", ((-1.0, 0.0), (1.0, 0.0)), True), "panel", "it can't be cut"),
        (ScalePiece("front", (0.5, 0.5)), "panels.pocket.on.at", "reaches over the edge"),
    ],
)
def test_what_can_not_be(pocketed, edit, place, words):
    with pytest.raises(EditError) as caught:
        apply(pocketed, edit)
    assert caught.value.place == place
    assert words in caught.value.message
    assert caught.value.remedy


def test_it_goes_with_the_part_that_it_lies_on_when_that_is_cut(pocketed):
    above = apply(pocketed, Cut("front", ((-1.0, 0.2), (1.0, 0.2)), True)).specification
    lower = next(name for name in above["pattern"]["panels"] if name.startswith("front") and name != "front")
    hosts = {patches(above)["pocket"][0]}
    below = apply(pocketed, Cut("front", ((-1.0, 0.5), (1.0, 0.5)), True)).specification
    hosts.add(patches(below)["pocket"][0])
    assert hosts == {"front"}, "the larger part has it, and keeps the name"
    moved = apply(pocketed, Cut("front", ((0.02, -1.0), (0.02, 2.0)), True)).specification
    assert patches(moved)["pocket"][0] in ("front", lower)
    np.testing.assert_allclose(patches(moved)["pocket"][1], patches(pocketed)["pocket"][1])
    with pytest.raises(EditError, match="reaches over the edge"):
        apply(pocketed, Cut("front", ((-1.0, 0.4), (1.0, 0.4)), True))


def test_it_goes_when_what_it_lies_on_goes(tshirt):
    spec = apply(tshirt, Patch("left_sleeve_back", (0.14, -0.09), 0.04, 0.04)).specification
    made = apply(spec, RemovePiece("left_sleeve_back"))
    assert "patch" not in made.specification["pattern"]["panels"]
    assert any("'patch'" in note and "taken away" in note for note in made.notes)
    alone = apply(spec, RemovePiece("patch")).specification
    assert list(alone["pattern"]["panels"]) == list(tshirt["pattern"]["panels"])


def test_a_larger_garment_has_a_larger_pocket_in_the_same_place_of_it(pocketed):
    made = apply(pocketed, ScaleGarment((1.2, 1.2))).specification
    np.testing.assert_allclose(patches(made)["pocket"][1], 1.2 * patches(pocketed)["pocket"][1], atol=1e-12)
    assert "translation" not in made["pattern"]["panels"]["pocket"]


def test_what_changes_a_pocket_sews_it_on_anew_and_what_changes_the_piece_beneath_does_not(pocketed):
    assert apply(pocketed, MoveVertex("pocket", 0, (0.01, 0.0))).change == "topology"
    assert apply(pocketed, Lengthen("front", 0, 0.03)).change == "value"
    assert apply(pocketed, Lengthen("left_sleeve_back", 1, 0.02)).change == "value"


def test_fabric_that_a_pocket_is_sewn_on_stays_in_a_drag_and_the_rest_of_the_piece_goes(pocketed):
    """So each stitch of it holds the same place of the fabric."""
    pattern = parse_pattern(pocketed)
    mesh = mesh_pattern(pattern, 0.02)
    drag = begin_drag(mesh, pattern, 2e-4)
    longer = drag.moved(parse_pattern(apply(pocketed, Lengthen("front", 0, 0.1)).specification))
    pocket, front = (mesh.vertices_of(mesh.panel_names.index(name)) for name in ("pocket", "front"))
    beneath = np.unique(mesh.laid.onto)
    assert len(beneath) > 20
    np.testing.assert_array_equal(longer.uv[beneath], mesh.uv[beneath])
    np.testing.assert_array_equal(longer.uv[pocket], mesh.uv[pocket])
    way = np.linalg.norm(longer.uv[front] - mesh.uv[front], axis=1)
    assert way.max() > 0.09
    assert np.median(way) > 1e-3
    corners = longer.uv[longer.faces]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    assert (u[:, 0] * v[:, 1] > u[:, 1] * v[:, 0]).all()


def test_where_an_edge_takes_the_fabric_beneath_a_pocket_along_it_is_sewn_on_anew(tshirt):
    """Coarse triangles under a pocket that lies close to the hem reach as far as that."""
    spec = apply(tshirt, Pocket("front", (0.0, 0.09), 0.1, 0.12)).specification
    pattern = parse_pattern(spec)
    mesh = mesh_pattern(pattern, 0.06)
    longer = apply(spec, Lengthen("front", 0, 0.05)).specification
    refused = begin_drag(mesh, pattern, 2e-4).moved(parse_pattern(longer))
    assert isinstance(refused, Remesh)
    assert "'pocket'" in refused.message


def test_both_sides_have_one_and_one_in_the_middle_is_its_own_image(tshirt):
    made = apply_to_both(tshirt, Pocket("front", (0.08, 0.4), 0.1, 0.12, 20.0)).specification
    (_, one, _), (_, other, _) = patches(made).values()
    image = one * [-1, 1]
    assert max(np.linalg.norm(other - corner, axis=1).min() for corner in image) < 1e-9
    middle = apply_to_both(tshirt, Patch("front", (0.0, 0.3), 0.1, 0.1))
    assert list(patches(middle.specification)) == ["patch"]
    sleeve = apply_to_both(tshirt, Patch("left_sleeve_back", (0.14, -0.09), 0.04, 0.04)).specification
    assert [host for host, *_ in patches(sleeve).values()] == ["left_sleeve_back", "right_sleeve_back"]
