"""A step of many contact passes goes on until nothing wants to move, whatever keeps it from moving."""

from dataclasses import replace

import numpy as np
import pytest
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import build

DT = 1 / 60
CONVERGED = Settings(contact_passes=20)
FALLEN = 8  # steps, after which the square lies on the ball's top


def laid_on_ball(settings):
    """A square just above a ball."""
    garment, x = sheet(11, 11, 0.4, 0.4)
    ball, faces = icosphere(0.17, 2)
    scene = Scene(garment, x + np.array([0, 0.174, 0]), rigid_body(ball, faces), fabric(), WORN)
    return build(scene, settings, "cpu", STILL)


@pytest.fixture(scope="module")
def on_its_way():
    """Takes a step from where the square bends over the ball."""
    before = laid_on_ball(CONVERGED)
    for k in range(FALLEN):
        before.advance(STILL, (k + 1) * DT)
    x, v = before.state.x.numpy(), before.state.v.numpy()

    def step(settings):
        sim = laid_on_ball(settings)
        sim.state.x.assign(x)
        sim.state.v.assign(v)
        return sim.advance(STILL, DT), sim.cloth_positions().astype(np.float64)

    return step


def test_vertices_that_stay_where_a_search_reaches_are_not_at_balance(on_its_way):
    """One search a pass, of a tenth of a millimetre: the square wants to go 80 mm, and every pass ends at the border of
    what was searched, where nothing moves. A step's end is known to 1e-4 m/s dt = 0.002 mm in Newton's last way."""
    _, true = on_its_way(CONVERGED)
    report, x = on_its_way(replace(CONVERGED, searches=1, search_slack=1e-4))
    assert report.residual < CONVERGED.correction_tolerance
    assert report.error < 1e-5
    assert np.linalg.norm(x - true, axis=1).max() < 1e-5


def test_the_residual_is_of_the_way_that_is_wanted(on_its_way):
    """A single pass that ends so tells what it has left, though its last moves are short."""
    report, _ = on_its_way(replace(CONVERGED, contact_passes=1, searches=1, search_slack=1e-4))
    assert report.residual * DT > 1e-4


def test_passes_end_with_the_accuracy_that_is_asked_for_and_with_the_time(on_its_way):
    all_of_them, _ = on_its_way(CONVERGED)
    asked, _ = on_its_way(replace(CONVERGED, accuracy=3e-3))
    assert 0 < asked.newton_iterations <= 4
    nearer, _ = on_its_way(replace(CONVERGED, accuracy=1e-6))
    assert asked.newton_iterations < nearer.newton_iterations
    late, _ = on_its_way(replace(CONVERGED, deadline=1e-6))
    assert late.newton_iterations < all_of_them.newton_iterations / 2
