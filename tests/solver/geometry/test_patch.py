"""Pieces on others: where their vertices lie, what the format may say of them, and that dressed they are worn so."""

import numpy as np
import pytest
from frame_judge import FrameJudge
from pattern_measures import demo, rectangle, two_squares

from tryon_solver import PRESETS, dress
from tryon_solver.body.model import default_body
from tryon_solver.geometry.panel_mesh import LIFT, mesh_pattern
from tryon_solver.geometry.patch import MARGIN, Laid, lies_within, overlap
from tryon_solver.geometry.pattern import PatternError, parse_pattern
from tryon_solver.geometry.weld import weld
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edits import Pocket
from tryon_solver.scene import Attached


def with_pocket(**on):
    """A tube of two squares of 40 cm, a pocket of 10 cm by 12 on its front."""
    spec = two_squares()
    spec["pattern"]["panels"]["pocket"] = rectangle(10, 12, on={"panel": "front", "at": [15, 20], "open": [2], **on})
    return spec


def outline(width, height, at=(0.0, 0.0)):
    return np.array([[0, 0], [width, 0], [width, height], [0, height]], float) + at


def test_where_its_vertices_lie_on_the_host():
    """Turned by 30 degrees about its corner: each lies where the file says, in the plane beneath it."""
    mesh = mesh_pattern(parse_pattern(with_pocket(turn=30)), 0.03)
    pocket = mesh.panel_of_vertex == 2
    np.testing.assert_array_equal(mesh.laid.vertices, np.flatnonzero(pocket))
    angle = np.radians(30)
    turned = mesh.uv[pocket] @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    beneath = (mesh.laid.weights[..., None] * mesh.uv[mesh.laid.onto]).sum(1)
    np.testing.assert_allclose(beneath, turned + [0.15, 0.2], atol=1e-12)
    assert mesh.laid.weights.min() > -1e-9
    assert (mesh.panel_of_vertex[mesh.laid.onto] == 0).all()
    off = mesh.placed[pocket] - (mesh.laid.weights[..., None] * mesh.placed[mesh.laid.onto]).sum(1)
    np.testing.assert_allclose(off, np.tile([0, 0, LIFT], (pocket.sum(), 1)), atol=1e-12)  # the front faces +z
    on_top = np.isclose(mesh.uv[pocket][:, 1], 0.12) & (mesh.uv[pocket][:, 0] > 1e-6) & (mesh.uv[pocket][:, 0] < 0.0999)
    assert on_top.sum() >= 2
    assert not mesh.laid.sewn[on_top].any()
    rim = np.isclose(mesh.uv[pocket] / [0.1, 0.12], 0) | np.isclose(mesh.uv[pocket] / [0.1, 0.12], 1)
    np.testing.assert_array_equal(mesh.laid.sewn, rim.any(1) & ~on_top)


def test_a_piece_drawn_from_its_wrong_side_has_its_pocket_outside():
    spec = with_pocket()
    for panel in ("front", "back", "pocket"):
        edges = spec["pattern"]["panels"][panel]["edges"]
        spec["pattern"]["panels"][panel]["edges"] = [{"endpoints": edge["endpoints"][::-1]} for edge in edges[::-1]]
    spec["pattern"]["panels"]["pocket"]["on"]["open"] = [1]
    mesh = mesh_pattern(parse_pattern(spec), 0.03)
    beneath = (mesh.laid.weights[..., None] * mesh.uv[mesh.laid.onto]).sum(1)
    np.testing.assert_allclose(beneath, mesh.uv[mesh.laid.vertices] + [-0.15, 0.2], atol=1e-12)
    off = mesh.placed[mesh.laid.vertices] - (mesh.laid.weights[..., None] * mesh.placed[mesh.laid.onto]).sum(1)
    np.testing.assert_allclose(off, np.tile([0, 0, -LIFT], (len(off), 1)), atol=1e-12)


def test_a_pattern_without_has_none():
    mesh = mesh_pattern(parse_pattern(two_squares()), 0.05)
    assert mesh.laid.vertices.shape == (0,)
    assert Laid.together([]).on(mesh.placed, mesh.faces, 0.1).shape == (0, 3)


FAULTS = {
    "no name": ({"panel": 7}, "panels.pocket.on", "on which panel"),
    "no such panel": ({"panel": "frnt"}, "panels.pocket.on.panel", "no panel 'frnt'"),
    "on itself": ({"panel": "pocket"}, "panels.pocket.on.panel", "lies on none itself"),
    "nowhere": ({"at": None}, "panels.pocket.on.at", "not 2 numbers"),
    "no angle": ({"turn": "left"}, "panels.pocket.on.turn", "is not a number"),
    "no edges": ({"open": [4]}, "panels.pocket.on.open", "not a list of its edges"),
    "all open": ({"open": [0, 1, 2, 3]}, "panels.pocket.on.open", "none of its edges is sewn on"),
    "over the edge": ({"at": [31, 20]}, "panels.pocket.on.at", "reaches over the edge"),
    "at the edge": ({"at": [29.8, 20]}, "panels.pocket.on.at", "reaches over the edge"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_what_it_may_not_say(name):
    on, place, words = FAULTS[name]
    with pytest.raises(PatternError) as caught:
        parse_pattern(with_pocket(**on))
    assert caught.value.place == place
    assert words in caught.value.message
    assert caught.value.remedy


def test_it_can_not_be_sewn_otherwise_too_nor_overlap_another_nor_be_turned_over():
    spec = with_pocket()
    spec["pattern"]["stitches"].append([{"panel": "pocket", "edge": 0}, {"panel": "front", "edge": 0}, "gather"])
    with pytest.raises(PatternError, match="is sewn to an edge, too"):
        parse_pattern(spec)
    spec = with_pocket()
    spec["pattern"]["panels"]["other"] = rectangle(5, 5, on={"panel": "front", "at": [18, 25]})
    with pytest.raises(PatternError, match="overlap on 'front'"):
        parse_pattern(spec)
    spec["pattern"]["panels"]["other"]["on"]["at"] = [5, 25]
    assert [patch.open for patch in parse_pattern(spec).patches] == [{2}, set()]
    spec["pattern"]["panels"]["other"]["edges"] = [
        {"endpoints": edge["endpoints"][::-1]} for edge in spec["pattern"]["panels"]["other"]["edges"][::-1]
    ]
    with pytest.raises(PatternError, match="the other way round"):
        parse_pattern(spec)


def test_inside_and_apart():
    host = outline(1.0, 1.0)
    assert lies_within(outline(0.5, 0.5, (0.2, 0.2)), host)
    assert not lies_within(outline(0.5, 0.5, (0.2, 0.5 - MARGIN / 2)), host)
    notched = np.array([[0, 0], [1, 0], [1, 1], [0.5, 0.4], [0, 1]], float)
    assert not lies_within(outline(0.8, 0.5, (0.1, 0.1)), notched)  # all its corners are inside
    assert overlap(outline(1, 1), outline(0.2, 0.2, (0.4, 0.4)))
    assert overlap(outline(1, 0.2, (0, 0.4)), outline(0.2, 1, (0.4, 0)))  # a cross: no corner in the other
    assert overlap(outline(1, 1), outline(1, 1, (1 + MARGIN / 2, 0)))
    assert not overlap(outline(1, 1), outline(1, 1, (1 + 2 * MARGIN, 0)))


@pytest.mark.long
def test_a_t_shirt_with_a_pocket_is_worn_and_the_pocket_stays_on_it():
    """Clean by IPC Toolkit as it hangs, and no stitch opens by more than the contact between the layers asks."""
    spec = apply(demo("tshirt"), Pocket("front", (0.07, 0.4), 0.13, 0.14)).specification
    panels, body = mesh_pattern(parse_pattern(spec), 0.04), default_body()
    sim = dress(panels, body, FABRICS["cotton_jersey"], PRESETS["draft"]).simulation
    assert [type(effect) for effect in sim.scene.effects].count(Attached) == 1
    cloth, surface = sim.cloth_positions(), sim.body_positions()
    assert FrameJudge(sim.scene.garment.faces, body.faces, cloth, surface).judge(cloth, surface).clean
    vertex, laid = weld(panels).welded_of_vertex, panels.laid
    beneath = (laid.weights[..., None] * cloth[vertex[laid.onto]]).sum(1)
    off = np.linalg.norm(cloth[vertex[laid.vertices]] - beneath, axis=1)
    assert off[laid.sewn].min() > 0.2e-3
    assert off[laid.sewn].max() < 4e-3
    assert len(off) > laid.sewn.sum() + 2
