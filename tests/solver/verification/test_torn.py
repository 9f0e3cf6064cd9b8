"""Cloth that a correction leaves torn: it is done again, until the budget for that leaves it so."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import correct


def laid_on_ball(torn):
    """A square just above a ball, and how it lies in its pattern."""
    garment, x = sheet(9, 9, 0.4, 0.4)
    ball, faces = icosphere(0.17, 2)
    scene = Scene(garment, x + np.array([0, 0.174, 0]), rigid_body(ball, faces), fabric(), WORN)
    settings = replace(PRESETS["draft"], correction_torn=torn)
    return build(scene, settings, "cpu", STILL), x


def test_the_largest_stretch_is_measured():
    sim, flat = laid_on_ball(1.3)
    stretched = flat * [1.0, 1.0, 1.4]
    sim.tears.measure(wp.array(stretched, dtype=wp.vec3, device="cpu"))
    assert sim.tears.largest.numpy() == pytest.approx([1.4], rel=1e-5)
    assert sim.progress.read().stretch == pytest.approx(1.4, rel=1e-5)


def test_cloth_is_torn_by_what_is_more_than_its_budget_left():
    watch = laid_on_ball(1.3)[0].tears
    assert not watch.torn(1.29)
    assert watch.torn(1.31)
    watch.bear(1.5)
    assert not watch.torn(1.5)
    assert watch.torn(1.6)  # over 1.05 times as much
    assert not watch.torn(1.2)  # whole again:
    assert watch.torn(1.31)  # what was borne is forgotten


@pytest.mark.parametrize(("torn", "steps_again"), [(0.5, [0]), (1.3, []), (None, [])])
@pytest.mark.parametrize("deadline", [None, 1e-6])
def test_only_a_correction_that_leaves_it_torn_is_done_again(torn, steps_again, deadline, monkeypatch):
    """From 0.5 on it always is, and its budget leaves it so. Late or not: torn cloth is dearer in all steps after."""
    sim, _ = laid_on_ball(torn)
    sim.buy(None, deadline)
    again, step, start_again = [], 0, correct.start_again

    def noted(sim):
        again.append(step)
        start_again(sim)

    monkeypatch.setattr(correct, "start_again", noted)
    made = []
    for step in range(4):
        made.append(sim.advance(STILL, (step + 1) / 30).newton_iterations)
    assert again == steps_again
    if deadline is not None:
        budget = PRESETS["draft"].correction_iterations
        assert [iterations > budget for iterations in made] == [step in steps_again for step in range(4)]
