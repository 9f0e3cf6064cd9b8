"""Effects as people ask for them: every fault names its place and a remedy, and what is asked for becomes the specs
that it says."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from effect_names import rows, table
from small_scenes import garment_of, grid_faces, grid_uv, icosphere

from tryon_solver.effect_words.fields import EffectError
from tryon_solver.effect_words.rules import in_scene, left_out, same_but_values
from tryon_solver.effect_words.table import BUILT_IN, LIVE, WORDS, live, word_of
from tryon_solver.effect_words.table import FABRICS as NAMED
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.named_lines import Cut
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.weld import weld
from tryon_solver.materials.fabric import FABRICS, between_fabrics
from tryon_solver.scene import LIVE as LIVE_SCENE
from tryon_solver.scene import Friction, Gas, Scene, Wind
from tryon_solver.worn_effects import MAKERS, VALUES, check, effects_of, values_of

SKIRT = "server/tryon_server/demo/patterns/skirt.json"
WAIST = [{"panel": "skirt_front", "edge": 2}, {"panel": "skirt_back", "edge": 2}]
SIDES = [{"panel": "skirt_front", "edge": 1}]


@pytest.fixture(scope="module")
def skirt():
    pattern = load_pattern(SKIRT)
    panels = mesh_pattern(pattern, 0.05)
    welded = weld(panels)
    counts, clockwise = zip(*((len(panel.edges), panel.clockwise) for panel in pattern.panels))
    return Cut.of_pattern(welded.garment(), panels, welded, counts, "skirt", clockwise), panels, welded


@pytest.fixture
def sheet():
    """A garment without a pattern, of one piece."""
    return Cut.of_mesh(garment_of(grid_uv(3, 3, 0.2, 0.2), grid_faces(3, 3)), ("sheet",))


def asked(name, given, cut):
    return effects_of({name: word_of(name).parameters(given)}, cut)


def refused(name, given, cut):
    with pytest.raises(EffectError) as told:
        asked(name, given, cut)
    assert told.value.message
    assert told.value.remedy
    return told.value


def test_every_word_has_a_maker_and_is_plain_json():
    assert {word.name for word in WORDS} == set(MAKERS)
    assert set(VALUES) <= set(MAKERS)
    for word in WORDS:
        assert json.loads(json.dumps(word.described())) == word.described()


def test_what_is_chosen_in_a_pattern_is_told_by_kinds_of_fields():
    points = next(field for field in word_of("pins").described()["fields"] if field["name"] == "points")
    panel, x, y = points["fields"]
    assert (panel["kind"], panel["besides"]) == ("panel", [])
    for coordinate, axis in ((x, "x"), (y, "y")):
        told = [coordinate[name] for name in ("kind", "axis", "of", "default")]
        assert told == ["coordinate", axis, panel["name"], None]
    pairs = next(field for field in word_of("friction").described()["fields"] if field["name"] == "pairs")
    assert [field["besides"] for field in pairs["fields"][:2]] == [[], ["body"]]


def test_what_is_lined_is_nothing_without_an_entry_and_all_else_is_something(skirt):
    without = {word.name: word.described()["lined"] for word in WORDS if word.name != "gas"}
    for name, lined in without.items():
        if lined:
            assert refused(name, {}, skirt[0]).place.removeprefix("parameters.") in ("lines", "points", "rows")
        else:
            assert asked(name, {}, skirt[0])
    assert [name for name, lined in without.items() if lined] == ["pins", "elastic", "creases", "fasteners"]


def test_what_is_worn_without_asking_is_the_scenes_own(sheet):
    assert effects_of(live(), sheet) == LIVE_SCENE
    assert len(LIVE) == len(LIVE_SCENE)


def test_an_unknown_name_lists_those_that_there_are():
    with pytest.raises(EffectError, match="wind") as told:
        word_of("wnd")
    assert all(word.name in told.value.remedy for word in WORDS)


@pytest.mark.parametrize(
    ("name", "given", "place"),
    [
        ("wind", {"velocity": [1, 2]}, "parameters.velocity"),
        ("wind", {"velocity": [1, "2", 3]}, "parameters.velocity[1]"),
        ("wind", {"velocity": [30, 30, 0]}, "parameters.velocity"),
        ("wind", {"velocity": [1, float("nan"), 0]}, "parameters.velocity[1]"),
        ("wind", {"speed": 3}, "parameters.speed"),
        ("wind", {"velocity": [0, 0, 0], "gusts": 0.2}, "parameters.gusts"),
        ("wind", {"velocity": [0, 0, 30], "density": 2.0}, "parameters.velocity"),
        ("wind", {"velocity": [20, 0, 0], "gusts": 0.4}, "parameters.velocity"),
        ("wind", [], "parameters"),
        ("wind", {"shelter": True}, "parameters.shelter"),
        ("wind", {"seed": 1.5}, "parameters.seed"),
        ("wind", {"seed": float("inf")}, "parameters.seed"),
        ("wind", {"seed": float("nan")}, "parameters.seed"),
        ("wind", {"seed": 10**400}, "parameters.seed"),
        ("pressure", {"panels": ["sleeve"]}, "parameters.panels[0]"),
        ("pressure", {"panels": "sheet"}, "parameters.panels"),
        ("adhesion", {"kind": "glue"}, "parameters.kind"),
        ("friction", {"body": 0.5}, "parameters.cloth"),
        ("friction", {"body": 0.5, "cloth": 0.3, "cloth_kinetic": 0.4}, "parameters.cloth_kinetic"),
        ("friction", {"body": 0.2, "cloth": 0.3, "body_kinetic": 0.4}, "parameters.body_kinetic"),
        ("friction", {"pairs": [{"first": "sheet"}]}, "parameters.pairs[0].second"),
        ("stretch_curves", {"warp": [[0.1, 5], [0.05, 9]]}, "parameters.warp"),
        ("pins", {}, "parameters.points"),
        ("pins", {"points": [{"panel": "sheet", "x": 0.1}]}, "parameters.points[0].y"),
        ("pins", {"points": [{"panel": "sleeve", "x": 0.1, "y": 0.1}]}, "parameters.points[0].panel"),
        ("pins", {"points": [{"panel": "sheet", "x": 3.0, "y": 0.1}]}, "parameters.points[0]"),
        ("pins", {"points": [{"panel": "sheet", "x": 0.1, "y": 11.0}]}, "parameters.points[0].y"),
        ("pins", {"lines": [{"along": [{"panel": "sheet", "edge": 0}]}]}, "parameters.lines[0].along[0]"),
        ("pins", {"to": "moon"}, "parameters.to"),
        ("pins", {"stiffness": 1.0}, "parameters.stiffness"),
        ("gas", {}, "parameters.panels"),
        ("gas", {"panels": ["sleeve"]}, "parameters.panels[0]"),
        ("gas", {"share": 9.0}, "parameters.share"),
        ("elastic", {}, "parameters.lines"),
        ("elastic", {"lines": [{"along": WAIST}]}, "parameters.lines[0].along[0].panel"),
        ("elastic", {"lines": [{"along": [{"panel": "sheet", "edge": 0}]}]}, "parameters.lines[0].along[0]"),
        ("body_contact", {"stiffness": 1}, "parameters.stiffness"),
    ],
)
def test_a_fault_names_its_place(name, given, place, sheet):
    assert refused(name, given, sheet).place == place


def test_a_line_follows_the_patterns_edges_around_the_waist(skirt):
    cut, panels, welded = skirt
    line = cut.line(WAIST, "lines")
    assert line[0] == line[-1], "the waist is closed"
    assert len(set(line)) == len(line) - 1
    x = welded.mean_of_vertices(panels.placed)
    assert len(line) > 10
    assert np.ptp(x[line, 1]) < 0.05, "it lies at one height"
    assert x[line, 1].min() > np.quantile(x[:, 1], 0.9), "at the top"


def test_lines_refuse_what_does_not_hang_together(skirt):
    apart = [{"panel": "skirt_front", "edge": 0}, {"panel": "skirt_back", "edge": 2}]
    row = {"first": apart, "second": SIDES}
    assert refused("fasteners", {"rows": [row]}, skirt[0]).place == "parameters.rows[0].first[1]"
    none = [{"panel": "skirt_front", "edge": 9}]
    assert refused("elastic", {"lines": [{"along": none}]}, skirt[0]).place == "parameters.lines[0].along[0].edge"
    border = {"lines": [{"along": WAIST[:1]}]}
    assert "seam" in refused("creases", border, skirt[0]).message
    seam = {"rows": [{"first": SIDES, "second": [{"panel": "skirt_back", "edge": 3}]}]}
    assert "seam" in refused("fasteners", seam, skirt[0]).message


def test_creases_and_buttons_lie_on_their_edges(skirt):
    cut = skirt[0]
    creases = word_of("creases").parameters({"lines": [{"along": SIDES, "angle": 90.0}]})
    (spec,) = effects_of({"creases": creases}, cut)
    assert np.array_equal(spec.edges, np.column_stack([cut.line(SIDES, ""), np.roll(cut.line(SIDES, ""), -1)])[:-1])
    np.testing.assert_allclose(spec.angles, np.pi / 2)
    row = {"first": WAIST[:1], "second": WAIST[1:], "buttons": 3, "closed": 0.25}
    buttons = word_of("fasteners").parameters({"rows": [row]})
    (spec,) = effects_of({"fasteners": buttons}, cut)
    front, back = (cut.line(WAIST[k : k + 1], "") for k in (0, 1))
    assert len(spec.pairs) == 3
    assert np.isin(spec.pairs[:, 0], front).all()
    assert np.isin(spec.pairs[:, 1], back).all()
    np.testing.assert_array_equal(values_of("fasteners", buttons, cut)["closed"], np.float32([0.25] * 3))


SIDE_OF_BACK = [{"panel": "skirt_back", "edge": 3}]
FASTENED = {"first": WAIST[:1], "second": WAIST[1:], "buttons": 3}
ON_BODY = {"first": "skirt_front", "second": "body", "static": 0.4}
TURNED = {"first": WAIST[1:], "second": WAIST[:1], "buttons": 3}
THIRDS = {**FASTENED, "buttons": 9}
"""Of which three are the others."""


@pytest.mark.parametrize(
    ("name", "rows", "first", "again", "value"),
    [
        ("creases", "lines", {"along": SIDES, "angle": 70.0}, {"along": SIDE_OF_BACK, "angle": 70.0}, "angles"),
        ("elastic", "lines", {"along": SIDES, "ratio": 0.7}, {"along": SIDE_OF_BACK, "ratio": 0.7}, "ratio"),
        ("fasteners", "rows", FASTENED, TURNED, "closed"),
    ],
)
def test_what_is_asked_for_twice_along_a_line_is_there_once(name, rows, first, again, value, skirt):
    """The two sides of a seam are one line of the mesh; what acted from both was summed."""

    def told(given):
        spec = asked(name, {rows: given}, skirt[0])[0]
        edges = {"fasteners": lambda: spec.pairs, "creases": lambda: spec.edges}
        found = edges.get(name, lambda: np.vstack([line.edges for line in spec.lines]))()
        values = values_of(name, word_of(name).parameters({rows: given}), skirt[0])[value]
        return np.sort(np.sort(found, axis=1), axis=0), values

    once, values = told([first])
    for given in ([first, again], [first, first], [again, first, again]):
        found, written = told(given)
        np.testing.assert_array_equal(found, once)
        assert len(written) == (len(given) if name == "elastic" else len(values))


@pytest.mark.parametrize(
    ("name", "rows", "first", "other", "place", "named"),
    [
        ("creases", "lines", {"along": SIDES, "angle": 70.0}, {"angle": -70.0}, ".along[0]", "lines[0].along[0]"),
        ("elastic", "lines", {"along": SIDES, "ratio": 0.7}, {"ratio": 0.9}, ".along[0]", "lines[0].along[0]"),
        ("elastic", "lines", {"along": SIDES, "ratio": 0.7}, {"stiffness": 9.0}, ".along[0]", "lines[0].along[0]"),
        ("fasteners", "rows", FASTENED, {**TURNED, "closed": 0.0}, ".closed", "rows[0]"),
        ("fasteners", "rows", FASTENED, {**THIRDS, "closed": 0.0}, ".closed", "rows[0]"),
        ("friction", "pairs", ON_BODY, {"static": 0.5}, ".static", "pairs[0]"),
        ("friction", "pairs", ON_BODY, {"first": "skirt/skirt_front", "static": 0.5}, ".static", "pairs[0]"),
        ("friction", "pairs", ON_BODY, {"kinetic": 0.3}, ".kinetic", "pairs[0]"),
    ],
)
def test_two_that_say_different_things_of_a_line_are_refused(name, rows, first, other, place, named, skirt):
    common = {"friction": {"body": 0.4, "cloth": 0.3}}.get(name, {})
    for side in ({}, {"along": SIDE_OF_BACK}) if "along" in first else ({},):
        told = refused(name, {**common, rows: [first, {**first, **other, **side}]}, skirt[0])
        assert told.place == f"parameters.{rows}[1]{place}"
        assert named in told.message


def test_rows_that_share_buttons_have_them_once(skirt):
    nine, both = ({"rows": rows} for rows in ([THIRDS], [FASTENED, THIRDS]))
    (once,), (shared,) = (asked("fasteners", given, skirt[0]) for given in (nine, both))
    assert {*map(tuple, shared.pairs.tolist())} == {*map(tuple, once.pairs.tolist())}
    assert len(shared.pairs) == len(once.pairs)
    values = values_of("fasteners", word_of("fasteners").parameters(both), skirt[0])["closed"]
    assert len(values) == len(once.pairs)


def test_a_kinetic_coefficient_that_is_not_told_is_as_the_static_one(skirt):
    rows = [ON_BODY, {**ON_BODY, "kinetic": 0.4}]
    assert asked("friction", {"body": 0.4, "cloth": 0.3, "pairs": rows}, skirt[0])


def test_pins_are_set_at_spots_and_edges_of_the_pattern(skirt):
    cut, panels, welded = skirt
    first = panels.first_vertex(panels.panel_names.index("skirt_front"))
    spot = first + 40
    drawn = load_pattern(SKIRT).panels[0]
    assert drawn.name == "skirt_front"
    x, y = panels.uv[spot] * [-1.0 if drawn.clockwise else 1.0, 1.0]
    given = {"points": [{"panel": "skirt_front", "x": x + 0.001, "y": y}], "lines": [{"along": WAIST}]}
    (spec,) = asked("pins", given, cut)
    waist = cut.line(WAIST, "")
    assert spec.led
    assert set(spec.vertices) == {*waist, welded.welded_of_vertex[spot]}
    (held,) = asked("pins", {**given, "to": "room"}, cut)
    assert not held.led


def test_air_is_shut_in_by_pieces_that_close_a_volume():
    ball, faces = icosphere(0.1, 1)
    uv = np.tile([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]], (len(faces), 1, 1))
    panel = (np.arange(len(faces)) >= 40).astype(np.int32)
    cut = Cut.of_mesh(Garment(faces.astype(np.int32), uv, panel, len(ball)), ("upper", "lower"))
    (spec,) = asked("gas", {"share": 1.2}, cut)
    assert isinstance(spec, Gas)
    assert values_of("gas", word_of("gas").parameters({"share": 1.2}), cut)["share"] == 1.2
    open_half = refused("gas", {"panels": ["upper"]}, cut)
    assert "opening" in open_half.message
    assert "pressure" in open_half.remedy


def test_friction_of_pairs_of_pieces(skirt):
    given = {"body": 0.4, "cloth": 0.3, "body_kinetic": 0.2, "pairs": [{"first": "skirt_back", "second": "body"}]}
    (spec,) = effects_of({"friction": word_of("friction").parameters(given)}, skirt[0])
    assert isinstance(spec, Friction)
    np.testing.assert_allclose(spec.static, [[0.3, 0.3, 0.4], [0.3, 0.3, 0.3], [0.4, 0.3, 0.4]])
    np.testing.assert_allclose(spec.kinetic, [[0.3, 0.3, 0.2], [0.3, 0.3, 0.3], [0.2, 0.3, 0.4]])


def test_what_the_body_has_while_cloth_slides_is_told_alone(skirt):
    """All else is as the fabrics have it; the body has nothing to do with itself."""
    cut = replace(skirt[0], pieces=tuple(replace(piece, fabric="denim") for piece in skirt[0].pieces))
    (plain,) = effects_of({"friction": word_of("friction").parameters({"body_kinetic": 0.1})}, cut)
    count = len(cut.pieces)
    np.testing.assert_allclose(plain.static, between_fabrics([FABRICS["denim"]] * count))
    np.testing.assert_allclose(plain.kinetic[:count, count], 0.1)
    np.testing.assert_allclose(plain.kinetic[:count, :count], plain.static[:count, :count])


def test_friction_of_pairs_of_materials(skirt):
    """Denim and jersey on a skin: what is told of two materials holds for their pieces, else the fabrics' own."""
    pieces = skirt[0].pieces
    mixed = (replace(pieces[0], fabric="denim"), *(replace(piece, fabric="cotton_jersey") for piece in pieces[1:]))
    cut = replace(skirt[0], pieces=mixed)
    given = {
        "materials": [
            {"first": "denim", "second": "skin", "static": 0.8, "kinetic": 0.6},
            {"first": "cotton_jersey", "second": "denim", "static": 0.5},
            {"first": "linen", "second": "skin", "static": 0.1},
        ],
    }
    (spec,) = asked("friction", given, cut)
    own = FABRICS["denim"].mu_self, FABRICS["cotton_jersey"].mu_self, FABRICS["cotton_jersey"].mu_body
    np.testing.assert_allclose(spec.static, [[own[0], 0.5, 0.8], [0.5, own[1], own[2]], [0.8, own[2], 0.0]])
    np.testing.assert_allclose(spec.kinetic, [[own[0], 0.5, 0.6], [0.5, own[1], own[2]], [0.6, own[2], 0.0]])
    (pair,) = asked("friction", {**given, "pairs": [{"first": pieces[0].name, "second": "body"}]}, cut)
    assert pair.static[0, 2] == 0.3, "a pair of pieces says more than their materials"
    (alone,) = asked("friction", {"body": 0.9}, cut)
    mean = np.sqrt(own[0] * own[1])
    np.testing.assert_allclose(alone.static, [[own[0], mean, 0.9], [mean, own[1], 0.9], [0.9, 0.9, 0.9]])
    slips = {"materials": [{"first": "denim", "second": "skin", "static": 0.2, "kinetic": 0.3}]}
    assert refused("friction", slips, cut).place == "parameters.materials[0].kinetic"
    unknown = refused("friction", {"materials": [{"first": "denin", "second": "skin"}]}, cut)
    assert unknown.place == "parameters.materials[0].first"
    assert "Did you mean 'denim'?" in unknown.remedy


def test_materials_are_the_fabrics_that_there_are():
    assert set(NAMED) == set(FABRICS)


def test_wind_takes_the_place_of_air_at_rest_and_gusts_of_sleep(sheet):
    calm = {**live(), "wind": word_of("wind").parameters()}
    assert set(left_out(calm)) == {"air_drag"}
    gusty = {**live(), "wind": word_of("wind").parameters({"gusts": 0.3})}
    assert set(left_out(gusty)) == {"air_drag", "sleep"}
    assert in_scene(gusty) == {*live(), "wind"} - {"air_drag", "sleep"}
    assert any(isinstance(effect, Wind) for effect in effects_of(gusty, sheet))


def test_an_effect_that_does_not_suit_the_scene_is_refused_in_its_own_words(sheet):
    scene = Scene(sheet.garment, np.zeros((9, 3)), None, effects=())
    for name, what in (("wind", "shelter"), ("adhesion", "nothing is touched")):
        with pytest.raises(EffectError, match=what) as told:
            check(scene, {name: word_of(name).parameters()}, sheet)
        assert told.value.place.startswith("parameters")
    assert check(scene, {"wind": word_of("wind").parameters({"shelter": 0})}, sheet)


def test_values_are_told_from_what_has_to_be_bound_anew():
    def same(name, before, after):
        word = word_of(name)
        return same_but_values(name, word.parameters(before), word.parameters(after))

    assert same("wind", {"velocity": [1, 0, 0]}, {"velocity": [0, 0, 2]})
    assert not same("wind", {"velocity": [1, 0, 0]}, {"velocity": [0, 0, 2], "shelter": 0})
    assert not same("wind", {"gusts": 0.2}, {"gusts": 0.2, "velocity": [1, 0, 0]})
    lines = [{"along": WAIST, "ratio": ratio} for ratio in (0.9, 0.7)]
    assert same("elastic", {"lines": lines[:1]}, {"lines": lines[1:]})
    assert not same("elastic", {"lines": lines[:1]}, {"lines": lines})
    assert not same("elastic", {"lines": lines[:1]}, {"lines": [{**lines[0], "stiffness": 9}]})
    assert not same("air_drag", {}, {"coefficient": 1})


def test_the_page_has_each_effect_by_both_its_names():
    assert table() in Path("docs/effects.md").read_text(), "make effects-page"
    named = "\n".join(rows())
    for word in BUILT_IN:
        assert f"| `{word.name}`" in named
    assert "`Elastic(lines)`, `ElasticLine(edges, ratio, stiffness)` | `elastic`" in named
