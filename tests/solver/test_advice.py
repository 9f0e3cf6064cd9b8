"""What is said when the figures of a step are out of bounds, and that nothing is said while they are not."""

from dataclasses import replace

import numpy as np
import pytest
from small_scenes import sheet

from tryon_solver.advice import advise, nearest_limit, unmet
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.results import Counters
from tryon_solver.scene import Gravity, Pins, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

DENIM = FABRICS["denim"]  # bears 5 %
JERSEY = FABRICS["cotton_jersey"]  # stretches most
DRAFT = PRESETS["draft"]


def stretches(most: float, share: float = 1.0, count: int = 5000) -> np.ndarray:
    """(count,) of which a share is stretched that far and the others not at all."""
    held = np.ones(count)
    held[: round(share * count)] = most
    return held


def test_nothing_is_said_of_what_is_in_bounds():
    assert advise(Counters(), 0.0, DENIM, stretches(1.05), 10e-3) == ""
    assert advise(Counters(), 0.0, DENIM, stretches(1.05 * 1.09, share=1e-3), 0.0) == ""


@pytest.mark.parametrize(("most", "share"), [(1.05 * 1.03, 2e-3), (1.05 * 1.11, 2e-4), (1.35, 0.5)])
def test_fabric_beyond_its_limit_is_told_with_what_to_try(most, share):
    said = advise(Counters(), 0.0, DENIM, stretches(most, share), 0.0)
    assert f"stretched by up to {100 * (most - 1):.0f} % (denim bears 5 %)" in said
    assert "too tight for this motion" in said
    for remedy in ("cotton_jersey: 15 %", "a larger size", "preset"):
        assert remedy in said
    assert "skin" not in said


def test_surface_far_behind_the_skin_is_told_with_what_to_try():
    said = advise(Counters(), 0.0, DENIM, stretches(1.0), 22.4e-3)
    assert "22 mm behind the skin" in said
    assert "caught between parts of the body" in said
    assert "a larger size" in said
    assert "stretched by" not in said


def test_effects_that_pull_are_named():
    said = advise(Counters(), 0.0, JERSEY, stretches(1.5), 0.0, acting=("friction", "pins", "elastic"))
    assert "the garment is pulled by what acts on it (elastic, pins), or too tight for this motion, or caught" in said
    assert "pulled" not in advise(Counters(), 0.0, JERSEY, stretches(1.5), 0.0, acting=("friction",))


@pytest.mark.parametrize(("acceleration", "named"), [(-9.81, False), (50.0, True)])
def test_a_weight_is_named_where_it_is_no_usual_one(acceleration, named):
    garment, x = sheet(3, 3, 0.1, 0.1)
    held = Pins(np.arange(9, dtype=np.int32), 1e5)
    sim = build(Scene(garment, 1.3 * x, effects=(Gravity((0.0, acceleration, 0.0)), held)))
    said = sim.advance(None, 1 / 60).advice
    assert "stretched by" in said
    assert ("(pins, gravity)" in said) is named


def test_the_fabric_that_stretches_most_is_not_offered_another_one():
    said = advise(Counters(), 0.0, JERSEY, stretches(1.5), 0.0)
    assert "bears 15 %" in said
    assert "a fabric that stretches more" not in said


def test_everything_is_told_at_once():
    said = advise(Counters(retries=3, reverts=2), 0.25, DENIM, stretches(1.35), 22e-3)
    for part in ("3 steps were void", "in 2 of them", "0.25 s of motion", "35 %", "and the cloth holds", "22 mm"):
        assert part in said


def test_a_report_of_cloth_pulled_out_of_its_length_carries_the_advice():
    garment, x = sheet(9, 9, 0.2, 0.2)
    sim = build(Scene(garment, x, None, effects=(Gravity(),)))
    assert sim.advance(None, 1 / 60).advice == ""
    sim.state.x.assign((1.6 * sim.state.x.numpy()).astype(np.float32))
    report = sim.report()
    assert report.max_stretch == pytest.approx(1.6, rel=1e-2)
    assert f"stretched by up to {100 * (report.max_stretch - 1):.0f} %" in report.advice


def test_of_several_fabrics_the_one_nearest_its_limit_is_told():
    """Jersey at 1.10 is within its 1.15, denim at 1.10 is beyond its 1.05: shares of the limits count."""
    fabric, stretch = nearest_limit([JERSEY, DENIM, JERSEY], np.array([1.12, 1.10, 1.0]))
    assert fabric is DENIM
    np.testing.assert_allclose(stretch, [1.12 / 1.15 * 1.05, 1.10, 1.0 / 1.15 * 1.05])
    assert "denim bears 5 %" in advise(Counters(), 0.0, fabric, stretch, 0.0)


def test_a_missed_deadline_is_told_with_what_to_do():
    said = unmet(DRAFT, 1e-3, 0.0021)
    assert said == "the deadline was missed by 2.1 ms: allow more time, or choose a coarser mesh"
    assert advise(Counters(), 0.0, DENIM, stretches(1.0), 0.0, said) == said
    assert unmet(DRAFT, 1e-3, 0.0) == ""


def test_an_error_far_above_the_one_asked_for_is_told():
    asked = replace(DRAFT, accuracy=8e-5)
    assert unmet(asked, 1.5e-3, 0.0).startswith("an error of 0.08 mm was not reached, it is 1.5 mm: shorter steps")
    assert unmet(asked, 3e-4, 0.0) == ""
    in_time = replace(asked, deadline=0.033)
    said = unmet(in_time, 1.5e-3, 0.0)
    assert said.startswith("an error of 0.08 mm was not reached in 33 ms, it is 1.5 mm: more time, shorter steps")
    assert unmet(in_time, 3e-4, 0.0) == ""


def test_passes_that_end_before_they_have_converged_are_told_where_they_were_to():
    reference = PRESETS["reference"]
    short, long = 0.5 * reference.correction_tolerance, 0.02
    said = "20 passes did not converge: Newton's ways are 0.02 m/s long yet, and the estimated error is 0.06 mm"
    assert unmet(reference, 6e-5, 0.0, long).startswith(said)
    assert unmet(reference, 6e-5, 0.0, short) == ""
    assert unmet(DRAFT, 6e-5, 0.0, long) == "", "one pass ends by its budget"
    assert unmet(replace(reference, accuracy=1e-4), 6e-5, 0.0, long) == "", "it is as near as was asked for"
