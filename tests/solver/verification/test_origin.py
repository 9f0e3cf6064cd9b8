"""The origin may move under a running simulation: the same scene, seen from elsewhere."""

import numpy as np
import pytest
from small_scenes import icosphere, rigid_body, sheet

from tryon_solver.body.pose import Pose
from tryon_solver.scene import WORN, Scene
from tryon_solver.simulation import build

UPRIGHT = np.array([[0.0, 0.0, 0.0, 1.0]])
BY = np.array([8.0, 0.0, -9.0])
PLACE = BY + np.array([0.3, 0.0, 0.2])
STEP = np.array([0.004, 0.0, 0.0])  # m in 1/60 s


def ball_at(place):
    return Pose(np.asarray(place, np.float64), UPRIGHT)


def sheet_over_ball(place):
    """A sheet a little above a ball of 8 cm whose centre is at `place`."""
    garment, x = sheet(11, 11, 0.2, 0.2)
    vertices, faces = icosphere(0.08, 3)
    above = np.array([0.0, 0.084, 0.0])
    return build(Scene(garment, x + place + above, rigid_body(vertices, faces), effects=WORN), pose=ball_at(place))


def test_scene_goes_on_the_same_after_the_origin_has_moved():
    """Two runs of one scene, a ball on the move under a sheet; one of them changes its origin half way."""
    stays, moves = sheet_over_ball(PLACE), sheet_over_ball(PLACE)
    for k in range(1, 5):
        for sim in (stays, moves):
            sim.advance(ball_at(PLACE + k * STEP), k / 60)
    before = moves.cloth_positions()
    np.testing.assert_array_equal(before, stays.cloth_positions())
    moves.move_origin(BY)
    assert np.abs(moves.cloth_positions()).max() < 1
    np.testing.assert_array_equal(moves.cloth_positions() + BY, before)
    np.testing.assert_array_equal(moves.state.x.numpy() + BY, stays.state.x.numpy())
    for k in range(5, 11):
        end = PLACE + k * STEP
        one, other = stays.advance(ball_at(end), k / 60), moves.advance(ball_at(end - BY), k / 60)
        assert (one.retries, other.retries) == (0, 0)
        assert other.body_lag == pytest.approx(one.body_lag, abs=1e-5)
        if k == 5:
            # float32 resolves 1 um at 8 m; later steps amplify it, by their choice of start at the latest
            assert np.abs(moves.cloth_positions() + BY - stays.cloth_positions()).max() < 1e-4
            assert np.abs(moves.state.v.numpy() - stays.state.v.numpy()).max() < 5e-3
    assert stays.report().pairs > 20


def test_origin_moves_by_whole_metres_only():
    sim = sheet_over_ball(np.zeros(3))
    with pytest.raises(ValueError, match="whole metres"):
        sim.move_origin(np.array([0.5, 0.0, 0.0]))
