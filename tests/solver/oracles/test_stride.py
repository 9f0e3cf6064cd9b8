"""Newton's direction is taken as many times as the move before it would have had to be."""


import numpy as np
import pytest
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import build
from tryon_solver.stepping import correct
from tryon_solver.stepping.overshoot import measure_slopes
from tryon_solver.stepping.progress import STRIDE
from tryon_solver.stepping.stride import MOST, choose_stride, note_unstopped, stride_out

DT = 1 / 60
BEGIN = 1.05  # times its rest size


def strode(to, pairs=0, wanted=1.0, overshot=0, pushed=0.0):
    """A sheet that went from BEGIN to `to` times its size where 1 is, of `wanted` (or (N,)) times which it was to go,
    and `pushed` (or (N,)) m aside: how many times the next direction is taken, and the slopes of the vertices where
    they set out and ended, (N,) J."""
    garment, x = sheet(5, 5, 0.1, 0.1)
    sim = build(Scene(garment, x, None, fabric(), ()), Settings())
    sim.use_time_step(1.0)  # inertia is next to nothing
    state, work, rest = sim.state, sim.work, (x - x.mean(0)).astype(np.float32)
    for place in (state.x, state.x_start, state.x_hat, sim.x_searched):
        place.assign(BEGIN * rest)
    moved = (to - BEGIN) * rest
    sim.work.wanted.assign(np.broadcast_to(np.reshape(wanted, (-1, 1)) * moved, moved.shape).astype(np.float32))
    work.total.assign(moved + np.multiply.outer(np.broadcast_to(pushed, len(x)), [0, 0, 1]).astype(np.float32))
    sim.progress.lengths.fill_(np.nan)
    sim.progress.overshot.fill_(overshot)
    work.scalars[2].fill_(np.nan)

    def slopes():
        correct.gradient_at(sim)
        return (work.gradient.numpy() * moved).sum(1)

    began = slopes()
    note_unstopped(sim)
    state.x.assign(to * rest)
    ended = slopes()
    measure_slopes(sim, work.scalars[0])
    sim.pairs.counters.assign(np.full_like(sim.pairs.counters.numpy(), pairs))
    choose_stride(sim)
    chosen = float(sim.progress.lengths.numpy()[int(STRIDE)])
    direction = np.random.default_rng(1).normal(size=(len(x), 3)).astype(np.float32)
    work.direction.assign(direction)
    stride_out(sim)
    np.testing.assert_allclose(work.direction.numpy(), np.float32(chosen) * direction, rtol=1e-6)
    return chosen, began, ended


@pytest.mark.parametrize("to", [1.03, 1.025, 1.01])
def test_it_is_the_share_of_the_way_that_was_gone(to):
    """Stretched cloth is a spring, nearly: its rest size is where the slope vanishes."""
    assert strode(to)[0] == pytest.approx((BEGIN - 1) / (BEGIN - to), rel=0.03)


def test_it_is_never_more_than_the_most():
    assert strode(1.045)[0] == float(MOST)


def test_those_that_are_stopped_say_nothing():
    """Of a sheet whose one half went a third of its way, the other half's slopes count."""
    stopped = np.arange(25) < 12
    chosen, began, ended = strode(1.03, wanted=np.where(stopped, 3.0, 1.005))
    a, b = -began[~stopped].sum(), ended[~stopped].sum()
    assert a > 0 > b
    assert abs(began[stopped].sum()) > 0.1 * a
    assert chosen == pytest.approx(a / (a + b), rel=1e-4)


def test_those_that_are_pushed_say_nothing():
    pushed = np.where(np.arange(25) < 12, 0.01, 0.0)
    chosen, began, ended = strode(1.03, pushed=pushed)
    a, b = -began[pushed == 0].sum(), ended[pushed == 0].sum()
    assert chosen == pytest.approx(a / (a + b), rel=1e-4)


def test_after_a_move_that_came_back_nothing_is_known():
    assert strode(1.03, overshot=1)[0] == 1.0


def test_where_all_are_stopped_nothing_is_known():
    assert strode(1.03, wanted=1.02)[0] == 1.0


@pytest.mark.parametrize("to", [0.98, 1.06])
def test_what_went_too_far_or_uphill_says_nothing(to):
    assert strode(to)[0] == 1.0


def test_where_there_are_more_pairs_than_room_nothing_is_known():
    assert strode(1.03, pairs=2**30)[0] == 1.0


def draped(monkeypatch, strides):
    """A square that falls on a ball, each step to its end: iterations in all, and where it is then."""
    with monkeypatch.context() as patched:
        if not strides:
            patched.setattr(correct, "stride_out", lambda _: None)
        garment, x = sheet(15, 15, 0.5, 0.5)
        ball, faces = icosphere(0.1, 2)
        scene = Scene(garment, x + np.array([0, 0.104, 0]), rigid_body(ball, faces), fabric(), WORN)
        sim = build(scene, Settings(correction_iterations=60, correction_extensions=0), "cpu", STILL)
        taken = [sim.advance(STILL, (k + 1) * DT).newton_iterations for k in range(6)]
    assert max(taken) < 60, "each came to its end"
    return sum(taken), sim.cloth_positions()


def test_it_ends_in_the_same_place_sooner(monkeypatch):
    iterations, x = draped(monkeypatch, strides=True)
    without, x_without = draped(monkeypatch, strides=False)
    np.testing.assert_allclose(x, x_without, atol=2e-5)
    assert iterations < 0.95 * without
