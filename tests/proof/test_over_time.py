"""Trembling of cloths that are shaken in a known way, and how far known paths lead."""

import numpy as np
import pytest
from case import Case
from over_time import travel, trembling
from timeline import Timeline

from tryon_solver.body.motion import Motion

FPS = 60.0


def shaken(frequency, amplitude, frames=150):
    """30 vertices that swing along different axes at `frequency` Hz, by `amplitude` m."""
    rng = np.random.default_rng(3)
    axis = rng.standard_normal((30, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    t = np.arange(frames)[:, None, None] / FPS
    return amplitude * np.sin(2 * np.pi * frequency * t + rng.uniform(0, 6, 30)[:, None]) * axis + axis


def test_shaking_above_8_hz_is_measured_at_its_rms():
    """Differences over 1/60 s see a sine of 12 Hz with sinc(12/60) of its speed."""
    known = 2 * np.pi * 12 * 1e-4 / np.sqrt(2) * np.sinc(12 / FPS)
    assert trembling(shaken(12.0, 1e-4), FPS) == pytest.approx(known, rel=0.05)


def test_slow_swinging_is_no_trembling():
    assert trembling(shaken(1.0, 5e-3), FPS) < 2e-5


def test_what_happens_while_the_body_stops_is_not_counted():
    cloth = shaken(0.5, 0.0)
    cloth[:15] += 1e-3 * np.random.default_rng(0).standard_normal((15, 30, 3))
    assert trembling(cloth, FPS) < 1e-4
    assert trembling(np.roll(cloth, 60, axis=0), FPS) > 1e-3


def test_a_window_too_short_to_tell_is_not_measured():
    assert trembling(shaken(12.0, 1e-4, 45), FPS) is None
    assert trembling(shaken(12.0, 1e-4, 62), FPS) is not None


def test_travel_is_the_largest_distance_between_two_places():
    circle = np.column_stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4), np.zeros(8)])
    points = np.stack([0.1 * circle, np.zeros((8, 3)), np.arange(8)[:, None] * [0, 0, 0.01]], axis=1)
    np.testing.assert_allclose(travel(points), [0.2, 0.0, 0.07], atol=1e-12)


@pytest.mark.parametrize("stopping", [0.0, 0.5])
def test_a_body_slows_evenly_to_a_stand(stopping):
    """Its clock runs at the rate 1 until the last `stopping` s, where the rate falls in a straight line to 0."""
    timeline = Timeline(None, None, FPS, 3.0, stopping, 1.0)
    t = np.linspace(0.0, 4.0, 4001)
    clock = np.array([timeline.clock(min(s, 3.0)) for s in t])
    rate = np.diff(clock) / np.diff(t)
    expected = np.clip((3.0 - 0.5 * (t[1:] + t[:-1])) / stopping, 0, 1) if stopping else (t[1:] <= 3.0).astype(float)
    np.testing.assert_allclose(rate, expected, atol=1e-3)
    assert clock[-1] == pytest.approx(3.0 - stopping / 2)


def test_without_a_time_the_motion_is_played_once_to_its_end():
    """At 10 fps the 21 frames of the clip last 2 s; the last half second takes three quarters of one."""
    roots = np.zeros((21, 3))
    roots[:, 0] = np.linspace(0.0, 1.0, 21)
    turns = np.zeros((21, 2, 4))
    turns[..., 3] = 1.0
    motion = Motion(roots, turns, 0.1)
    case = Case("tshirt", "clip", "cotton_jersey", "live", "cpu", 0.02, 10.0, 1.0, 0.0, 0.5, 1.0, 2)
    timeline = Timeline.build(motion.pose(0), motion, case)
    assert timeline.last_moving == round(10 * (1.0 + 2.0 + 0.25))
    assert timeline.pose(20).root[0] == pytest.approx(0.5)
    assert timeline.pose(timeline.last_moving).root[0] == pytest.approx(1.0, abs=0.01)
    assert timeline.pose(timeline.frame_count).root[0] == timeline.pose(timeline.last_moving).root[0]
