"""A move that went too far along a way that leads down comes back to where the slope along it is taken to be nought."""

import numpy as np
import pytest
import warp as wp
from small_scenes import fabric, sheet

from tryon_solver.scene import Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import build
from tryon_solver.stepping import correct
from tryon_solver.stepping.overshoot import BEYOND_MENDING, FREE, retreat_if_overshot
from tryon_solver.stepping.progress import FOUND, LEFT

BEGIN = 1.05  # times its rest size, which is where it would go


def root(a, b):
    """The real root of b s^3 + a s - a."""
    return next(s.real for s in np.roots([b, 0, a, -a]) if abs(s.imag) < 1e-9)


def shrunk(to, found=int(FREE) + 1, left=3, begin=BEGIN):
    """A sheet that goes from `begin` to `to` times its size in the iteration of that number: x over its rest shape, the
    slopes along the move that were met, the gradient that was left, and that of the place where it was left [N]."""
    garment, x = sheet(5, 5, 0.1, 0.1)
    sim = build(Scene(garment, x, None, fabric(), ()), Settings())
    sim.use_time_step(1.0)  # inertia is next to nothing
    state, work, rest = sim.state, sim.work, (x - x.mean(0)).astype(np.float32)
    wp.copy(sim.state.x_start, sim.state.x)
    state.x.assign(begin * rest)
    for place in (state.x_hat, sim.x_searched):
        place.assign(begin * rest)
    work.total.assign((to - begin) * rest)
    correct.gradient_at(sim)
    slopes = [float((work.gradient.numpy() * work.total.numpy()).sum())]
    told = sim.progress.state.numpy()
    told[int(FOUND)], told[int(LEFT)] = found, left
    sim.progress.state.assign(told)
    lengths = sim.progress.lengths.numpy()
    lengths[14] = slopes[0]
    sim.progress.lengths.assign(lengths)
    state.x.assign(to * rest)

    def measure():
        correct.gradient_at(sim)
        slopes.append(float((work.gradient.numpy() * work.total.numpy()).sum()))

    retreat_if_overshot(sim, measure, lambda: None)
    gradient = work.gradient.numpy()
    correct.gradient_at(sim)
    size = float((state.x.numpy() * rest).sum() / (rest**2).sum())
    np.testing.assert_allclose(state.x.numpy(), size * rest, atol=1e-6)
    return size, slopes, gradient, work.gradient.numpy()


def test_it_comes_back_to_where_the_slope_is_nought():
    size, (before, there, *_), gradient, fresh = shrunk(0.85)
    assert before < 0 < -2 * before < there
    share = root(-before, there)
    assert 0.2 < share < 0.8
    assert size == pytest.approx(BEGIN + share * (0.85 - BEGIN), abs=1e-5)
    np.testing.assert_array_equal(gradient, fresh)


def test_a_move_that_leads_down_is_left():
    size, (before, there), _, _ = shrunk(0.98)
    assert 0 < there < -2 * before
    assert size == pytest.approx(0.98, abs=1e-6)


@pytest.mark.parametrize(("to", "comes_back"), [(1.09, False), (1.2, True)])
def test_a_move_that_leads_up_from_its_beginning_goes_no_further_than_where_the_cube_is_as_much(to, comes_back):
    size, (before, there, *_), _, _ = shrunk(to)
    assert before > 0
    assert (there > 2 * before) == comes_back
    share = root(before, there) if comes_back else 1.0
    assert size == pytest.approx(BEGIN + share * (to - BEGIN), abs=1e-5)


@pytest.mark.parametrize(("left", "comes_back"), [(3, False), (0, True)])
def test_the_first_move_may_rise_unless_it_is_the_last(left, comes_back):
    size, (before, there, *_), _, _ = shrunk(0.85, found=int(FREE), left=left)
    assert there > -2 * before > 0
    assert (size > 0.86) == comes_back


@pytest.mark.parametrize(("to", "comes_back"), [(0.9, False), (0.8, True)])
def test_the_first_move_comes_back_from_where_no_next_one_mends_what_it_did(to, comes_back):
    size, (before, there, *_), _, _ = shrunk(to, found=int(FREE), begin=1.005)
    assert (there > -float(BEYOND_MENDING) * before > 0) == comes_back
    assert there > -2 * before
    share = root(-before, there) if comes_back else 1.0
    assert size == pytest.approx(1.005 + share * (to - 1.005), abs=1e-5)
