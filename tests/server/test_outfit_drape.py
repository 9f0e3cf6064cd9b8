"""Two garments that the solver simulates: dressed one over the other, edited each by itself, one taken off."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from outfit_orders import overshirt_over_tshirt

from tryon_server.problems import ProblemError
from tryon_server.runtime import production
from tryon_server.runtime.publishing import topology_of
from tryon_solver.body.pose import Pose
from tryon_solver.dressing.fit import DressingError
from tryon_solver.effect_words.table import live, word_of
from tryon_solver.geometry.garment import GarmentError
from tryon_solver.geometry.pattern import PatternError
from tryon_solver.geometry.placement import PlacementError
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.plain import parse_edit
from tryon_solver.scene import Elastic


@pytest.fixture(scope="module")
def order(tmp_path_factory):
    return overshirt_over_tshirt(tmp_path_factory.mktemp("dressed"))


@pytest.fixture
def drape(dressed):
    """The two, as they were dressed."""
    *_, worn = pickle.loads(dressed).unpacking()
    return worn


@pytest.fixture(scope="module")
def dressed(order):
    return pickle.dumps(production.build_drape(order, lambda *_: None).packed())


def edited(drape, kind, **fields):
    return apply(drape.specification, parse_edit({"kind": kind, "panel": "back", **fields})).specification


def raised(drape, k):
    return Pose(drape.pose.root + [0.0, 0.004 * k, 0.0], drape.pose.rotations)


def test_two_garments_are_told_and_each_is_of_its_fabric(drape):
    assert drape.names == ("inner", "outer")
    assert drape.edited == "outer"
    topology = topology_of(drape.outfit, 1)
    assert topology.panel_names[:2] == ("inner/front", "inner/back")
    assert topology.panel_names[6:9] == ("outer/front_left", "outer/front_right", "outer/back")
    assert [(part.name, part.fabric) for part in topology.garments] == [
        ("inner", "cotton_jersey"),
        ("outer", "denim"),
    ]
    assert sum(part.vertices[1] for part in topology.garments) == drape.outfit.vertex_count
    densities = drape.simulation.mass / drape.simulation.area
    first = topology.garments[0].vertices[1]
    assert densities[:first] == pytest.approx(0.18)
    assert densities[first:] == pytest.approx(0.40)


def test_what_was_put_on_before_hangs_as_it_did_and_is_not_sewn_again(order, drape):
    stages = []
    told = replace(order, specification=drape.specifications["inner"])  # as sessions tell it once it was worn
    again = production.build_drape(told, lambda stage, _: stages.append(stage))
    assert stages.count("Dressing as before") == 2, "the inner one alone, then both"
    assert "Sewing the next garment over what is worn" not in stages
    assert np.array_equal(again.cloth_positions(), drape.cloth_positions())
    assert np.array_equal(again.body_positions(), drape.body_positions())
    renamed = replace(order, over=(replace(order.over[0], fabric="cotton_poplin"),))
    stages.clear()
    production.build_drape(renamed, lambda stage, _: stages.append(stage))
    assert stages.count("Dressing as before") == 1, "of another fabric it hangs otherwise"


@pytest.mark.parametrize("name", ["inner", "outer"])
def test_a_drag_reshapes_the_garment_that_is_edited_and_no_other(drape, name):
    drape.edit_garment(name)
    garment = drape.simulation.scene.garment
    before = garment.uv_corners.copy()
    assert drape.reshape(edited(drape, "scale_piece", factors=[1.03, 1.0])) == ""
    for k in range(1, 9):
        drape.advance(raised(drape, k), k / 60)
    changed = (drape.simulation.scene.garment.uv_corners != before).any(axis=(1, 2))
    own = drape.layer_of(name).faces
    assert changed[own].any()
    assert not np.delete(changed, np.arange(own.start, own.stop)).any()
    *_, again = pickle.loads(pickle.dumps(drape.packed())).unpacking()
    assert np.array_equal(again.simulation.scene.garment.uv_corners, drape.simulation.scene.garment.uv_corners)
    assert again.edited == name


@pytest.mark.parametrize("name", ["inner", "outer"])
def test_another_cut_of_one_garment_is_put_on_with_the_other_where_it_was(drape, name):
    drape.edit_garment(name)
    opened = edited(drape, "open_seam", edge=1)
    cut = pickle.loads(pickle.dumps(drape.cutting(opened, "silk_charmeuse")()))
    *_, worn = drape.recut(cut)
    other = "inner" if name == "outer" else "outer"
    assert (worn.edited, worn.specification) == (name, opened)
    assert worn.specifications[other] == drape.specifications[other]
    assert [part.fabric for part in worn.outfit.garments][worn.names.index(name)] == "silk_charmeuse"
    was, now = (it.cloth_positions()[it.layer_of(other).vertices] for it in (drape, worn))
    assert np.abs(now - was).max() < 2e-3  # what is freed moves what it touches by a thickness
    worn.advance(raised(drape, 1), 1 / 60)
    assert np.isfinite(worn.cloth_positions()).all()
    assert worn.reshape(opened) == "", "it is edited on"


def test_one_is_taken_off_between_two_frames_and_edits_of_the_other_stay(drape):
    drape.edit_garment("outer")
    wide = edited(drape, "scale_piece", factors=[1.03, 1.0])
    assert drape.reshape(wide) == ""
    for k in range(1, 9):
        drape.advance(raised(drape, k), k / 60)
    *parts, left = drape.take_off("inner")
    assert set(parts) == {None}
    own = drape.layer_of("outer")
    assert (left.names, left.edited) == (("outer",), "outer")
    assert left.outfit.panel_names[:3] == ("front_left", "front_right", "back")
    assert np.array_equal(left.cloth_positions(), drape.cloth_positions()[own.vertices])
    assert np.array_equal(left.body_positions(), drape.body_positions())
    now = drape.simulation.scene.garment.uv_corners[own.faces]
    assert np.array_equal(left.simulation.scene.garment.uv_corners, now)
    assert left.specification == wide
    assert left.reshape(edited(left, "scale_piece", factors=[1.02, 1.0])) == "", "it is edited on"
    assert left.reshape(wide) == ""
    left.advance(raised(drape, 9), 9 / 60)
    assert np.abs(left.cloth_positions() - drape.cloth_positions()[own.vertices]).max() < 0.02


def test_effects_act_on_all_that_is_worn_and_go_along_with_their_pieces(drape):
    """Elastic in the inner hem goes through a new cut of the outer garment, stickiness of that is lost with it."""
    hem = [{"panel": "inner/front", "edge": 0}, {"panel": "inner/back", "edge": 0}]
    given = {
        "wind": {"velocity": [0.0, 0.0, 2.0]},
        "elastic": {"lines": [{"along": hem, "ratio": 0.9}]},
        "adhesion": {"kind": "static_cling", "panels": ["outer/back"]},
    }
    wanted = {**live(), **{name: word_of(name).parameters(own) for name, own in given.items()}}
    drape.effects.check(wanted)
    for k, _ in enumerate(drape.effects.rebind(wanted)):
        drape.advance(raised(drape, 1), (k + 1) / 60)
    edges = elastic_edges(drape)
    assert len(edges) > 5
    assert edges.max() < drape.layer_of("outer").vertices.start
    *_, again = pickle.loads(pickle.dumps(drape.packed())).unpacking()
    assert again.effects.asked == drape.effects.asked == wanted

    drape.edit_garment("outer")
    *_, cut = drape.recut(drape.cutting(edited(drape, "open_seam", edge=1), "denim")())
    assert cut.effects.asked == wanted
    assert np.array_equal(elastic_edges(cut), edges)
    *_, left = cut.take_off("outer")
    assert left.effects.asked == {name: own for name, own in wanted.items() if name != "adhesion"}
    assert np.array_equal(elastic_edges(left), edges)
    assert left.effects.under_garments("elastic", wanted["elastic"])["lines"][0]["along"] == hem

    drape.edit_garment("inner")
    *_, other = drape.recut(drape.cutting(edited(drape, "open_seam", edge=1), "cotton_jersey")())
    assert set(wanted) - set(other.effects.asked) <= {"elastic"}
    *_, outer = drape.take_off("inner")
    assert set(wanted) - set(outer.effects.asked) == {"elastic"}, "its lines are gone"
    outer.advance(raised(drape, 2), outer._time + 1 / 60)
    assert np.isfinite(outer.cloth_positions()).all()


def elastic_edges(drape):
    """Of the mesh, that have elastic in them."""
    (spec,) = (effect for effect in drape.simulation.scene.effects if isinstance(effect, Elastic))
    return spec.lines[0].edges


@pytest.mark.parametrize("kind", [DressingError, PlacementError, PatternError, GarmentError])
def test_what_can_t_be_put_on_over_the_other_is_refused_by_name(order, dressed, monkeypatch, kind):
    del dressed  # the innermost hangs as it did then
    told = ("it is too tight",) if kind is GarmentError else ("it is too tight", "panels.back", "Enlarge it")

    def refuse(*_, **__):
        raise kind(*told)

    monkeypatch.setattr(production, "put_over", refuse)
    # of another fabric, or it would hang over the other as it was put on before
    named = replace(order.over[0], garment_name="the kilt", fabric="linen")
    with pytest.raises(ProblemError) as caught:
        production.build_drape(replace(order, over=(named,)), lambda *_: None)
    problem = caught.value.problem
    assert problem.code == "garment.unfit"
    assert problem.place == "garments.outer"
    assert problem.message == "the kilt can't be put on over inner: it is too tight"
    assert problem.remedy


def test_a_mesh_is_worn_innermost(order, dressed, tmp_path):
    del dressed
    (tmp_path / "top.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    mesh = replace(order.over[0], pattern=tmp_path / "top.obj")
    with pytest.raises(ProblemError, match="it is a mesh"):
        production.build_drape(replace(order, over=(mesh,)), lambda *_: None)
