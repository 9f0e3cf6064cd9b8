"""Cloth that goes on beside a body as it went is led there before the step is solved: fast cloth keeps its speed, and
is not looked for among its own neighbours."""

from dataclasses import replace

import numpy as np
import pytest
from small_scenes import STILL, rigid_body, sheet, slab

from tryon_solver.materials.fabric import FABRICS
from tryon_solver.scene import BodyContact, Gravity, Scene, SelfContact
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import correct
from tryon_solver.stepping.lead import LED_FROM, LED_UP_TO

G, FPS, STEPS = 9.81, 30, 18
DOWN = np.radians(30)
TOUCHING = (BodyContact(), SelfContact())


def on_slope(effects=TOUCHING, start=0, down=DOWN, preset="draft", times=1.0):
    """A sheet of silk, or of one so many times as stiff, that lies on a slab which nothing rubs on, 30 degrees steep,
    `start` a micrometre off."""
    garment, x = sheet(9, 9, 0.1, 0.1)
    body, faces = slab(4.0, 0.4, 0.02, 0.05)
    apart = 1e-6 * np.random.default_rng(start).standard_normal(x.shape)
    weight = Gravity((G * np.sin(down), -G * np.cos(down), 0.0))
    silk = FABRICS["silk_charmeuse"]
    silk = replace(silk, k_warp=times * silk.k_warp, k_weft=times * silk.k_weft, k_shear=times * silk.k_shear)
    scene = Scene(garment, x + [-1.8, 0.0022, 0.003] + apart, rigid_body(body, faces), silk, (weight, *effects))
    return build(scene, PRESETS[preset], "cpu", STILL)


def speed(sim):
    return float(sim.state.v.numpy()[:, 0].mean())


@pytest.mark.parametrize("start", range(8))
def test_what_slides_and_may_touch_itself_keeps_its_speed_from_every_start(start):
    """Seven edges a step in the end. Three of these starts lost all of it in a step before cloth was led."""
    sim = on_slope(start=start)
    for k in range(STEPS):
        before = speed(sim)
        sim.advance(STILL, (k + 1) / FPS)
        assert speed(sim) > before
    assert speed(sim) == pytest.approx(G * np.sin(DOWN) * STEPS / FPS, rel=0.01)


def test_it_is_led_as_it_went_and_no_neighbours_are_looked_for():
    sim = on_slope()
    edge, found, went = sim.mean_edge, [], [0.0, 0.0]
    for k in range(STEPS):
        sim.advance(STILL, (k + 1) / FPS)
        way = sim.lead.way.numpy()
        assert not way[sim.cloth_count :].any(), "the body goes by itself"
        led = way[: sim.cloth_count]
        if k > 1:
            as_before = went[k] - LED_FROM * edge  # which is less than it did in the last step
            assert led.mean(axis=0) == pytest.approx([as_before, 0.0, 0.0], abs=0.02 * edge)
            assert np.ptp(led, axis=0).max() < 0.05 * edge, "as it lies"
        went.append(speed(sim) / FPS)
        found.append(sim.candidates.size / sim.cloth_count)
    assert went[-1] > 6 * edge
    assert max(found) < 2.5 * found[1], "where it went three quarters of an edge"


@pytest.mark.parametrize("preset", ["draft", "live"])
def test_who_rests_is_led_nowhere(preset):
    sim = on_slope(down=0.0, preset=preset)
    for k in range(12):
        sim.lead.way.fill_(np.nan)
        sim.advance(STILL, (k + 1) / 60)
        assert not sim.lead.way.numpy().any()
    assert sim.pairs.size


@pytest.mark.parametrize("times", [0.0, 10.0, 100.0])
def test_who_is_too_stiff_for_the_mesh_and_the_step_is_led_nowhere(times):
    """A sheet that resists a strained edge a million times as much as its inertia would be led far from balance."""
    sim = on_slope(times=times)
    silk, edge = sim.scene.fabric, sim.mean_edge
    resists = max(silk.k_warp, silk.k_weft) / (FPS**2 * silk.areal_density * edge**2)
    assert resists == 0.0 or 1e5 < resists < 1e7
    led = []
    for k in range(8):
        sim.advance(STILL, (k + 1) / FPS)
        assert not sim.lead.way.numpy()[sim.cloth_count :].any()
        led.append(sim.lead.way.numpy().any())
    assert any(led) == (resists < LED_UP_TO)
    assert sim.lead.expected.numpy()[: sim.cloth_count].any(), "of where it goes the search knows"


def test_it_is_the_coming_step_that_somebody_may_be_too_stiff_for():
    """In steps of 1/60 s this sheet is led, in one of 1/30 s it resists four times as much."""
    sim, time, led = on_slope(times=60.0), 0.0, []
    for fps in [60] * 8 + [30, 60, 30, 30, 60]:
        time += 1 / fps
        sim.advance(STILL, time)
        led.append(bool(sim.lead.way.numpy().any()))
    assert led[-6:] == [True, False, True, False, False, True]


def test_without_a_body_or_itself_to_touch_nobody_is_led():
    assert on_slope((BodyContact(),)).lead is None
    garment, x = sheet(3, 3, 0.1, 0.1)
    assert build(Scene(garment, x, None, FABRICS["denim"], (SelfContact(),)), PRESETS["draft"], "cpu").lead is None


BESIDE = np.array([0.02, -0.01, 0.03], np.float32)  # m, more than an edge


def led_by(solved, before, then=1 / FPS, now=1 / FPS, comes_along=False):
    """What a step of `now` s leads by, and expects besides, after one of `then` in which the solve moved all by
    `solved` m, and one in which it moved them by `before`."""
    sim = on_slope()
    for array, value in ((sim.solved, solved), (sim.lead.before, before)):
        array.assign(np.tile(np.asarray(value, np.float32), (sim.all_count, 1)))
    sim.lead.time.fill_(then)
    sim.state.dt.fill_(now)
    sim.comes_along = comes_along
    motion = np.random.default_rng(0).normal(size=(sim.all_count, 3)).astype(np.float32)
    sim.work.direction.assign(motion)
    for array in (sim.lead.way, sim.lead.expected, sim.x_carried):
        array.fill_(np.nan)
    sim.lead.set_out(sim)
    way = sim.lead.way.numpy()
    np.testing.assert_array_equal(sim.work.direction.numpy(), motion + way)
    np.testing.assert_array_equal(sim.x_carried.numpy(), sim.state.x.numpy() + motion)
    assert not way[sim.cloth_count :].any()
    return sim, way[: sim.cloth_count], sim.lead.expected.numpy()[: sim.cloth_count]


def less(sim, way):
    """The way without what the balls cover anyhow."""
    far = np.linalg.norm(way)
    return (1 - LED_FROM * sim.mean_edge / far) * way


@pytest.mark.parametrize(
    ("before", "then", "now", "share"),
    [
        (BESIDE, 1 / FPS, 1 / FPS, 1.0),
        (3 * BESIDE, 1 / FPS, 1 / FPS, 1.0),
        (0.5 * BESIDE, 1 / FPS, 1 / FPS, 0.5),
        (BESIDE, 1 / FPS, 0.5 / FPS, 0.5),
        (BESIDE, 1 / FPS, 2 / FPS, 1.0),
    ],
    ids=["as before", "it slows down", "it goes faster", "half a step", "a longer step"],
)
def test_it_is_led_by_what_it_did_in_both_steps(before, then, now, share):
    sim, way, expected = led_by(BESIDE, before, then, now)
    told = np.tile(less(sim, share * BESIDE), (sim.cloth_count, 1))
    np.testing.assert_allclose(way, told, rtol=1e-4)
    np.testing.assert_allclose(way + expected, np.tile(min(now / then, 1.0) * BESIDE, (len(way), 1)), rtol=1e-4)


@pytest.mark.parametrize(
    ("solved", "before", "more"),
    [
        (BESIDE, (0.0, 0.0, 0.0), {}),
        (BESIDE, -BESIDE, {}),
        ((0.0, 0.0, 0.0), BESIDE, {}),
        (0.05 * BESIDE, BESIDE, {}),
        (BESIDE, BESIDE, {"comes_along": True}),
        (BESIDE, BESIDE, {"then": 0.0}),
    ],
    ids=["a blow", "to and fro", "stopped", "slow", "comes along", "unknown"],
)
def test_it_is_led_nowhere(solved, before, more):
    _, way, expected = led_by(solved, before, **more)
    assert not way.any()
    np.testing.assert_array_equal(expected, np.tile(np.float32(solved) * (more.get("then") != 0.0), (len(way), 1)))


def test_what_differs_from_vertex_to_vertex_is_not_led():
    """Beside what all do."""
    sim = on_slope()
    noise = 0.3 * sim.mean_edge * np.random.default_rng(2).normal(size=(sim.all_count, 3))
    for array in (sim.solved, sim.lead.before):
        array.assign((BESIDE + noise).astype(np.float32))
    sim.lead.time.fill_(1 / FPS)
    sim.state.dt.fill_(1 / FPS)
    sim.work.direction.zero_()
    sim.lead.set_out(sim)
    way = sim.lead.way.numpy()[: sim.cloth_count]
    assert (way - less(sim, BESIDE)).std(axis=0).max() < 0.33 * noise.std()


def test_who_did_not_move_is_led_nowhere_by_its_neighbours():
    """As a piece that flies beside one that it is buttoned to: all of its way is in the motion already."""
    sim = on_slope()
    solved = np.tile(np.float32(BESIDE), (sim.all_count, 1))
    solved[40] = 0.0
    for array in (sim.solved, sim.lead.before):
        array.assign(solved)
    sim.lead.time.fill_(1 / FPS)
    sim.state.dt.fill_(1 / FPS)
    sim.lead.set_out(sim)
    way = sim.lead.way.numpy()
    assert not way[40].any()
    assert way[[39, 41]].all()


def test_who_begins_elsewhere_is_led_nowhere():
    sim = on_slope()
    for k in range(6):
        sim.advance(STILL, (k + 1) / FPS)
    assert sim.lead.way.numpy().any()
    sim.start_at(sim.cloth_positions().astype(float), sim.body_positions().astype(float), STILL)
    for k in range(6, 8):
        sim.advance(STILL, (k + 1) / FPS)
        assert not sim.lead.way.numpy().any()


def test_parts_of_a_step_lead_as_far_together():
    sim, way, _ = led_by(BESIDE, BESIDE)
    sim.lead.begin_in_parts(sim, 4)
    motion = np.random.default_rng(1).normal(size=(sim.all_count, 3)).astype(np.float32)
    gone = np.zeros_like(motion)
    for _ in range(4):
        sim.work.direction.assign(motion)
        sim.lead.set_out_in_part(sim)
        gone += sim.work.direction.numpy()
    np.testing.assert_allclose(gone[: sim.cloth_count], 4 * motion[: sim.cloth_count] + way, rtol=0, atol=1e-5)
    np.testing.assert_allclose(sim.x_carried.numpy(), sim.state.x.numpy() + 4 * motion, rtol=0, atol=1e-5)


@pytest.mark.parametrize(("went", "taken"), [(0.0, 0.0), (0.4, 0.4), (1.0, 1.0), (-0.5, 0.0), (1.5, 1.0)])
def test_what_was_led_is_told_from_what_the_body_did(went, taken):
    """By how far it came on its way, if something stopped it."""
    sim, way, _ = led_by(BESIDE, BESIDE)
    carried = np.random.default_rng(3).normal(size=(sim.all_count, 3)).astype(np.float32)
    sim.x_carried.assign(carried)
    x = carried.copy()
    x[: sim.cloth_count] += went * way
    sim.state.x.assign(x)
    sim.lead.part(sim)
    left = x.copy()
    left[: sim.cloth_count] -= taken * way
    np.testing.assert_allclose(sim.x_carried.numpy(), left, rtol=0, atol=1e-6)


def test_after_a_void_step_nobody_is_led_until_two_more_are_known(monkeypatch):
    """What a step that was given up has not done is no motion to go on with, nor what was done before it."""
    sim = on_slope()
    for k in range(6):
        sim.advance(STILL, (k + 1) / FPS)
    assert sim.lead.way.numpy().any()
    for name, told in (("ended_astray", True), ("led_astray", True), ("goes_as_one", False)):
        monkeypatch.setattr(correct, name, lambda *_, told=told: told)
    monkeypatch.setattr(correct, "SHARES", ())
    assert sim.advance(STILL, 7 / FPS).retries == 1
    monkeypatch.undo()
    for k in (8, 9):
        sim.lead.way.fill_(np.nan)
        sim.advance(STILL, k / FPS)
        assert not sim.lead.way.numpy().any()
    sim.advance(STILL, 10 / FPS)
    assert sim.lead.way.numpy().any()
