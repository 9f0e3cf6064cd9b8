"""The estimated error of a step: small where a step is solved to its end, larger the sooner it is left."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from against_reference import rms, simulation_at
from contact_scenes import DT, square_on_sphere

from tryon_solver import step
from tryon_solver.baselines.newton_ipc import Motion
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import estimate

LIVE = PRESETS["live"]
CONVERGED = replace(LIVE, contact_passes=20)


@pytest.fixture(scope="module")
def falling():
    """A square that has just met a ball, as it was in the solver: where it was, and what takes a step from there."""
    case = square_on_sphere()
    sim = build(case.scene, LIVE, "cpu", case.pose_at(0))
    for k in range(1, 13):
        sim.advance(case.pose_at(k), k * DT)
    x = np.vstack([sim.cloth_positions(), sim.body_positions()]).astype(np.float64)
    motion = Motion(x, sim.state.v.numpy().astype(np.float64), case.pose_at(12))

    def step(settings):
        then = simulation_at(case, motion, settings)
        report = then.advance(case.pose_at(13), DT)
        return report.error, then.cloth_positions()

    return step


def test_it_falls_with_the_iterations_and_is_of_the_errors_size(falling):
    _, true = falling(CONVERGED)
    last = np.inf
    for iterations in (1, 2, 4):
        left = replace(LIVE, correction_iterations=iterations, second_iterations=0, correction_extensions=0)
        error, x = falling(left)
        off = rms((x - true).astype(np.float64))
        assert 0 < error < last
        assert off / 8 < error < 8 * off
        last = error


def test_what_does_not_end_by_its_budget_has_a_scale_of_its_own(falling, monkeypatch):
    asked = replace(LIVE, accuracy=1e-4)
    told, _ = falling(asked)
    monkeypatch.setattr(estimate, "DIALLED_SCALE", estimate.SCALE)
    as_others, _ = falling(asked)
    assert told > 1e-6, "m"
    assert as_others / told == pytest.approx(estimate.SCALE / 2.0, rel=1e-4)
    monkeypatch.undo()
    assert estimate.scale_of(LIVE) == estimate.SCALE != estimate.DIALLED_SCALE
    for bought in ({"deadline": 0.1}, {"accuracy": 1e-4}, {"accuracy": 1e-4, "deadline": 0.1}):
        assert estimate.scale_of(replace(LIVE, **bought)) == estimate.DIALLED_SCALE


def test_a_step_that_was_solved_to_its_end_is_told_so(falling):
    solved, _ = falling(CONVERGED)
    assert solved < 1e-5, "m"


@pytest.mark.parametrize("way", [0.0, 3e-3])
def test_it_is_of_what_is_left_and_of_the_way(way):
    """Root mean squares over four vertices; a step that went nowhere is told of by what is left alone."""
    left, count = 2e-5, 4
    squared, way_squared, error = (wp.array([v], dtype=wp.float32) for v in (count * left**2, count * way**2, 0.0))
    inputs = [squared, way_squared, count, estimate.SCALE, estimate.OF_WAY]
    wp.launch(estimate.take_larger_kernel, 1, inputs, [error], device="cpu")
    expected = estimate.SCALE * left ** (1 - estimate.OF_WAY) * np.hypot(way, left) ** estimate.OF_WAY
    assert error.numpy()[0] == pytest.approx(expected, rel=1e-5)
    assert (way == 0) == (error.numpy()[0] == pytest.approx(estimate.SCALE * left, rel=1e-5))


def test_of_several_steps_the_largest_is_told(monkeypatch):
    given = iter([0.25, 1.0, 0.5])

    def scaled(sim):
        monkeypatch.setattr(estimate, "SCALE", next(given))
        return actual(sim)

    case = square_on_sphere()
    sim = build(case.scene, replace(LIVE, largest_step=DT / 3), "cpu", case.pose_at(0))
    actual, told = step.estimate_error, []

    def estimate_error(sim):
        scaled(sim)
        told.append(float(sim.error.numpy()[0]))

    monkeypatch.setattr(step, "estimate_error", estimate_error)
    report = sim.advance(case.pose_at(1), DT)
    assert report.steps == 3
    assert told == sorted(told)
    assert report.error == told[-1] > told[0] > 0
