"""The error of a step is measured, and told, and its estimate is held to it."""

from xml.etree import ElementTree

import pytest
from accuracy_case import AccuracyCase, presets, scenes, sweep
from accuracy_table import broken, markdown, plot, strictly_within, within
from one_step_errors import errors

from tryon_solver.settings import PRESETS


def test_a_converged_step_ends_where_the_reference_does_and_a_short_one_does_not():
    """Of a walking T-shirt of few vertices; told is each state as it comes."""
    case, told = AccuracyCase("tshirt", "walk", 1 / 60, vertices=150, states=2), []
    rows = errors(case, {"draft": PRESETS["draft"], "passes 20": sweep()["passes 4"]}, told.append)
    assert [len(its) for its in rows.values()] == [2, 2]
    assert len(told) == 2
    for draft, converged in zip(*rows.values()):
        assert converged["error"] < 0.05, "mm"
        assert draft["error"] > 5 * converged["error"]
        assert draft["largest"] > draft["error"]
        assert draft["error"] / 6 < draft["estimate"] < 6 * draft["error"]
        assert draft["ms"] > 0
        assert not draft["void"]


def rows(*pairs):
    return [
        {"error": error, "estimate": estimate, "largest": 3 * error, "ms": 5.0, "newton": 4, "void": False}
        for error, estimate in pairs
    ]


def test_estimates_are_counted():
    four = rows((1.0, 1.9), (1.0, 0.4), (0.01, 0.04), (2.0, 2.0))
    assert within(four, 2.0) == 0.75
    assert strictly_within(four, 2.0) == 0.5
    assert within(four, 4.0) == strictly_within(four, 4.0) == 1.0


def found(draft, live, held_out=True):
    case = AccuracyCase("skirt", "walk", 1 / 60, held_out=held_out)
    about = {"commit": "none", "machine": "none"}
    return {case.name: {"about": about, "case": case.plain(), "rows": {"draft": draft, "live": live}}}


def test_the_page_tells_errors_and_what_does_not_hold():
    good = found(rows((1.0, 1.2), (0.8, 0.5)), rows((0.1, 0.1), (0.2, 0.3)))
    assert broken(good) == []
    page = markdown(good)
    assert "| skirt, walk (held out) | 60 | draft | 0.9000 / 0.9800 / 1.000 |" in page
    assert "All holds." in page
    assert ElementTree.fromstring(plot(good)).tag.endswith("svg")
    bad = found(rows((0.1, 0.1), (0.1, 0.9)), rows((0.3, 0.3), (0.3, 0.02)))
    assert len(broken(bad)) == 3, "x2, x4, and live is further off"
    assert broken(found(rows((0.3, 3.0)), rows((0.2, 0.2)), held_out=False)) == [], "it is no promise for these"


@pytest.mark.parametrize("rate", [30, 60, 120])
def test_presets_take_steps_that_they_may(rate):
    may = {30: ["draft"], 60: ["draft", "live"], 120: ["draft", "live", "fit", "reference"]}
    assert list(presets(1 / rate)) == may[rate]
    cases = scenes(1 / rate)
    assert len(cases) >= 6
    assert 2 <= sum(case.held_out for case in cases) < len(cases)
