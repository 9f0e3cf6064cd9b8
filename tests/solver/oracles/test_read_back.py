"""What is read back from the device is what was there, and a frame seldom waits for it."""

import sys

import numpy as np
import pytest
import warp as wp
from contact_scenes import sleeve_on_limb
from scipy.spatial.transform import Rotation

from tryon_solver.body.pose import Pose
from tryon_solver.linalg import read_back
from tryon_solver.linalg.device_loop import KeptGraph
from tryon_solver.linalg.read_back import read
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

# The travel that sub-steps are counted by, what the search found or whether the list still holds, the filter of the
# motion, the pairs to begin with where they are counted, the correction's end, the check of the commit, which a GPU
# makes by itself, and the report, which a GPU tells with the correction's end.
WAITS = {"cpu": 7, "cuda:0": 4}
WAITS_MOVING = 2  # on a GPU: all of the motion at once, and the correction's end with the report
SETTLED = 16  # frames, after which nobody searches further and no list grows


def test_what_is_read_is_what_was_there_and_stays_so(device):
    """Also where memory is kept for arrays that were longer, or shorter, and of a slice."""
    for length in (3, 7, 2):
        whole = wp.array(np.arange(length), dtype=wp.int32, device=device)
        share = wp.array(0.5 * np.arange(length + 1), dtype=wp.float32, device=device)
        found = read(whole, share, share[1:2], whole)
        whole.fill_(-1)
        share.fill_(-1.0)
        read(whole, share, share[1:2], whole)
        expected = range(length), 0.5 * np.arange(length + 1), [0.5], range(length)
        for one, values in zip(found, expected, strict=True):
            np.testing.assert_array_equal(one, values)
        assert [one.dtype for one in found] == [np.int32, np.float32, np.float32, np.int32]


def limb_bent(degrees):
    """The pose of the sleeve's limb."""
    bent = Rotation.from_euler("y", degrees, degrees=True).as_quat()
    return Pose(np.zeros(3), np.array([[0.0, 0, 0, 1], bent]))


@pytest.fixture
def waits(monkeypatch):
    """The functions that waited, one entry a wait. What runs as a graph on a GPU is left out: there it reads nothing,
    though the same on a CPU does."""
    waited, graphs = [], []
    wait, own, run = read_back.wait, wp.array.numpy, KeptGraph.run

    def note(frame):
        if not graphs:
            waited.append(f"{frame.f_globals['__name__']}.{frame.f_code.co_name}")

    def counted(on, event=None):
        note(sys._getframe(2))
        wait(on, event)

    def numpy(array):
        caller = sys._getframe(1)
        if caller.f_globals["__name__"].startswith("tryon_solver") and caller.f_globals is not vars(read_back):
            note(caller)
        return own(array)

    def run_uncounted(*arguments):
        graphs.append(1)
        run(*arguments)
        graphs.pop()

    monkeypatch.setattr(read_back, "wait", counted)
    monkeypatch.setattr(wp.array, "numpy", numpy)
    monkeypatch.setattr(KeptGraph, "run", run_uncounted)
    return waited


def test_arrays_are_read_with_one_wait(device, waits):
    one = wp.zeros(1, dtype=wp.int32, device=device)
    read(one, wp.zeros(2, dtype=wp.float32, device=device), one)
    assert len(waits) == 1


def test_a_frame_at_rest_in_contact_waits_seldom(device, waits):
    """A sleeve that has come to rest on a limb, at one step a frame."""
    still = limb_bent(0.0)
    sim = build(sleeve_on_limb().scene, PRESETS["draft"], device, still)
    for k in range(1, SETTLED + 8):
        waits.clear()
        report = sim.advance(still, k / 60)
        assert (report.steps, report.substeps, report.retries) == (1, 1, 0)
        if k >= SETTLED:
            assert report.pairs > 20
            assert len(waits) == WAITS[device], waits


@pytest.mark.gpu
def test_a_frame_of_a_body_that_moves_waits_twice(waits):
    """The limb bends by a third of a degree a frame, 2 mm at its end."""
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    sim = build(sleeve_on_limb().scene, PRESETS["draft"], "cuda:0", limb_bent(0.0))
    counts = []
    for k in range(1, 31):
        waits.clear()
        sim.advance(limb_bent(k / 3), k / 90)
        counts.append(len(waits))
    assert sorted(counts)[len(counts) // 2] == WAITS_MOVING, counts
