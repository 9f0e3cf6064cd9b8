"""From a later frame back to the first one: through the body's own frames, at no more than their pace."""

import numpy as np
import pytest

from tryon_solver.body.lead_back import RAMP, LeadBack
from tryon_solver.body.mesh_sequence import make_sequence

DT = 0.1
POINTS = np.random.default_rng(2).normal(size=(40, 3))
FACES = np.arange(39).reshape(-1, 3)


@pytest.fixture(scope="module")
def sequence():
    return make_sequence(np.array([POINTS + [0.0, 0.2 * k, 0.0] for k in range(11)], np.float32), FACES, DT)


@pytest.mark.parametrize("begin", [0.9, 2 * RAMP, RAMP, 0.5 * RAMP])
def test_it_goes_back_from_rest_to_rest_and_nowhere_faster(sequence, begin):
    lead = LeadBack(sequence, begin)
    times = np.linspace(-0.1, lead.duration + 0.1, 2001)
    moments = np.array([lead.sample(t).time for t in times])
    speeds = -np.diff(moments) / np.diff(times)
    assert moments[0] == begin
    assert moments[-1] == 0.0
    assert speeds.min() >= -1e-9
    assert speeds.max() <= 1.0 + 1e-9
    assert speeds.max() > 0.98
    jolts = np.abs(np.diff(speeds)) / (times[1] - times[0])
    assert jolts.max() < 1.1 / min(RAMP, begin), "it gets under way and comes to a stand gently"
    assert lead.duration == pytest.approx(begin + min(RAMP, begin))


def test_on_the_way_it_is_as_its_frames_show_it(sequence):
    lead = LeadBack(sequence, 0.8)
    for t in (0.0, 0.2, 0.5, lead.duration):
        moment = lead.sample(t)
        np.testing.assert_allclose(sequence.surface(moment)[:, 1], POINTS[:, 1] + 2.0 * moment.time, atol=1e-5)


def test_from_the_first_frame_there_is_no_way(sequence):
    lead = LeadBack(sequence, 0.0)
    assert lead.duration == 0.0
    assert lead.sample(0.0).time == 0.0
