"""What dressing says when a garment is refused: tight, crowded, or narrow here and wide there; never two at odds."""

from types import SimpleNamespace

import numpy as np
import pytest
from worn_garment import DEMO

from tryon_solver.body.model import default_body
from tryon_solver.dressing.dress import dress
from tryon_solver.dressing.fit import (
    LIMB,
    CrowdedError,
    TightError,
    bent,
    check_rest,
    longest_edge,
    with_mesh,
    with_opening,
)
from tryon_solver.dressing.opening import Opening
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import PRESETS

JERSEY = FABRICS["cotton_jersey"]  # bears 15 %
PANELS = ("gown", "band")


def at_rest(stretch, lag=0.0, retries=0, overlapping=0):
    """A simulation that ended so."""
    return SimpleNamespace(
        scene=SimpleNamespace(
            fabric_of_face=lambda: [JERSEY, JERSEY], garment=SimpleNamespace(panel_of_face=np.array([0, 1]))
        ),
        reported=SimpleNamespace(body_lag=lag, retries=retries, overlapping=overlapping),
        stretches=lambda: np.array([1.0, stretch]),
    )


ENDINGS = {"presses": {"lag": 0.012}, "voids": {"retries": 1}, "under its offset": {"overlapping": 3}}


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_gown_that_is_hardly_stretched_is_crowded_and_not_told_to_be_enlarged(ending):
    with pytest.raises(CrowdedError) as caught:
        check_rest(at_rest(1.03, **ENDINGS[ending]), PANELS)
    assert "stretched most, by 3 %, in band: cotton_jersey bears 15 %" in caught.value.message
    assert "not too tight" in caught.value.message
    assert "nlarge" not in caught.value.remedy
    assert "larger" not in caught.value.remedy


@pytest.mark.parametrize("ending", ENDINGS)
def test_what_is_taut_is_too_tight(ending):
    with pytest.raises(TightError) as caught:
        check_rest(at_rest(1.12, **ENDINGS[ending]), PANELS)
    assert "too tight for this body" in caught.value.message
    assert caught.value.remedy.startswith("Enlarge band there")


def test_what_is_stretched_beyond_its_limit_is_too_tight_and_what_rests_is_worn():
    with pytest.raises(TightError, match="the body stretches band by 40 %"):
        check_rest(at_rest(1.4), PANELS)
    check_rest(at_rest(1.12), PANELS)


def test_what_is_tight_below_and_wide_above_says_both_and_that_no_size_mends_it():
    tight = TightError("the body stretches hem by 40 %", "panels.hem", "Enlarge hem there, or choose a larger size")
    wide = Opening(("band",), 1.09, 0.843, 0.775, 0.99, 0.6)
    said = with_opening(tight, wide)
    assert said.place == "panels.hem"
    assert said.message.startswith(tight.message)
    assert "its opening of band, though, is 6.8 cm too wide" in said.message
    assert "fits in no size" in said.message
    assert "choose a larger size" not in said.remedy
    assert "narrow its opening of band" in said.remedy
    for holds in (None, Opening(("band",), 1.09, 0.77, 0.775, 0.99, 0.6), Opening(("b",), -0.1, 0.8, 0.0, None, -0.3)):
        assert with_opening(tight, holds) is tight


def test_how_far_edges_are_bent_around_a_limb_is_that_of_tangents_against_their_arc():
    """A regular polygon around a circle: 8 sides touch one of radius `LIMB`, each 2 r tan(pi / 8) long over an arc of
    r pi / 4."""
    arc = LIMB * np.pi / 4
    assert bent(arc) == pytest.approx(2 * LIMB * np.tan(np.pi / 8) / arc)
    assert bent(4 * LIMB) == np.inf
    for fabric in FABRICS.values():
        longest = longest_edge(fabric)
        assert bent(longest) == pytest.approx(fabric.strain_limit, rel=1e-9)


def test_a_mesh_too_coarse_for_its_fabric_is_told_with_the_edges_that_are_not():
    """Denim at edges of 6 cm, which bears 5 %: a jersey bends around an arm at that."""
    error = TightError("too tight", "panels.front", "Enlarge it")
    assert with_mesh(error, FABRICS["denim"], 0.03) is error
    assert with_mesh(error, FABRICS["cotton_jersey"], 0.06) is error
    told = with_mesh(error, FABRICS["denim"], 0.06)
    assert isinstance(told, TightError)
    assert "too coarse for denim: edges of 6.0 cm" in told.message
    assert told.remedy.startswith("Choose an edge length of at most 3.7 cm")
    assert told.place == "panels.front"


def test_a_tshirt_of_denim_at_edges_of_seven_centimetres_is_refused_for_its_mesh():
    pieces = mesh_pattern(load_pattern(DEMO / "patterns" / "tshirt.json"), 0.07)
    with pytest.raises(TightError, match="its mesh, though, is too coarse for denim"):
        dress(pieces, default_body(), FABRICS["denim"], PRESETS["draft"])
