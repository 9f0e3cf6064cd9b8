"""Motions of tangled cloth, turned aside and shortened by the solver, judged by IPC Toolkit's collision detection."""

import ipctk
import numpy as np
import pytest
import warp as wp
from small_scenes import sheet
from tangles import Tangle

from tryon_solver import step
from tryon_solver.contact import bounds, filtering
from tryon_solver.contact.found import Found
from tryon_solver.contact.region import Region
from tryon_solver.contact.verify import SAFE_SHARE, violations
from tryon_solver.scene import Gravity, Scene
from tryon_solver.simulation import build
from tryon_solver.stepping import carry_once, search, take
from tryon_solver.stepping.verify_commit import verify_commit


@pytest.fixture(scope="module")
def tangle():
    return Tangle()


def filtered(tangle, x, motion):
    """Positions after the solver's filter of a kinematic motion, float64 of float32."""
    sim = tangle.sim
    tangle.set_motion(x, motion)
    search.search_along(sim, sim.state.x, sim.work.direction, 0.0)
    carry_once.filter_motion(sim, None, 0.0)
    take.move(sim, sim.work.direction)
    return sim.state.x.numpy().astype(np.float64)


@pytest.mark.parametrize(
    "speed", [pytest.param(0.003, marks=pytest.mark.long), 0.01, pytest.param(0.04, marks=pytest.mark.long)]
)
def test_kinematic_motion_is_free_after_filtering(tangle, speed):
    """Eight motions in a row from the feasible start; unfiltered each of them would collide."""
    rng = np.random.default_rng(int(1e4 * speed))
    x, collided, moved = tangle.x, 0, []
    sizes = tangle.sim.contact.sizes
    for _ in range(8):
        motion = tangle.throw(rng, speed)
        collided += not tangle.is_free(x, x + motion)
        after = filtered(tangle, x, motion)
        assert np.isfinite(after).all()
        assert tangle.is_free(x, after)
        assert tangle.distances(after).min() > SAFE_SHARE * min(sizes.xi_self, sizes.xi_body)
        moved.append(np.linalg.norm(after - x, axis=1) / np.linalg.norm(motion, axis=1).mean())
        x = after
    assert collided >= 6
    # a filter that holds everybody still is free too, and useless
    print(f"speed {speed}: median share of the motion taken {np.median(moved):.2f}")
    assert np.median(moved) > 0.1


def test_who_falls_behind_is_searched_for_where_that_is(tangle):
    """Of many who are held back, balls that reached all their way would list each with all of the others."""
    rng, x, sim = np.random.default_rng(100), tangle.x, tangle.sim
    for _ in range(4):
        motion = tangle.throw(rng, 0.01)
        tangle.set_motion(x, motion)
        search.search_along(sim, sim.state.x, sim.work.direction, 0.0)
        found = sim.candidates.size
        carry_once.filter_motion(sim, None, 0.0)
        assert 0 < sim.candidates.size < 2 * found
        take.move(sim, sim.work.direction)
        after = sim.state.x.numpy().astype(np.float64)
        assert tangle.is_free(x, after)
        x = after


@pytest.mark.parametrize("room", [1 << 20, 16], ids=["room", "no room"])
def test_motion_is_free_whether_or_not_there_was_room_for_what_further_searches_found(device, room):
    """A GPU looks at the motion before anybody knows whether what it searched for had room on the list."""
    tangle, rng, grown = Tangle(device=device), np.random.default_rng(400), 0
    x, sim = tangle.x, tangle.sim
    for _ in range(4):
        motion = tangle.throw(rng, 0.04)
        tangle.set_motion(x, motion)
        search.search_along(sim, sim.state.x, sim.work.direction, 0.0)
        sim.candidates.found = [Found.allocate((room, room, room), device) for _ in sim.candidates.found]
        carry_once.filter_motion(sim, None, 0.0)
        grown += any(one.rooms != (room, room, room) for one in sim.candidates.found)
        take.move(sim, sim.work.direction)
        after = sim.state.x.numpy().astype(np.float64)
        assert tangle.is_free(x, after)
        x = after
    assert (grown > 0) == (room == 16)
    if device != "cpu":
        assert {"search_as_far_0_and_turn_aside", "search_further_and_turn_aside"} <= set(sim.graphs)


def test_what_there_was_no_room_for_turns_no_motion_aside(tangle, monkeypatch):
    """A processor's list has all that was found before it looks; here it looks before, as a GPU that had no room."""
    rng, x, thrown = np.random.default_rng(1), tangle.x, []
    for _ in range(8):
        motion = tangle.throw(rng, 0.1)
        after = filtered(tangle, x, motion)
        thrown.append((x, motion, after))
        x = after
    monkeypatch.setattr(carry_once, "looks_ahead", lambda _sim: True)
    for x, motion, after in thrown:
        assert (filtered(tangle, x, motion) == after).all()


@pytest.mark.parametrize("speed", [0.01, 0.04, 0.1])
def test_passes_between_two_looks_change_nothing(tangle, monkeypatch, speed):
    """A GPU asks after every fourth pass whether there is another: those after the last must change nothing, also
    where there would be more to do, as of what is thrown at 0.04 m and 0.1."""
    motion = tangle.throw(np.random.default_rng(100), speed)
    one_by_one = filtered(tangle, tangle.x, motion)
    assert (one_by_one != filtered(tangle, tangle.x, 0.5 * motion)).any()
    monkeypatch.setattr(filtering, "turns_at_once", lambda _array: filtering.TURNS)
    assert (filtered(tangle, tangle.x, motion) == one_by_one).all()


def test_the_oracle_judges_as_it_is_used_here(tangle):
    """True means free: a sheet pushed through the ball is not, a sheet left alone is."""
    through = tangle.x.copy()
    through[: tangle.cloth, 1] -= 0.3
    assert tangle.is_free(tangle.x, tangle.x)
    assert not tangle.is_free(tangle.x, through)


def test_free_motion_is_taken_whole(tangle):
    """Layers lifted off each other and off the ball: nothing is turned aside, nothing shortened."""
    motion = np.zeros_like(tangle.x)
    half = tangle.cloth // 2
    motion[:half, 1], motion[half : tangle.cloth, 1] = 0.02, 0.05
    after = filtered(tangle, tangle.x, motion)
    np.testing.assert_allclose(after, tangle.x + motion, rtol=0, atol=1e-7)


def test_common_motion_is_taken_whole(tangle):
    motion = np.broadcast_to([0.3, -0.2, 0.1], tangle.x.shape)
    after = filtered(tangle, tangle.x, motion)
    np.testing.assert_allclose(after, tangle.x + motion, rtol=0, atol=1e-7)


@pytest.mark.parametrize("speed", [0.002, 0.02])
def test_moves_of_the_correction_are_free(tangle, speed):
    """Several moves on one candidate list, each from where the last one ended, whatever direction is asked for."""
    rng = np.random.default_rng(int(1e5 * speed))
    sim = tangle.sim
    x = tangle.x
    tangle.set_motion(x, tangle.throw(rng, speed))
    search.search_around(sim, sim.state.x, sim.work.direction)
    collided = 0
    for _ in range(8):
        motion = tangle.throw(rng, speed)
        collided += not tangle.is_free(x, x + motion)
        sim.work.direction.assign(motion.astype(np.float32))
        take.take(sim, sim.work.direction)
        after = sim.state.x.numpy().astype(np.float64)
        assert tangle.is_free(x, after)
        moved = sim.largest(sim.work.total)
        assert moved == pytest.approx(np.linalg.norm(after - x, axis=1).max(), rel=1e-3, abs=1e-7)
        x = after
    assert collided >= 4


def test_vertex_on_the_border_of_its_region_may_cross_it():
    """A move that ended there is a rounding inside or outside: which of them must not decide whether it moves."""
    count, budget = 200, 2e-3
    rng = np.random.default_rng(3)
    outwards = rng.standard_normal((count, 3))
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    anchor = np.tile(np.float32([1.3, 0.9, -1.1]), (count, 1))
    region = Region.allocate(count, "cpu")
    region.anchor.assign(anchor)
    region.budget.fill_(budget)
    alpha = wp.zeros(count, dtype=wp.float32, device="cpu")
    for far, way, expected in ((1.0, -3.0, 2 / 3), (1.0, 1.0, 0.0), (0.5, 1.0, 0.5), (1.1, -3.0, 0.0)):
        x = (anchor + far * budget * outwards).astype(np.float32)
        away = np.linalg.norm(x.astype(np.float64) - anchor, axis=1)
        assert far != 1.0 or 0.2 < (away > budget).mean() < 0.8, "rounding puts none on one side"
        motion = wp.array((way * budget * outwards).astype(np.float32), dtype=wp.vec3, device="cpu")
        alpha.fill_(np.nan)
        bounds.stay_in_region(wp.array(x, dtype=wp.vec3, device="cpu"), motion, region, alpha)
        np.testing.assert_allclose(alpha.numpy(), expected, atol=1e-3)


def test_verification_counts_what_is_too_close(tangle):
    """Below half the offset a stencil is a violation, above it is not."""
    sim = tangle.sim
    sizes = sim.contact.sizes

    def count(x):
        tangle.set_motion(x, np.zeros_like(x))
        search.search_around(sim, sim.state.x, sim.work.direction)
        return violations(sim.candidates, sim.cloth_count, sizes, sim.state.x, sim.work.hits)

    half = tangle.cloth // 2
    assert count(tangle.x) == 0
    for share, expected in ((1.1, False), (0.9, True)):
        x = tangle.x.copy()
        x[half : tangle.cloth, 1] = x[0, 1] + share * SAFE_SHARE * sizes.xi_self
        assert (count(x) > 0) == expected
    x = tangle.x.copy()
    top = x[tangle.cloth :, 1].max()
    for share, expected in ((1.1, False), (0.9, True)):
        x[tangle.cloth :, 1] += x[0, 1] - share * SAFE_SHARE * sizes.xi_body - top
        top = x[tangle.cloth :, 1].max()
        assert (count(x) > 0) == expected


def test_verification_sees_nan(tangle):
    sim = tangle.sim
    tangle.set_motion(tangle.x, np.zeros_like(tangle.x))
    search.search_around(sim, sim.state.x, sim.work.direction)
    assert violations(sim.candidates, sim.cloth_count, sim.contact.sizes, sim.state.x, sim.work.hits) == 0
    x = tangle.x.copy()
    x[tangle.cloth // 4] = np.nan
    sim.state.x.assign(x.astype(np.float32))
    assert violations(sim.candidates, sim.cloth_count, sim.contact.sizes, sim.state.x, sim.work.hits) > 0


def test_step_that_yields_nan_is_void_without_contact_too():
    garment, x = sheet(9, 9, 0.2, 0.2)
    sim = build(Scene(garment, x, None, effects=(Gravity(),)))
    sim.advance(None, 1 / 60)
    last = sim.cloth_positions()
    v = sim.state.v.numpy()
    v[3] = np.nan
    sim.state.v.assign(v)
    report = sim.advance(None, 2 / 60)
    assert report.retries == 1
    assert np.isfinite(sim.cloth_positions()).all()
    assert np.isfinite(last).all()


def test_void_step_goes_back_to_the_feasible_state(tangle):
    sim = tangle.sim
    x = too_close(tangle)
    tangle.set_motion(x, np.zeros_like(x))
    search.search_around(sim, sim.state.x, sim.work.direction)
    sim.state.x_feasible.assign(tangle.x.astype(np.float32))
    sim.start_report()
    verify_commit(sim)
    assert (sim.counters.retries, sim.counters.reverts) == (1, 0)
    np.testing.assert_array_equal(sim.state.x.numpy(), tangle.x.astype(np.float32))


def too_close(tangle):
    """The upper half of the cloth much nearer to the lower one than its thickness."""
    x = tangle.x.copy()
    x[tangle.cloth // 2 : tangle.cloth, 1] = x[0, 1] + 0.2 * SAFE_SHARE * tangle.sim.contact.sizes.xi_self
    return x


def not_a_number(tangle):
    x = tangle.x.copy()
    x[tangle.cloth + 1] = np.nan
    return x


@pytest.mark.parametrize("poison", [too_close, not_a_number])
def test_void_step_whose_carried_state_is_unsafe_goes_back_to_the_last_commit(tangle, poison):
    """The carried state is measured where it is, not with what was found around the void one."""
    sim = tangle.sim
    committed = tangle.x.astype(np.float32)
    aside = tangle.x.copy()  # void for a reason of its own, and far from where the carried state fails
    aside[0, 1] = np.nan
    tangle.set_motion(tangle.x, np.zeros_like(tangle.x))
    search.search_around(sim, sim.state.x, sim.work.direction)
    sim.candidates.size = 0
    sim.state.x.assign(aside.astype(np.float32))
    sim.state.x_feasible.assign(poison(tangle).astype(np.float32))
    sim.state.x_start.assign(committed)
    sim.start_report()
    verify_commit(sim)
    assert (sim.counters.retries, sim.counters.reverts) == (1, 1)
    np.testing.assert_array_equal(sim.state.x.numpy(), committed)


def test_reverted_step_is_told_and_the_next_one_goes_on(monkeypatch):
    """A sheet lands on the ground in spite of one step whose carried and solved states are both lost."""
    garment, x = sheet(9, 9, 0.2, 0.2)
    sim = build(Scene(garment, x, None, effects=(Gravity(),)))
    sim.advance(None, 1 / 60)
    before = sim.cloth_positions()
    real = step.correct_penetration

    def lose_everything(sim, conclude):
        real(sim, conclude)
        sim.state.x.fill_(wp.vec3(np.nan, np.nan, np.nan))
        sim.state.x_feasible.fill_(wp.vec3(np.nan, np.nan, np.nan))

    with monkeypatch.context() as lost:
        lost.setattr(step, "correct_penetration", lose_everything)
        report = sim.advance(None, 2 / 60)
    assert (report.retries, report.reverts) == (1, 1)
    assert "stayed behind" in report.advice
    np.testing.assert_array_equal(sim.cloth_positions(), before)
    assert (sim.state.v.numpy() == 0).all()
    report = sim.advance(None, 3 / 60)
    assert (report.retries, report.reverts) == (0, 0)
    fallen = (before - sim.cloth_positions())[:, 1]
    np.testing.assert_allclose(fallen, 9.81 / 3600, rtol=1e-2)


def test_intersections_of_the_oracle_are_seen(tangle):
    """The judge used on frames says no for the start and yes for crossed layers."""
    assert not ipctk.has_intersections(tangle.oracle, np.asfortranarray(tangle.x))
    crossed = tangle.x.copy()
    crossed[: tangle.cloth // 2] += 0.012 * np.array([[0.0, 1.0, 0.0]]) * (crossed[: tangle.cloth // 2, :1] > 0)
    assert ipctk.has_intersections(tangle.oracle, np.asfortranarray(crossed))
