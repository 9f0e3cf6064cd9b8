"""A recording from a server is judged like any other run."""

import numpy as np
import pytest
from case import LiveCase
from live_case import judged
from tube_on_ball import Dressed

from tryon_client import Recording

CASE = LiveCase("tube", "walk", "cotton_jersey", "draft", "http://127.0.0.1:1", 80, 1)


def untouched(_frame, cloth):
    return cloth


def recorded(spoil=untouched, sway=0.006):
    """80 frames of a tube whose lower half sways by `sway` m to either side; `spoil` may change the cloth."""
    dressed = Dressed()
    recording = Recording(dressed.topology)
    for k in range(80):
        swayed = dressed.cloth + np.array([sway * np.sin(k / 8), 0, 0]) * (dressed.cloth[:, 1:2] < 0)
        recording.add(dressed.frame(spoil(k, swayed), dressed.body))
    return recording


def broken(recording):
    return {b["limit"]: b["first"] for b in judged(CASE, recording)["broken"]}


def test_a_sound_recording_breaks_no_limit():
    assert broken(recorded()) == {}


def test_a_frame_with_a_vertex_in_the_body_is_named():
    def spoil(k, cloth):
        cloth[np.argmin(np.abs(cloth[:, 1]))] *= np.where(k == 33, 0.7, 1.0)
        return cloth

    assert broken(recorded(spoil))["intersections"] == 33


def test_a_garment_that_slides_off_is_named():
    assert broken(recorded(lambda k, cloth: cloth + np.array([0, 0.02 * k, 0])))["no longer worn"] == 20


def test_a_frozen_garment_does_not_pass():
    assert broken(recorded(sway=0.0)) == {"hem travel [m]": None}


def test_rates_are_those_of_the_frames():
    result = judged(CASE, recorded())
    assert result["ms_a_frame"] == pytest.approx(1000 / 60, rel=1e-3)
    assert result["simulated_over_wall"] == pytest.approx(1.0)
    assert result["frames"] == result["frames_asked"] == 80
