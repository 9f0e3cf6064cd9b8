"""Newton's direction is taken as many times as the move before it would have had to be."""


import numpy as np
import pytest
import warp as wp
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import build
from tryon_solver.stepping import correct
from tryon_solver.stepping.progress import SLOPE, STRIDE
from tryon_solver.stepping.stride import MOST, choose_stride, stride_out

DT = 1 / 60
BEGIN = 1.05  # times its rest size


def strode(to, pairs=0):
    """A sheet that went from BEGIN to `to` times its size where 1 is: how many times the next direction is taken."""
    garment, x = sheet(5, 5, 0.1, 0.1)
    sim = build(Scene(garment, x, None, fabric(), ()), Settings())
    sim.use_time_step(1.0)  # inertia is next to nothing
    state, work, rest = sim.state, sim.work, (x - x.mean(0)).astype(np.float32)
    for place in (state.x, state.x_start, state.x_hat, sim.x_searched):
        place.assign(BEGIN * rest)
    work.total.assign((to - BEGIN) * rest)

    def slope():
        correct.gradient_at(sim)
        return float((work.gradient.numpy() * work.total.numpy()).sum())

    lengths = np.full(len(sim.progress.lengths), np.nan, np.float32)
    lengths[int(SLOPE)] = slope()
    sim.progress.lengths.assign(lengths)
    state.x.assign(to * rest)
    there = wp.array([slope()], dtype=wp.float32)
    sim.pairs.counters.assign(np.full_like(sim.pairs.counters.numpy(), pairs))
    choose_stride(sim, there)
    chosen = float(sim.progress.lengths.numpy()[int(STRIDE)])
    direction = np.random.default_rng(1).normal(size=(len(x), 3)).astype(np.float32)
    work.direction.assign(direction)
    stride_out(sim)
    np.testing.assert_allclose(work.direction.numpy(), np.float32(chosen) * direction, rtol=1e-6)
    return chosen


@pytest.mark.parametrize("to", [1.03, 1.025, 1.01])
def test_it_is_the_share_of_the_way_that_was_gone(to):
    """Stretched cloth is a spring, nearly: its rest size is where the slope vanishes."""
    assert strode(to) == pytest.approx((BEGIN - 1) / (BEGIN - to), rel=0.03)


def test_it_is_never_more_than_the_most():
    assert strode(1.045) == float(MOST)


@pytest.mark.parametrize("to", [0.98, 1.06])
def test_what_went_too_far_or_uphill_says_nothing(to):
    assert strode(to) == 1.0


def test_where_there_are_more_pairs_than_room_nothing_is_known():
    assert strode(1.03, pairs=2**30) == 1.0


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
