"""Who may be led out of the region without a search: by what is near enough, and after calm steps alone."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from contact_scenes import DT, square_on_sphere

from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import correct, outgrown


def falling(settings, device="cpu"):
    case = square_on_sphere()
    return case, build(case.scene, settings, device, case.pose_at(0))


@pytest.mark.gpu
def test_by_how_much_follows_from_what_is_near_enough():
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    _, sim = falling(PRESETS["draft"], "cuda:0")
    near, each, squares = outgrown.let_go(sim)
    assert near == pytest.approx(PRESETS["draft"].correction_nearness * sim.dt)
    assert each == pytest.approx(outgrown.EDGES * sim.mean_edge)
    assert np.sqrt(squares / sim.cloth_count) == pytest.approx(outgrown.SHARE)
    asked = falling(replace(PRESETS["live"], accuracy=2e-4), "cuda:0")[1]
    assert outgrown.let_go(asked)[0] == pytest.approx(2e-4)
    assert outgrown.let_go(falling(PRESETS["live"], "cuda:0")[1])[0] == 0.0, "where nothing says what is near enough"


def test_a_processor_lets_none_go():
    assert outgrown.let_go(falling(PRESETS["draft"])[1]) == outgrown.NONE


def test_only_after_a_step_that_came_near_within_its_budget(monkeypatch):
    """Not in the first step, nor in the one after a blow, for which the budget is too small."""
    case, sim = falling(replace(PRESETS["draft"], largest_step=DT))
    asked, calm = [], []
    real = correct.let_go
    monkeypatch.setattr(correct, "let_go", lambda sim: asked.append(1) or real(sim))
    for k in range(1, 25):
        asked.clear()
        before = sim.calm
        report = sim.advance(case.pose_at(k), k * DT)
        assert bool(asked) == before
        calm.append(sim.calm)
        if report.newton_iterations > PRESETS["draft"].correction_iterations:
            assert not sim.calm
    assert True in calm
