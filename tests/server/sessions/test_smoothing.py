"""The filter of trackers' poses: how far behind it is, how much noise it leaves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tryon_server.runtime.motions import load_motion
from tryon_server.sessions.smoothing import PlaceFilter, Smoothing, TurnFilter
from tryon_solver.body.model import default_body
from tryon_solver.body.pose import Pose, skin

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


def moving_at_two_metres_a_second() -> tuple[np.ndarray, np.ndarray]:
    """A place (T, 3) m, and a turn (T,) rad as fast as a hand that is 57 cm away."""
    along = 2.0 * DT * np.arange(600)
    return np.stack([along, 0 * along, 0 * along], axis=-1), 1.75 * along


def test_what_moves_without_noise_is_followed_at_once():
    track, turning = moving_at_two_metres_a_second()
    np.testing.assert_allclose(places(track), track, atol=1e-9)
    np.testing.assert_allclose(turns(turning), turning, atol=1e-9)


def test_at_two_metres_a_second_the_delay_is_below_thirty_milliseconds_with_noise_too():
    rng = np.random.default_rng(1)
    track, turning = moving_at_two_metres_a_second()
    behind = (track - places(track + rng.normal(0.0, NOISE, track.shape)))[60:, 0] / 2.0
    assert 0.001 < behind.mean() <= 0.03
    behind = (turning - turns(turning + rng.normal(0.0, SHAKE, turning.shape)))[60:] / 3.5
    assert 0.001 < behind.mean() <= 0.03


def test_a_hand_that_waves_at_two_metres_a_second_is_hardly_later():
    """Once a second to and fro: at the turning points it is slow, and the filter heavier."""
    times = DT * np.arange(240)
    along = 2.0 / (2 * np.pi) * np.sin(2 * np.pi * times)
    track = np.stack([along, 0 * along, 0 * along], axis=-1)
    assert delay(along, places(track)[:, 0]) <= 0.03
    noisy = track + np.random.default_rng(2).normal(0.0, NOISE, track.shape)
    assert delay(along, places(noisy)[:, 0]) <= 0.03


@pytest.mark.parametrize("share", [0.1, 1.0])
def test_white_noise_of_a_body_at_rest_leaves_next_to_no_speed(share):
    rng = np.random.default_rng(3)
    still = places(rng.normal(0.0, share * NOISE, (3000, 3)))[300:]
    assert np.sqrt((np.diff(still, axis=0) ** 2).sum(-1).mean()) / DT <= 1.4 * Smoothing().place_unrest
    assert 1e-6 < still.std() <= 0.5 * share * NOISE
    filtered, angles = TurnFilter(Smoothing()), rng.normal(0.0, share * SHAKE, (3000, 3))
    shaken = np.array([filtered.next(turn[None], DT)[0] for turn in Rotation.from_rotvec(angles).as_quat()])[300:]
    steps = (Rotation.from_quat(shaken[:-1]).inv() * Rotation.from_quat(shaken[1:])).magnitude()
    assert 1e-6 < np.sqrt((steps**2).mean()) / DT <= 1.4 * Smoothing().turn_unrest


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 5))])
def test_the_skin_of_a_body_at_rest_hardly_moves_when_every_joint_is_told_with_noise(seed):
    """3 mm of the root and half a degree of each joint: 10 mm/s at most, RMS over the skin; it comes with 1400."""
    body, rng = default_body(), np.random.default_rng(seed)
    rest = Pose.rest(body)
    roots, rotations = PlaceFilter(Smoothing()), TurnFilter(Smoothing())
    speeds, last, last_raw = [], None, None
    for _ in range(1200):
        shake = Rotation.from_rotvec(rng.normal(0.0, SHAKE, (body.joint_count, 3)))
        told = rest.root + rng.normal(0.0, NOISE, 3), (shake * Rotation.from_quat(rest.rotations)).as_quat()
        pose = Pose(roots.next(told[0][None], DT)[0], rotations.next(told[1], DT))
        now, raw = skin(body, pose)[::29], skin(body, Pose(*told))[::29]
        if last is not None:
            speeds.append([((a - b) ** 2).sum(-1).mean() / DT**2 for a, b in ((now, last), (raw, last_raw))])
        last, last_raw = now, raw
    filtered, untouched = np.sqrt(np.mean(speeds[300:], axis=0))
    print(f"{1e3 * filtered:.1f} mm/s of {1e3 * untouched:.0f}")
    assert untouched > 1.0
    assert filtered <= 0.01


def test_a_walk_without_noise_comes_through():
    body = default_body()
    walk = load_motion("walk", body)
    roots, rotations = PlaceFilter(Smoothing()), TurnFilter(Smoothing())
    lags = []
    for k in range(120):
        told = walk.sample(k * DT, loop=True)
        pose = Pose(roots.next(told.root[None], DT)[0], rotations.next(told.rotations, DT))
        if k >= 30:
            lags.append(((skin(body, pose)[::7] - skin(body, told)[::7]) ** 2).sum(-1).mean())
    print(f"{1e3 * np.sqrt(np.mean(lags)):.1f} mm RMS")
    assert np.sqrt(np.mean(lags)) <= 5e-3


def test_noise_that_ends_is_forgotten():
    rng = np.random.default_rng(5)
    track = np.zeros((300, 3))
    track[:120] = rng.normal(0.0, NOISE, (120, 3))
    track[240:, 0] = 0.05 * DT * np.arange(60)  # 5 cm/s: slower than what such noise explains
    assert np.abs(places(track) - track)[-20:].max() < 2e-3
    always = track + rng.normal(0.0, NOISE, track.shape)
    assert np.abs(places(always) - track)[-20:].mean(axis=0)[0] > 4e-3


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
    rng = np.random.default_rng(6)
    for _ in range(60):
        filtered.next(rng.normal(0.0, NOISE, (2, 3)), DT)
    there = np.full((2, 3), 0.02)
    filtered.put(np.array([True, False]), there)
    now = filtered.next(there, DT)
    np.testing.assert_allclose(now[0], there[0], atol=1e-12)
    assert (now[1] < 0.7 * there[1]).all()


@pytest.mark.parametrize("kind", [PlaceFilter, TurnFilter])
def test_a_time_step_of_any_length_is_stable(kind):
    filtered, value = kind(Smoothing()), np.array([[0.0, 0.0, 0.6, 0.8]])[:, : 3 if kind is PlaceFilter else 4]
    filtered.next(value, DT)
    for dt in (1e-6, 0.49, 1e-6):
        np.testing.assert_allclose(filtered.next(value, dt), value, atol=1e-12)
