"""What a tracker says that can't be: a slip is dropped, a leap is followed, noise keeps nobody behind."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tryon_server.sessions.outliers import Gate
from tryon_server.sessions.smoothing import PlaceFilter, Smoothing, TurnFilter

DT = 1 / 60
SECOND = 60  # samples
NOISE = 3e-3  # m
WALK = 1.4  # m/s


def walk(seconds: int, speed: float = WALK) -> np.ndarray:
    """A place (T, 3) m in steady motion along x."""
    track = np.zeros((seconds * SECOND, 3))
    track[:, 0] = speed * DT * np.arange(len(track))
    return track


def filtered(track: np.ndarray) -> np.ndarray:
    """(T, 3) of one joint."""
    places = PlaceFilter(Smoothing())
    return np.array([places.next(place[None], DT)[0] for place in track])


def turned(angles: np.ndarray) -> np.ndarray:
    """(T,) rad of one joint about an axis that is none of the world's, filtered."""
    axis = np.array([0.6, 0.0, 0.8])
    turns = TurnFilter(Smoothing())
    told = Rotation.from_rotvec(angles[:, None] * axis).as_quat()
    result = np.array([turns.next(turn[None], DT)[0] for turn in told])
    return np.unwrap(2.0 * np.arctan2(result[:, :3] @ axis, result[:, 3]), period=2 * np.pi)


def off(track: np.ndarray, at: list[int] | slice, by: float) -> np.ndarray:
    """The track with these samples a way of `by` m to the side and up."""
    wrong = track.copy()
    wrong[at] += np.array([0.0, 0.6, 0.8]) * by
    return wrong


@pytest.mark.parametrize("speed", [0.0, WALK])
@pytest.mark.parametrize("by", [0.5, 5.0, 1000.0])
@pytest.mark.parametrize("wrong", [[300], [300, 301], list(range(300, 600, SECOND))])
def test_a_slip_leaves_nothing(speed, by, wrong):
    """One, two in a row, one a second; of two in a row the second could have gone 40 cm."""
    track = walk(12, speed)
    np.testing.assert_allclose(filtered(off(track, wrong, by)), track, atol=1e-9)


@pytest.mark.parametrize("speed", [0.0, WALK])
def test_a_slip_leaves_the_noise_as_it_was_found(speed):
    """The sample is not seen: what differs at first is its noise, which nobody knows."""
    clean = walk(8, speed) + np.random.default_rng(7).normal(0.0, NOISE, (8 * SECOND, 3))
    without, with_one = filtered(clean), filtered(off(clean, [300], 5.0))
    np.testing.assert_array_equal(with_one[:300], without[:300])
    assert 0.0 < np.abs(with_one - without).max() <= 4 * NOISE
    assert np.abs(with_one - without)[300 + 2 * SECOND :].max() <= 0.1 * NOISE


@pytest.mark.parametrize("by", [1.0, 50.0])
@pytest.mark.parametrize("noise", [0.0, NOISE])
def test_another_origin_is_followed_within_a_tenth_of_a_second(by, noise):
    track = walk(10) + np.random.default_rng(8).normal(0.0, noise, (10 * SECOND, 3))
    before, after = filtered(track), filtered(off(track, slice(300, None), by))
    np.testing.assert_allclose(after[302:], off(before, slice(None), by)[302:], atol=1e-9 + 6 * noise)
    np.testing.assert_allclose(after[300:302], before[300:302], atol=1e-9 + 6 * noise)  # until it is sure


def test_the_first_sample_may_be_the_wrong_one():
    track = walk(2)
    np.testing.assert_allclose(filtered(off(track, [0], 5.0))[3:], track[3:], atol=1e-9)


def test_a_tracker_that_is_nowhere_twice_does_not_hold_the_wearer_for_ever():
    """Samples all over a hall agree with nothing; the newest counts after a quarter of a second."""
    rng = np.random.default_rng(9)
    track = np.zeros((2 * SECOND, 3))
    track[60:] = rng.uniform(-1000.0, 1000.0, (60, 3))
    followed = filtered(track)
    np.testing.assert_array_equal(followed[:60], 0.0)
    held = int(Smoothing().longest_hold / DT)
    np.testing.assert_array_equal(followed[60 : 59 + held], 0.0)
    assert np.abs(followed[60 + held :]).max() > 10.0


@pytest.mark.parametrize("noise", [0.02, 0.05, 0.1])
def test_noise_keeps_nobody_who_walks_farther_behind_than_stated(noise):
    track = walk(20)
    behind = (track - filtered(track + np.random.default_rng(10).normal(0.0, noise, track.shape)))[300:, 0]
    print(f"{1e3 * noise:.0f} mm of noise: {1e3 * behind.mean():.0f} mm behind")
    assert 0.0 < behind.mean() <= Smoothing().place_lag


def test_noise_keeps_no_turn_farther_behind_than_stated():
    settings = Smoothing()
    angles = settings.turn_walk * DT * np.arange(20 * SECOND)
    behind = (angles - turned(angles + np.random.default_rng(11).normal(0.0, 0.1, angles.shape)))[300:]
    print(f"{behind.mean():.3f} rad behind")
    assert 0.0 < behind.mean() <= settings.turn_lag


@pytest.mark.parametrize("speed", [0.0, 3.0])
def test_a_turn_that_slips_leaves_nothing(speed):
    angles = speed * DT * np.arange(10 * SECOND)
    wrong = angles.copy()
    wrong[300:600:SECOND] += 1.5
    wrong[430:432] += 2.5
    np.testing.assert_allclose(turned(wrong), angles, atol=1e-7)
    wrong = angles.copy()
    wrong[300:] += 1.5
    np.testing.assert_allclose(turned(wrong)[302:], wrong[302:], atol=1e-7)


def test_a_joint_that_slips_is_none_of_the_others_business():
    places, alone = PlaceFilter(Smoothing()), PlaceFilter(Smoothing())
    rng = np.random.default_rng(12)
    for k in range(120):
        told = rng.normal(0.0, NOISE, (2, 3))
        told[1] += 5.0 * (k == 60)
        both = places.next(told, DT)
        np.testing.assert_array_equal(both[0], alone.next(told[:1], DT)[0])
        assert np.abs(both[1]).max() < 10 * NOISE


def test_what_noise_explains_is_not_held_back():
    """Noise of 5 cm asks for speeds above the limit now and then."""
    gate = Gate(12.0, 3, 0.25, lambda a, b: np.sqrt(((a - b) ** 2).sum(axis=1)))
    told = np.random.default_rng(13).normal(0.0, 0.05, (600, 1, 3))
    asked = np.sqrt((np.diff(told, axis=0) ** 2).sum(-1)) / DT
    assert (asked > 12.0).any()
    for place in told:
        assert not gate.next(place, DT, np.array([np.sqrt(3.0) * 0.05]))[0].any()
