"""A few of the hard cases, small and shortened, judged by every limit; `make hard` runs all of them whole."""

from dataclasses import replace

import numpy as np
import pytest
from harness.judgement import UNASKED
from harness.one import run_one
from harness.scene import Ask
from harness.wearer import BODY
from scenes import named
from scenes.poses import swung

from tryon_solver.body.pose import world_from_joint
from tryon_solver.settings import PRESETS

VERTICES = 150
TO_REST = 2.6  # s: long enough for all that is asked of rest
WINDOW = 0.4  # s


def played(name, seconds, preset="live"):
    """The case's figures; ipctk was asked about every frame and every move."""
    result = run_one(named(name), Ask(VERTICES, PRESETS[preset], seconds=seconds), tell=lambda _text: None)
    assert result["failure"] == ""
    assert result["moves"] > 0
    return result


@pytest.mark.parametrize(
    "name", ["zero_gravity", *(pytest.param(name, marks=pytest.mark.long) for name in ("corner", "buffers_of_16"))]
)
def test_a_hard_case_and_the_rest_after_it(name):
    result = played(name, TO_REST)
    assert [b["line"] for b in result["broken"]] == []
    assert result["moves"] > result["frames"]
    assert result["asked"] == result["frames"] + 1
    assert result["trembling"] is not None


def test_sheets_that_pass_through_each_other_between_two_frames_are_found():
    """With contact switched off, by the preset whose frames are longest, and however few frames are to be asked about:
    two open sheets have passed each other when the second frame is shown."""

    def without_contact(ask):
        run = named("zero_gravity").set_up(ask)
        run.sim.touching = ()
        return run

    scene = replace(named("zero_gravity"), set_up=without_contact)
    result = run_one(scene, Ask(VERTICES, PRESETS["draft"], seconds=0.5), every=4, tell=lambda _text: None)
    assert result["not_free"] > 0


def test_a_long_way_beside_what_is_a_micrometre_thick_is_told_to_be_free():
    """In the fourth frame slivers of a fabric of a micrometre go 14 cm: the toolkit can't tell of pairs that are far
    from each other on each part of that way."""
    result = played("slivers_thin_fabric", 0.3, "draft")
    assert result["moves"] > 20
    assert result["not_free"] == 0


@pytest.mark.parametrize("name", ["swept_by_plate", pytest.param("at_100m", marks=pytest.mark.long)])
def test_short_window_of_a_hard_case(name):
    result = played(name, WINDOW)
    assert [b["limit"] for b in result["broken"]] == [UNASKED]
    assert result["asked"] == result["frames"] + 1


@pytest.mark.long
def test_a_garment_falls_asleep_and_is_woken():
    result = played("asleep_and_woken", 10.0, "draft")
    assert result["unclean"] == 0
    assert result["asleep"] > 1.0
    assert 0 < result["waking"] <= 0.1
    assert not {b["limit"] for b in result["broken"]} & {"asleep, and yet it moved or worked", "no longer worn"}


@pytest.mark.parametrize("name", ["slivers_refused", "slivers_thinner_than_fabric", "unreferenced_vertex"])
def test_what_cannot_be_simulated_is_refused_by_name(name):
    result = run_one(named(name), Ask(VERTICES, seconds=0.1), tell=lambda _text: None)
    assert result["failure"] == ""
    assert result["refused"].startswith("GarmentError: ")


def test_the_swung_hand_is_at_ten_metres_a_second():
    hand, dt = BODY.index_of["left_hand"], 1e-3
    places = np.array([world_from_joint(BODY, swung(t, 3.0))[hand, :3, 3] for t in np.arange(0, 2.0, dt)])
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() / dt == pytest.approx(10.0, rel=0.03)
