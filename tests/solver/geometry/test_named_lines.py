"""Names of pieces and lines along edges, of a garment alone and of several that are worn together."""

import numpy as np
import pytest

from tryon_solver.effect_words.fields import EffectError
from tryon_solver.effect_words.rules import together, with_pieces
from tryon_solver.effect_words.table import word_of
from tryon_solver.geometry.named_lines import Cut
from tryon_solver.geometry.outfit import put_together
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.weld import weld
from tryon_solver.worn_effects import effects_of

DEMO = "server/tryon_server/demo/patterns"
WAIST = [{"panel": "skirt_front", "edge": 2}, {"panel": "skirt_back", "edge": 2}]


def cut_of(garment, name):
    pattern = load_pattern(f"{DEMO}/{garment}.json")
    panels = mesh_pattern(pattern, 0.06)
    welded = weld(panels)
    counts = [len(panel.edges) for panel in pattern.panels]
    return Cut.of_pattern(welded.garment(), panels, welded, counts, name)


def worn(*cuts):
    return Cut.together(put_together([cut.pieces[0].garment for cut in cuts], [cut.garment for cut in cuts]), cuts)


@pytest.fixture(scope="module")
def skirt():
    return cut_of("skirt", "skirt")


@pytest.fixture(scope="module")
def tshirt():
    return cut_of("tshirt", "tshirt")


def test_a_line_of_one_garment_is_found_among_others(skirt, tshirt):
    both = worn(tshirt, skirt)
    first = both.garment.layers[1].vertices.start
    alone, among = skirt.mesh_edges(WAIST, ""), both.mesh_edges(WAIST, "")
    assert first > 0
    assert len(alone) > 5
    np.testing.assert_array_equal(among, alone + first)
    full = [{**edge, "panel": f"skirt/{edge['panel']}"} for edge in WAIST]
    np.testing.assert_array_equal(both.mesh_edges(full, ""), among)
    np.testing.assert_array_equal(skirt.mesh_edges(full, ""), alone)
    np.testing.assert_array_equal(both.placed[first:], skirt.placed)


def test_pieces_are_told_with_their_garments_where_there_are_several(skirt, tshirt):
    both = worn(skirt, tshirt)
    assert skirt.panel_names == ("skirt_front", "skirt_back")
    assert both.panel_names[:3] == ("skirt/skirt_front", "skirt/skirt_back", "tshirt/front")
    assert both.panel("front", "") == both.panel("tshirt/front", "") == 2
    assert both.full_name("front") == tshirt.full_name("front") == "tshirt/front"
    assert both.full_name("collar of another") == "collar of another"


def test_a_name_that_two_garments_have_asks_whose(tshirt):
    both = worn(tshirt, cut_of("tshirt", "over"))
    with pytest.raises(EffectError) as told:
        both.panel("front", "parameters.panels[0]")
    assert "tshirt and over" in told.value.message
    assert "tshirt/front or over/front" in told.value.remedy
    assert told.value.place == "parameters.panels[0]"
    assert both.full_name("front") == "front"


def test_of_two_garments_the_lines_are_put_together(skirt, tshirt):
    both = worn(skirt, tshirt)
    hem = [{"panel": "front", "edge": 0}]
    own = [
        {"elastic": word_of("elastic").parameters({"lines": [{"along": along, "ratio": ratio}]})}
        for along, ratio in ((WAIST, 0.8), (hem, 0.9))
    ]
    named = [
        {name: with_pieces(name, parameters, cut.full_name) for name, parameters in effects.items()}
        for cut, effects in zip((skirt, tshirt), own)
    ]
    found = together(named)
    assert [row["along"][0]["panel"] for row in found["elastic"]["lines"]] == ["skirt/skirt_front", "tshirt/front"]
    assert own[0]["elastic"]["lines"][0]["along"] == WAIST, "what is given stays as it is"
    (spec,) = effects_of(found, both)
    assert [line.ratio for line in spec.lines] == [0.8, 0.9]
    start = both.garment.layers[1].vertices.start
    assert spec.lines[0].edges.max() < start <= spec.lines[1].edges.min()


def test_a_garment_without_a_pattern_has_pieces_and_no_edges(skirt, tshirt):
    both = worn(Cut.of_mesh(tshirt.garment, tshirt.panel_names, "mesh"), skirt)
    assert both.panel("mesh/front", "") == 0
    with pytest.raises(EffectError, match="no pattern"):
        both.mesh_edges([{"panel": "front", "edge": 0}], "")
    assert len(both.mesh_edges(WAIST, "")) == len(skirt.mesh_edges(WAIST, ""))
