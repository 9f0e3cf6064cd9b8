"""A correction whose budget runs out in a bad step does not end in it."""

from dataclasses import replace

import numpy as np
import pytest
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import build
from tryon_solver.stepping import correct, estimate, newton
from tryon_solver.stepping.progress import Progress

DT = 1 / 60


def laid_on_ball(settings):
    """A square just above a ball."""
    garment, x = sheet(11, 11, 0.4, 0.4)
    ball, faces = icosphere(0.17, 2)
    scene = Scene(garment, x + np.array([0, 0.174, 0]), rigid_body(ball, faces), fabric(), WORN)
    return build(scene, settings, "cpu", STILL)


def overshooting_at(number, monkeypatch):
    """From now on the correction's direction of that number is 30 times as long and turned round; the list grows by
    each of its directions."""
    solve, calls = newton.pcg.solve, []

    def overshooting(cg, matrix, blocks, gradient, direction, at_most, *others):
        done = solve(cg, matrix, blocks, gradient, direction, at_most, *others)
        if at_most != estimate.ITERATIONS:  # what estimates the error goes nowhere
            calls.append(done)
        if len(calls) == number:
            direction.assign(-30 * direction.numpy())
        return done

    monkeypatch.setattr(newton.pcg, "solve", overshooting)
    return calls


@pytest.mark.parametrize(("iterations", "calm"), [(2, True), (1, False)])
def test_an_overshooting_last_step_is_not_taken(iterations, calm, monkeypatch):
    """Every second Newton direction 30 times as long and turned round, and no move comes back (overshoot.py); a budget
    of one has no step before its last."""
    monkeypatch.setattr(correct, "retreat_if_overshot", lambda _, measure, *__: measure())
    sim = laid_on_ball(Settings(correction_iterations=iterations, correction_extensions=0))
    for k in range(20):
        sim.advance(STILL, (k + 1) * DT)
    before = sim.cloth_positions().copy()
    calls = overshooting_at(iterations, monkeypatch)
    sim.advance(STILL, 21 * DT)
    assert len(calls) == iterations
    moved = np.linalg.norm(sim.cloth_positions() - before, axis=1).max()
    assert (0 < moved < 0.02) == calm


def test_a_budget_that_ends_astray_is_extended_until_it_is_back(monkeypatch):
    """The third of four Newton directions 30 times as long and turned round."""
    sim = laid_on_ball(Settings(correction_iterations=4))
    for k in range(20):
        sim.advance(STILL, (k + 1) * DT)
    before = sim.cloth_positions().copy()
    calls = overshooting_at(3, monkeypatch)
    sim.advance(STILL, 21 * DT)
    assert 4 < len(calls) <= 16
    assert 0 < np.linalg.norm(sim.cloth_positions() - before, axis=1).max() < 0.02
    assert not sim.went_back


@pytest.mark.parametrize(
    ("passes", "nearest", "steps_back"), [(1, 0.11, [0, 2, 4]), (1, 0.09, [0, 1, 2, 3, 4]), (3, 0.11, [])]
)
def test_a_budget_that_ends_astray_goes_back_but_not_twice_in_a_row_to_where_it_began(
    passes, nearest, steps_back, monkeypatch
):
    """Every budget ends so here, and was nearest to balance at so many times of where it began. With more contact
    passes to come, the next goes on from there."""
    sim = laid_on_ball(Settings(correction_iterations=1, correction_extensions=0, contact_passes=passes))
    step, went_back = 0, []

    def ended(outcome):
        return replace(outcome, strayed=True, began=1.0, least=nearest, last=nearest)

    read = Progress.read
    monkeypatch.setattr(Progress, "read", lambda self, *told: ended(read(self, *told)))
    monkeypatch.setattr(correct, "go_back_to_least", lambda _: went_back.append(step))
    for step in range(5):
        sim.advance(STILL, (step + 1) * DT)
    assert went_back == steps_back
