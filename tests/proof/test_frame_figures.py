"""What is measured on a decoded frame: everything it must catch is shown to it, as it comes from the wire."""

import numpy as np
import pytest
from frame_figures import FrameMeter
from tube_on_ball import Dressed


@pytest.fixture
def dressed():
    return Dressed()


def test_a_worn_tube_keeps_every_limit(dressed):
    figures = dressed.shown(dressed.cloth, dressed.body)
    assert figures.verdict.clean
    assert figures.finite
    assert figures.worn
    assert figures.lag_max == 0
    assert figures.pinched_area == 0
    assert figures.stretch_max == pytest.approx(1.0, abs=0.02)


def test_a_vertex_pushed_into_the_body_is_caught(dressed):
    cloth = dressed.cloth.copy()
    middle = np.argmin(np.abs(cloth[:, 1]))
    cloth[middle] *= 0.09 / 0.12
    figures = dressed.shown(cloth, dressed.body)
    assert figures.verdict.body_intersecting


def test_a_frame_that_is_not_asked_has_no_verdict(dressed):
    assert dressed.meter.measure(dressed.frame(dressed.cloth, dressed.body), intersections=False).verdict is None


def test_skin_to_surface_is_measured_at_the_frames_own_pose(dressed):
    """The body a metre off and turned, its surface 5 mm out in one vertex and 2 mm in all others of the upper half."""
    turn = np.array([0, np.sin(0.4), 0, np.cos(0.4)])
    skin = dressed.meter.skinner.pose(np.array([1.0, 0, 0]), np.vstack([turn, dressed.still[1:]]))
    upper = dressed.body[:, 1] > 0
    surface = skin + np.where(upper, 2e-3, 0)[:, None] * dressed.body / 0.1
    surface[0] = skin[0] + 5e-3 * dressed.body[0] / 0.1
    figures = dressed.shown(
        dressed.cloth + np.array([1.0, 0, 0]), surface, root=(1.0, 0, 0), rotations=np.vstack([turn, dressed.still[1:]])
    )
    assert figures.lag_max == pytest.approx(5e-3, abs=1e-4)
    assert figures.lag_p95 == pytest.approx(2e-3, abs=1e-4)
    assert figures.pinched_lag_max == 0


def test_stretch_of_most_passes_over_one_triangle_in_a_thousand_and_no_more(dressed):
    """384 triangles: none may be left out, so the most stretched one is the measure of both."""
    cloth = dressed.cloth.copy()
    cloth[:, 1] *= 1.3
    figures = dressed.shown(cloth, dressed.body)
    assert len(dressed.garment.faces) == 384
    assert figures.stretch_max == pytest.approx(1.3, abs=0.01)
    assert figures.stretch_most == figures.stretch_max


@pytest.mark.parametrize(("up", "worn", "slid"), [(0.3, True, 0.3), (0.7, False, np.inf), (-0.45, False, 0.45)])
def test_a_tube_that_slid_off_is_not_worn(dressed, up, worn, slid):
    """The head is at 0.5 m, the toes at -0.5 m, the loops at 0.1 m and -0.1 m; the upper one may not slide."""
    figures = dressed.shown(dressed.cloth + np.array([0, up, 0]), dressed.body)
    assert figures.worn == worn
    assert figures.slid == pytest.approx(slid, abs=1e-3)


@pytest.mark.parametrize(("put_on", "now", "worn"), [(0.45, 0.35, True), (0.45, 0.65, False), (0.7, 0.7, False)])
def test_a_loop_that_ran_around_nothing_is_asked_for_nothing(dressed, put_on, now, worn):
    """Put on 0.45 m up, the upper loop is over the head as a hood's edge is; 0.7 m up the lower one is, too."""
    up, now_up = (dressed.cloth + np.array([0, height, 0]) for height in (put_on, now))
    meter = FrameMeter(dressed.topology, dressed.frame(up, dressed.body), 9.4e-3)
    assert meter.measure(dressed.frame(now_up, dressed.body), intersections=False).worn == worn


def test_hem_is_told_relative_to_the_pelvis(dressed):
    """The lowest loop, in the pelvis's frame: the body walking off with its garment moves nothing."""
    before = dressed.shown(dressed.cloth, dressed.body).hem
    turn = np.vstack([[0, np.sin(0.4), 0, np.cos(0.4)], dressed.still[1:]])
    c, s = np.cos(0.8), np.sin(0.8)
    rotated = dressed.cloth @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T
    away = np.array([0.3, 0, 0])
    skin = dressed.meter.skinner.pose(away, turn)
    after = dressed.shown(rotated + away, skin, root=away, rotations=turn).hem
    assert len(before) == 24
    assert before[:, 1].max() < -0.09
    np.testing.assert_allclose(after, before, atol=1e-4)
