"""The filter of trackers' poses: how far behind it is, how much noise it leaves."""

from __future__ import annotations

import numpy as np
import pytest

from tryon_server.sessions.smoothing import PlaceFilter, Smoothing, TurnFilter

DT = 1 / 60
NOISE = 3e-3  # m
SHAKE = np.radians(0.5)


def places(track: np.ndarray) -> np.ndarray:
    """A track (T, 3) of one joint, filtered."""
    filtered = PlaceFilter(Smoothing())
    return np.array([filtered.next(place[None], DT)[0] for place in track])


def about_z(angles: np.ndarray) -> np.ndarray:
    zero = np.zeros_like(angles)
    return np.stack([zero, zero, np.sin(angles / 2), np.cos(angles / 2)], axis=-1)


def turns(angles: np.ndarray) -> np.ndarray:
    """(T,) rad: turns about z of one joint, filtered, as angles."""
    filtered = TurnFilter(Smoothing())
    result = np.array([filtered.next(turn[None], DT)[0] for turn in about_z(angles)])
    return np.unwrap(2 * np.arctan2(result[:, 2], result[:, 3]), period=2 * np.pi)


def delay(track: np.ndarray, filtered: np.ndarray) -> float:
    """[s] by which `filtered` (T,) follows `track`: the shift at which they differ least."""
    shifts = np.arange(0.0, 0.12, 0.0005)
    times = DT * np.arange(len(track))
    middle = slice(len(track) // 4, None)
    errors = [np.abs(np.interp(times - shift, times, track)[middle] - filtered[middle]).mean() for shift in shifts]
    return float(shifts[int(np.argmin(errors))])


def test_at_two_metres_a_second_the_delay_is_below_thirty_milliseconds():
    along = 2.0 * DT * np.arange(120)
    track = np.stack([along, 0 * along, 0 * along], axis=-1)
    behind = (track - places(track))[60:, 0] / 2.0
    assert 0.015 < behind.max() <= 0.02
    turning = np.arange(120) * DT * 3.5
    behind = (turning - turns(turning))[60:] / 3.5
    assert 0.015 < behind.max() <= 0.02


def test_a_hand_that_waves_at_two_metres_a_second_is_hardly_later():
    """Once a second to and fro: at the turning points it is slow, and the filter heavier."""
    times = DT * np.arange(240)
    along = 2.0 / (2 * np.pi) * np.sin(2 * np.pi * times)
    track = np.stack([along, 0 * along, 0 * along], axis=-1)
    assert delay(along, places(track)[:, 0]) <= 0.03


def test_white_noise_of_a_body_at_rest_becomes_a_third_or_less():
    rng = np.random.default_rng(3)
    noisy = rng.normal(0.0, NOISE, (3000, 3))
    assert places(noisy)[300:].std() <= NOISE / 3
    shaking = rng.normal(0.0, SHAKE, 3000)
    assert turns(shaking)[300:].std() <= SHAKE / 3


def test_what_does_not_move_is_not_moved():
    still = np.tile([0.3, 1.2, -4.0], (30, 1))
    np.testing.assert_array_equal(places(still), still)
    np.testing.assert_allclose(turns(np.full(30, 1.0)), 1.0, atol=1e-12)


def test_quaternions_of_either_sign_are_one_turn():
    filtered, flipped = TurnFilter(Smoothing()), TurnFilter(Smoothing())
    for k, turn in enumerate(about_z(np.linspace(0.0, 1.0, 40))):
        a, b = filtered.next(turn[None], DT), flipped.next((turn if k % 2 else -turn)[None], DT)
        assert abs((a * b).sum()) == pytest.approx(1.0, abs=1e-12)


def test_a_joint_that_is_put_elsewhere_is_there_at_once_and_the_others_are_not():
    filtered = PlaceFilter(Smoothing())
    filtered.next(np.zeros((2, 3)), DT)
    there = np.full((2, 3), 0.02)
    filtered.put(np.array([True, False]), there)
    now = filtered.next(there, DT)
    np.testing.assert_array_equal(now[0], there[0])
    assert (now[1] < 0.9 * there[1]).all()


@pytest.mark.parametrize("kind", [PlaceFilter, TurnFilter])
def test_a_time_step_of_any_length_is_stable(kind):
    filtered, value = kind(Smoothing()), np.array([[0.0, 0.0, 0.6, 0.8]])[:, : 3 if kind is PlaceFilter else 4]
    filtered.next(value, DT)
    for dt in (1e-6, 0.49, 1e-6):
        np.testing.assert_allclose(filtered.next(value, dt), value, atol=1e-12)
