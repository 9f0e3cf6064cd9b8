"""What dressing says when a garment is refused: tight, crowded, or narrow here and wide there; never two at odds."""

from types import SimpleNamespace

import numpy as np
import pytest

from tryon_solver.dressing.fit import CrowdedError, TightError, check_rest, with_opening
from tryon_solver.dressing.opening import Opening
from tryon_solver.materials.fabric import FABRICS

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
