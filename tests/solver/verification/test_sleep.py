"""Sleep: nothing is done while nothing moves, it begins only where nothing would have moved, and it ends with the first
motion. The scene is a square of cloth that hangs over a ball."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from effect_scenes import SCENES
from scipy.signal import butter, sosfiltfilt
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.linalg import launch as launching
from tryon_solver.scene import LIVE, WORN, Gravity, Scene, Sleep
from tryon_solver.simulation import build

DT = 1 / 60
SLEEP = Sleep(speed=1e-3, fastest=2e-3, time=0.3, shift=1e-4)
# what tells whether the body moves: its skin, and how far that is from where it was
LOOKING = {"skin_vertices", "subtract_kernel", "largest_kernel"}


def drape(effects):
    garment, x = sheet(11, 11, 0.4, 0.4)
    ball, faces = icosphere(0.15, 3)
    x = x + np.array([0.01, 0.154, -0.02])
    return build(Scene(garment, x, rigid_body(ball, faces), fabric(), effects), None, "cpu", STILL)


def moved(by):
    return replace(STILL, root=np.array([by, 0.0, 0.0]))


@pytest.fixture(scope="module")
def fallen_asleep():
    """The simulation as it falls asleep, the frames until then (T, N, 3) m and the last report."""
    sim, frames, report = drape((*WORN, SLEEP)), [], None
    frames.append(sim.cloth_positions().astype(np.float64))
    while not sim.state.asleep:
        assert len(frames) < 600, "it never comes to rest"
        report = sim.advance(STILL, len(frames) * DT)
        frames.append(sim.cloth_positions().astype(np.float64))
    return sim, np.array(frames), report


@pytest.fixture
def asleep(fallen_asleep):
    """The same once more for a test that wakes it: state and clock are put back afterwards."""
    sim = fallen_asleep[0]
    kept = {name: wp.clone(value) for name, value in vars(sim.state).items() if isinstance(value, wp.array)}
    numbers = {name: value for name, value in vars(sim.state).items() if not isinstance(value, wp.array)}
    skin, pose = wp.clone(sim.body.skin_now), sim.body.pose
    yield sim
    for name, value in kept.items():
        wp.copy(getattr(sim.state, name), value)
    vars(sim.state).update(numbers)
    wp.copy(sim.body.skin_now, skin)
    sim.body.pose = pose


def test_what_falls_is_not_still_even_where_no_time_of_stillness_is_asked_for():
    """Steps have a start of no speed, and an end."""
    garment, x = sheet(3, 3, 0.1, 0.1)
    sim = build(Scene(garment, x, None, fabric(), (Gravity(), replace(SLEEP, time=0.0))))
    for k in range(30):
        sim.advance(None, (k + 1) * DT)
    assert not sim.state.asleep
    assert sim.cloth_positions()[:, 1].max() < -1.0
    resting = build(Scene(garment, x, None, fabric(), (replace(SLEEP, time=0.0),)))
    resting.advance(None, DT)
    assert resting.state.asleep


@pytest.mark.parametrize("g", [1e-4, 2e-3])
def test_what_begins_to_fall_by_little_does_not_sleep(g):
    """It is slower than it may be for longer than a garment has to be still."""
    garment, x = sheet(3, 3, 0.1, 0.1)
    sim = build(Scene(garment, x, None, fabric(), (Gravity((0.0, -g, 0.0)), SLEEP)))
    for k in range(60):
        sim.advance(None, (k + 1) * DT)
    assert not sim.state.asleep
    fallen = x[:, 1].mean() - sim.cloth_positions()[:, 1].mean()
    assert fallen == pytest.approx(0.5 * g, rel=0.05)


def test_it_falls_asleep_after_the_time_of_stillness_and_says_so(fallen_asleep):
    sim, frames, report = fallen_asleep
    assert report.asleep
    assert report.steps == 1
    speed = np.linalg.norm(np.diff(frames, axis=0), axis=2) / DT
    still = round(SLEEP.time / DT)
    assert speed[:-still].max() > 0.1, "it fell and swung before"
    assert (speed[-still:] <= 1.01 * SLEEP.fastest).all()
    assert (np.sqrt((speed[-still:] ** 2).mean(1)) <= 1.01 * SLEEP.speed).all()
    before = speed[-still - 1]
    assert before.max() > 0.99 * SLEEP.fastest or np.sqrt((before**2).mean()) > 0.99 * SLEEP.speed, "and no later"
    assert not sim.state.v.numpy().any()


@pytest.mark.long
def test_what_falls_asleep_would_have_been_at_rest_without_sleep(fallen_asleep):
    """For a second from that moment on: trembling above 8 Hz and all motion at most 1 mm/s RMS."""
    _, frames, _ = fallen_asleep
    awake = drape(WORN)
    watched = []
    for k in range(1, len(frames) + 61):
        awake.advance(STILL, k * DT)
        watched.append(awake.cloth_positions().astype(np.float64))
    np.testing.assert_array_equal(watched[len(frames) - 2], frames[-1])
    velocity = np.diff(np.array(watched), axis=0)[len(frames) - 2 :] / DT
    assert len(velocity) == 61
    fast = sosfiltfilt(butter(4, 8, "high", fs=1 / DT, output="sos"), velocity, axis=0)
    assert np.sqrt((fast**2).sum(-1).mean()) <= 1e-3
    assert np.sqrt((velocity**2).sum(-1).mean()) <= 1e-3
    assert velocity.any(), "it is only slow: the comparison is not of two that sleep"


def test_asleep_frames_are_equal_bytes_and_nothing_is_solved(asleep, monkeypatch):
    sim = asleep
    cloth, surface, time = sim.cloth_positions().tobytes(), sim.body_positions().tobytes(), sim.state.time
    launched, launch = set(), launching._Packed.launch

    def recorded(packed, *arguments):
        launched.add(packed.command.kernel.key)
        return launch(packed, *arguments)

    monkeypatch.setattr(launching._Packed, "launch", recorded)
    for k in range(1, 121):
        report = sim.advance(moved(0.5 * SLEEP.shift * np.sin(k)), time + k * DT)
        assert report.asleep
        assert (report.steps, report.newton_iterations, report.times_ms) == (0, 0, {})
        assert report.time == pytest.approx(time + k * DT)
        assert report.pairs > 0
        assert sim.cloth_positions().tobytes() == cloth
        assert sim.body_positions().tobytes() == surface
    assert launched == LOOKING


def test_the_first_motion_wakes_it_gently(asleep):
    """The body sets off at 0.05 m/s: it is simulated at once, no vertex faster than 0.1 m/s, and follows."""
    sim = asleep
    before, time = sim.cloth_positions().astype(np.float64), sim.state.time
    sim.advance(STILL, time + 5 * DT)
    report = sim.advance(moved(0.05 * DT), time + 6 * DT)
    assert not report.asleep
    assert report.steps == 1
    speed = np.linalg.norm(sim.cloth_positions() - before, axis=1) / DT
    assert 0.01 < speed.max() <= 0.1
    assert np.abs(sim.body_positions() - sim.body.skin_now.numpy()).max() < 1e-3
    sim.wake()


def test_slow_drift_wakes_it_too(asleep):
    """A tenth of `shift` a frame adds up: what counts is the way since it fell asleep."""
    sim = asleep
    time = sim.state.time
    slept = [sim.advance(moved(0.1 * k * SLEEP.shift), time + k * DT).asleep for k in range(1, 21)]
    assert slept[:9] == [True] * 9
    assert not any(slept[11:])


def test_it_can_be_woken_by_hand(asleep):
    sim = asleep
    time = sim.state.time
    sim.wake()
    report = sim.advance(STILL, time + DT)
    assert report.steps == 1
    assert not report.asleep


def test_a_moved_origin_does_not_wake_it(asleep):
    sim = asleep
    time, before = sim.state.time, sim.cloth_positions()
    sim.move_origin(np.array([2.0, 0.0, -1.0]))
    assert sim.advance(replace(STILL, root=np.array([-2.0, 0.0, 1.0])), time + DT).asleep
    np.testing.assert_allclose(sim.cloth_positions() + np.array([2.0, 0.0, -1.0]), before, atol=3e-7)


def test_scene_that_its_cost_is_measured_in_sleeps_through_most_of_it():
    """60 frames, of which the last 45 are timed (tests/support/effect_costs.py)."""
    sim, _ = next(scene for scene in SCENES if scene.name == "Sleep").built(9, with_it=True)
    slept = [sim.advance(None, (k + 1) / 60).asleep for k in range(60)]
    assert not any(slept[:30])
    assert sum(slept[15:]) > 45 / 2


def test_sleep_is_for_live_garments_and_absent_otherwise():
    assert not drape(WORN).plan.stage("sleep")
    assert len(drape(LIVE).plan.stage("sleep")) == 1
