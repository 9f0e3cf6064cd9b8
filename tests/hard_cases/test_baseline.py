"""Other solvers play the telling cases: their figures, and what they can't be given."""

import numpy as np
import pytest
from harness.baseline import ByBaseline
from harness.one import run_one
from harness.others import TELLING
from harness.scene import Ask
from scenes import SCENES, named

QUIET = {"tell": lambda _text: None}


@pytest.mark.long
@pytest.mark.parametrize("solver", ["xpbd", "chebyshev"])
def test_a_case_is_played_and_judged_by_another_solver(solver):
    ask = Ask(vertices=60, seconds=0.2)
    found = run_one(named("corner"), ask, 1, solver=solver, **QUIET)
    assert not found["failure"]
    assert found["frames"] == found["asked"] - 1 == 12
    assert found["growth"] is None
    assert found["speed_at_end"] > 0.5  # m/s, falling
    assert found["moves"] == 0


def test_the_cloth_is_where_the_other_solver_has_it():
    run = named("corner").set_up(Ask(vertices=60))
    by = ByBaseline(run, "xpbd")
    start = by.cloth().copy()
    np.testing.assert_allclose(start, run.sim.cloth_positions(), atol=1e-7)
    by.advance(0.02)  # s, in which drag takes 6 % of the way
    fallen = 0.5 * 9.81 * 0.02**2
    assert (start - by.cloth())[:, 1].mean() == pytest.approx(fallen, rel=0.12)
    np.testing.assert_allclose(start, run.sim.cloth_positions(), atol=1e-7)


INEXPRESSIBLE = [("swept_by_plate", "posed by joints"), ("weight_ratio_1e6", "one fabric"), ("knot_pulled", "drives")]


@pytest.mark.parametrize(("case", "why"), INEXPRESSIBLE)
def test_what_it_has_no_means_for_is_told(case, why):
    scene = next(scene for scene in SCENES if scene.name.startswith(case))
    found = run_one(scene, Ask(vertices=100, seconds=0.1), solver="xpbd", **QUIET)
    assert "not expressible" in found["failure"]
    assert why in found["failure"]


def test_the_telling_cases_are_cases():
    assert set(TELLING) <= {scene.name for scene in SCENES}
