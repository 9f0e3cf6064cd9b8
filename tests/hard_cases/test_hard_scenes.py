"""A few of the hard cases in windows of a second at most, judged by every limit; `make hard` runs all of them whole."""

import pytest
from harness.one import run_one
from harness.scene import Ask
from scenes import named

VERTICES = 150
WINDOWS = {"buffers_of_16": 0.5, "zero_gravity": 0.5, "corner": 0.6, "swept_by_plate": 0.4, "at_100m": 0.4}  # s


@pytest.mark.parametrize("name", WINDOWS)
def test_short_window_of_a_hard_case(name):
    result = run_one(named(name), Ask(VERTICES, seconds=WINDOWS[name]), tell=lambda _text: None)
    assert result["failure"] == ""
    assert [b["line"] for b in result["broken"]] == []
    assert result["moves"] > result["frames"]
    assert result["asked"] == result["frames"] + 1


@pytest.mark.parametrize("name", ["slivers_refused", "slivers_thinner_than_fabric", "unreferenced_vertex"])
def test_what_cannot_be_simulated_is_refused_by_name(name):
    result = run_one(named(name), Ask(VERTICES, seconds=0.1), tell=lambda _text: None)
    assert result["failure"] == ""
    assert result["refused"].startswith("GarmentError: ")
