"""Figures that have to be another case's."""

import pytest
from harness.alike import BY, held_to
from scenes import SCENES, named

FIGURES = dict.fromkeys(BY, 0.5)


def results(**changed):
    """A case and the one it has to be like, whose figures are changed so."""
    return [
        {"name": "here", "frames": 60, "broken": [], **FIGURES},
        {"name": "there", "frames": 60, "broken": [], **FIGURES, **changed},
    ]


def broken(**changed):
    found = results(**changed)
    held_to(found, {"there": "here"})
    assert found[0]["broken"] == []
    return [b["line"].partition(",")[0] for b in found[1]["broken"]]


@pytest.mark.parametrize("figure", BY)
def test_a_figure_that_differs_is_named(figure):
    assert broken() == []
    assert broken(**{figure: 0.5 + 0.9 * BY[figure]}) == []
    assert broken(**{figure: 0.5 + 1.1 * BY[figure]}) == [f"{figure} not as in here"]
    assert broken(**{figure: None}) == [f"{figure} not as in here"]
    assert broken(**{figure: float("nan")}) == [f"{figure} not as in here"]


def test_nothing_is_said_of_what_was_not_played():
    found = results(lag_max=9.0)
    held_to(found[1:], {"there": "here"})
    assert found[1]["broken"] == []
    refused = [{"name": "here", "broken": []}, found[1]]
    held_to(refused, {"there": "here"})
    assert found[1]["broken"] == []


def test_cases_are_held_to_cases_that_there_are():
    held = {scene.name: scene.same_as for scene in SCENES if scene.same_as}
    assert held == {"tracked_at_100m": "tracked_at_0m", "tracked_at_10km": "tracked_at_0m"}
    assert all(named(name) for name in held.values())
